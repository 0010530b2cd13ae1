// SPDX-License-Identifier: Apache-2.0

#include "rig/bracket_taker.hpp"
#include "symrig/base/result.hpp"
#include "symrig/rig/rig.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {

namespace {

/// The light of a photograph: the sum over its valid pixels, and the sigma of this sum.
struct TotalLight {
  double sum = 0;
  double sigma = 0;
};

/// A plane of which the light of a slot is not the same in each refresh.
constexpr int kChangingPlane = -2;

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

/// The light of a bracket that was taken.
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

/// The light of shots with one exposure each. One of them must light its plane.
/// fails: as BracketTaker::take().
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

/// Which plane of its picture the projector shows in the time of plane 0, 1, …: its number, kBlackPlane if
/// none, or kChangingPlane.
///
/// Plane j has the code j + 1. For each bit of the codes, one picture lights the planes whose code has this
/// bit, and one lights the others. So each slot shows the code of its plane. fails: as BracketTaker::take().
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

/// Of the light of a whole plane, a plane in its place has at least this share. The edges of an exposure are
/// exact to 10 us, and a plane lasts 100 us at least: nine tenths.
constexpr double kLeastShare = 0.75;
/// The light of a plane must be so many sigmas of a photograph. Then noise does not reach from one to 3/4.
constexpr double kLeastSigmas = 40;
constexpr std::size_t kMostNamed = 3;  // planes in a message

Error wrong_latency(const BracketTaker& taker) {
  return {ErrorCode::device_refused,
          fmt::format("a bright pattern was not bright in its bit planes, {} refreshes after its picture",
                      taker.projector().planes().latency),
          "set projector.latency to the refreshes from a picture to its planes (docs/howto-projectors.md)"};
}

/// One pattern is bright. The others are black for a refresh or more before and after it, so that the bright
/// one is dark at any other time. Returns whether it was bright.
Result<bool> latency_is_right(BracketTaker& taker, const RigOptions& options, Nanoseconds exposure) {
  const Nanoseconds refresh = taker.projector().refresh_period();
  const auto around = static_cast<std::size_t>(1 + refresh / (exposure + options.setup.camera.readout));
  std::vector<Pattern> patterns(2 * around + 1, Pattern(taker.projector().grid()));
  patterns[around] = Pattern(taker.projector().grid(), 1, 1.F);
  SYMRIG_TRY(const auto taken, taker.take(patterns, std::vector<Exposures>(patterns.size(), {exposure})));
  double bright = 0, dark = 0;
  for (std::size_t i = 0; i < taken.size(); ++i) {
    SYMRIG_TRY(const TotalLight light, total_light(taken[i], taker, options));
    if (i == around) bright = light.sum;
    if (i != around) dark = std::max(dark, light.sum);
  }
  return bright > 0 && 2 * dark < bright;
}

Result<void> check_latency(BracketTaker& taker, const RigOptions& options, Nanoseconds exposure) {
  SYMRIG_TRY(const bool right, latency_is_right(taker, options, exposure));
  return right ? Result<void>() : wrong_latency(taker);
}

/// Every `step`-th plane is lit in one picture, from plane 0 to step − 1 on, with a shot in each.
void add_combs(int step, int planes, std::vector<PlaneShot>& shots) {
  for (int first = 0; first < step; ++first) {
    std::uint32_t lit = 0;
    for (int k = first; k < planes; k += step) lit |= std::uint32_t{1} << static_cast<unsigned>(k);
    for (int k = first; k < planes; k += step) shots.push_back({k, lit});
  }
}

/// Shots in each plane, alone in its picture or in combs, then a dark and a bright shot.
std::vector<PlaneShot> shots_in_combs(int planes, std::span<const int> steps) {
  std::vector<PlaneShot> shots;
  for (const int step : steps) add_combs(step, planes, shots);
  shots.push_back({planes / 2, 0});
  shots.push_back({planes / 2, (std::uint32_t{1} << static_cast<unsigned>(planes)) - 1});
  return shots;
}

std::size_t refreshes_of(std::span<const PlaneShot> shots, const PlaneRules& rules, Nanoseconds exposure) {
  std::vector<WantedExposure> wanted;
  for (std::size_t k = 0; k < shots.size(); ++k) wanted.push_back({k, 0, exposure});
  return plan_shots(shots, wanted, 0, rules).order.size();
}

/// Shots that are all bright only if each plane is in its place.
///
/// A plane alone in its picture takes a refresh. A camera that is ready after some planes may take fewer
/// pictures: n, in which every n-th plane is lit, then n + 1 with every (n + 1)-th. What is bright in the
/// place of plane k in both is k itself, or apart from k by a multiple of n and of n + 1, so by n (n + 1) or
/// more: there is none.
std::vector<PlaneShot> shots_for_check(const PlaneRules& rules, Nanoseconds exposure) {
  const int planes = rules.timing.planes;
  std::vector<PlaneShot> best = shots_in_combs(planes, std::array{planes});
  std::size_t least = refreshes_of(best, rules, exposure);
  for (int step = 1; 2 * step + 1 < planes; ++step) {
    if (step * (step + 1) < planes) continue;
    std::vector<PlaneShot> shots = shots_in_combs(planes, std::array{step, step + 1});
    const std::size_t refreshes = refreshes_of(shots, rules, exposure);
    if (refreshes >= least) continue;
    least = refreshes;
    best = std::move(shots);
  }
  return best;
}

std::string plane_text(int plane) {
  if (plane == kChangingPlane) return "changing planes";
  return plane == kBlackPlane ? "no plane" : fmt::format("plane {}", plane);
}

/// "in the place of plane 0 came plane 8, of plane 1 plane 9, …"
std::string places_text(std::span<const int> seen) {
  std::string text;
  std::size_t named = 0;
  for (std::size_t k = 0; k < seen.size() && named <= kMostNamed; ++k) {
    if (seen[k] == static_cast<int>(k)) continue;
    text += named == kMostNamed ? ", and so on"
            : named > 0         ? fmt::format(", of plane {} {}", k, plane_text(seen[k]))
                                : fmt::format("in the place of plane {} came {}", k, plane_text(seen[k]));
    ++named;
  }
  return text.empty() ? "each plane came in its place, but not in each refresh" : text;
}

bool all_come_earlier_by(int shift, std::span<const int> seen) {
  const auto planes = static_cast<int>(seen.size());
  for (int k = std::max(0, -shift); k < std::min(planes, planes - shift); ++k)
    if (seen[static_cast<std::size_t>(k)] != k + shift) return false;
  return true;
}

/// By how many places all planes come too early, at most a quarter of them: plane k + n in the place of plane
/// k. 0: not so.
int shift_of(std::span<const int> seen) {
  const auto planes = static_cast<int>(seen.size());
  for (int shift = 1; shift <= planes / 4; ++shift) {
    if (all_come_earlier_by(shift, seen)) return shift;
    if (all_come_earlier_by(-shift, seen)) return -shift;
  }
  return 0;
}

/// Whether a picture with all planes lit is bright in its refresh, whatever the order of its planes. Black
/// pictures are around three of them, at unequal distances, so that no other refresh is taken for the right
/// one twice.
Result<bool> pictures_come_in_time(BracketTaker& taker, const RigOptions& options, Nanoseconds exposure) {
  const int planes = taker.projector().planes().planes;
  const std::uint32_t all = (std::uint32_t{1} << static_cast<unsigned>(planes)) - 1;
  std::vector<PlaneShot> shots;
  std::vector<std::size_t> bright;
  for (const int black : {3, 4, 6}) {
    shots.insert(shots.end(), static_cast<std::size_t>(black), {planes / 2, 0});
    bright.push_back(shots.size());
    shots.push_back({static_cast<int>(bright.size() - 1) * planes / 3, all});
  }
  shots.insert(shots.end(), 3, {planes / 2, 0});
  SYMRIG_TRY(const auto light, take_shots(taker, options, shots, exposure));
  const auto [least, most] = std::ranges::minmax(light, {}, &TotalLight::sum);
  const double half = (least.sum + most.sum) / 2;
  return std::ranges::count_if(bright, [&](std::size_t at) { return light[at].sum > half; }) >= 2;
}

/// The setting that would put all planes in their places. Empty: there is none.
std::string remedy(const Projector& projector, std::span<const int> seen) {
  if (const std::string setting = projector.setting_for_planes(seen); !setting.empty())
    return fmt::format("set {}", setting);
  const int shift = shift_of(seen);
  if (shift == 0) return {};
  return fmt::format("the plane line's edges are {} {} {}: check its wiring, or set projector.plane_delay_us",
                     std::abs(shift), std::abs(shift) == 1 ? "plane" : "planes",
                     shift > 0 ? "late" : "early");
}

/// Says what the projector did with the planes. Light that comes in another refresh has no remedy in its
/// planes.
Error refusal(BracketTaker& taker, const RigOptions& options, Nanoseconds exposure) {
  const auto seen = planes_seen(taker, options, exposure);
  if (!seen) return seen.error();
  std::string hint = remedy(taker.projector(), *seen);
  if (hint.empty()) {
    const auto in_time = pictures_come_in_time(taker, options, exposure);
    if (!in_time) return in_time.error();
    if (!*in_time) return wrong_latency(taker);
    hint = std::ranges::find(*seen, kChangingPlane) == seen->end()
               ? "check the controller's pattern table, and close other programs that use it"
               : "each refresh must begin with plane 0: check the screen's mode and the line with the role "
                 "vsync";
  }
  return {ErrorCode::device_refused,
          fmt::format("the bit planes do not come in their order: {}", places_text(*seen)), hint};
}

/// The exposure of a shot. None: the camera has none that fits into a plane.
std::optional<Nanoseconds> exposure_in_one_plane(const BracketTaker& taker, const RigOptions& options,
                                                 Nanoseconds longest) {
  Nanoseconds exposure = std::min(longest, longest_in_one_plane(taker.plane_rules()));
  const Nanoseconds period = options.setup.projector.light_period;
  if (period.count() > 0) exposure -= exposure % period;
  const Nanoseconds least = std::max(options.setup.camera.min_exposure, taker.camera().timing().min_exposure);
  if (exposure < least || exposure.count() <= 0) return std::nullopt;
  return exposure;
}

}  // namespace

