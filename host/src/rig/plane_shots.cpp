// SPDX-License-Identifier: Apache-2.0
#include "rig/plane_shots.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>

namespace symrig {
namespace {

constexpr std::uint32_t all_planes(int planes) {
  return (std::uint32_t{1} << static_cast<unsigned>(planes)) - 1;
}

/// The planes whose code has a bit.
std::uint32_t planes_with(unsigned bit, int planes) {
  std::uint32_t lit = 0;
  for (int j = 0; j < planes; ++j)
    if ((static_cast<unsigned>(j + 1) >> bit & 1U) != 0) lit |= std::uint32_t{1} << static_cast<unsigned>(j);
  return lit;
}

/// A dark and a bright shot, then two of each plane: of the planes that a bit of the codes lights, and of the
/// others.
std::vector<PlaneShot> code_shots(int planes, unsigned bit) {
  const std::uint32_t all = all_planes(planes), lit = planes_with(bit, planes);
  std::vector<PlaneShot> shots{{0, 0}, {0, all}};
  shots.reserve(2 + 2 * static_cast<std::size_t>(planes));
  for (int k = 0; k < planes; ++k) {
    shots.push_back({k, lit});
    shots.push_back({k, all & ~lit});
  }
  return shots;
}

/// What the codes' bits say about a place so far.
struct SeenCode {
  unsigned code = 0;
  bool dark = true;   // in all pictures
  bool clear = true;  // in each pair of pictures, one was bright
};

int plane_of(const SeenCode& seen, int planes) {
  if (seen.dark) return kBlackPlane;
  const bool known = seen.clear && seen.code >= 1 && seen.code <= static_cast<unsigned>(planes);
  return known ? static_cast<int>(seen.code) - 1 : kChangingPlane;
}

}  // namespace

Result<TotalLight> total_light(const TakenBracket& taken, const BracketTaker& taker,
                               const RigOptions& options) {
  SYMRIG_TRY(const Radiance seen, options.reading->photograph(taken.frames, taken.exposures, taker.camera(),
                                                              {options.scale, 1, nullptr}));
  double sum = 0, variance = 0;
  for (std::size_t i = 0; i < seen.mean.values().size(); ++i) {
    if (seen.valid.values()[i] == 0) continue;
    sum += seen.mean.values()[i];
    variance += seen.variance.values()[i];
  }
  return TotalLight{sum, std::sqrt(variance)};
}

Result<std::vector<TotalLight>> take_shots(BracketTaker& taker, const RigOptions& options,
                                           std::span<const PlaneShot> shots, Nanoseconds exposure) {
  const Grid grid = taker.projector().grid();
  std::vector<Pattern> patterns;
  patterns.reserve(shots.size());
  for (const PlaneShot& shot : shots) patterns.emplace_back(grid, 1, shot.is_lit() ? 1.F : 0.F);
  const auto bright = std::ranges::find_if(shots, &PlaneShot::is_lit);
  const auto number = static_cast<int>(std::distance(shots.begin(), bright));
  const auto planner = [&](std::span<const WantedExposure> wanted,
                           const PlaneRules& rules) -> Result<PlaneSchedule> {
    return plan_shots(shots, wanted, number, rules);
  };
  SYMRIG_TRY(const auto taken,
             taker.take(patterns, std::vector<Exposures>(shots.size(), {exposure}), planner));
  std::vector<TotalLight> light(taken.size());
  for (std::size_t i = 0; i < taken.size(); ++i) {
    SYMRIG_TRY(light[i], total_light(taken[i], taker, options));
  }
  return light;
}

Result<std::vector<int>> planes_seen(BracketTaker& taker, const RigOptions& options, Nanoseconds exposure) {
  const int planes = taker.projector().planes().planes;
  const auto bits = static_cast<unsigned>(std::bit_width(static_cast<unsigned>(planes)));
  std::vector<SeenCode> codes(static_cast<std::size_t>(planes));
  for (unsigned bit = 0; bit < bits; ++bit) {
    SYMRIG_TRY(const auto light, take_shots(taker, options, code_shots(planes, bit), exposure));
    const auto [least, most] = std::ranges::minmax(light, {}, &TotalLight::sum);
    const double half = (least.sum + most.sum) / 2;
    for (std::size_t k = 0; k < codes.size(); ++k) {
      const bool with = light[2 + 2 * k].sum > half, without = light[3 + 2 * k].sum > half;
      codes[k].code |= with ? 1U << bit : 0U;
      codes[k].dark = codes[k].dark && !with && !without;
      codes[k].clear = codes[k].clear && with != without;
    }
  }
  std::vector<int> seen;
  seen.reserve(codes.size());
  for (const SeenCode& code : codes) seen.push_back(plane_of(code, planes));
  return seen;
}

}  // namespace symrig