Result<void> check_planes(BracketTaker& taker, const RigOptions& options, Nanoseconds longest) {
  const auto exposure = exposure_in_one_plane(taker, options, longest);
  if (!exposure) {
    taker.warn("the order of the bit planes was not checked: no exposure of the camera fits into one plane");
    return check_latency(taker, options, longest);
  }
  const auto shots = shots_for_check(taker.plane_rules(), *exposure);
  SYMRIG_TRY(const auto light, take_shots(taker, options, shots, *exposure));
  const TotalLight& dark = light[light.size() - 2];
  const TotalLight bright = std::ranges::max(light, {}, &TotalLight::sum);
  const double span = bright.sum - dark.sum;
  const bool enough = span > 0 && span >= kLeastSigmas * bright.sigma;
  const auto in_planes = std::span(light).first(light.size() - 2);
  const auto in_place = [&](const TotalLight& one) { return one.sum - dark.sum >= kLeastShare * span; };
  if (enough && std::ranges::all_of(in_planes, in_place)) return {};
  if (enough) return refusal(taker, options, *exposure);
  // All shots were dark: their pictures came in other refreshes, or a plane has too little light to see.
  SYMRIG_CHECK(check_latency(taker, options, longest));
  taker.warn(
      "the order of the bit planes was not checked: the light of one plane is too little for the camera");
  return {};
}

}  // namespace symrig
