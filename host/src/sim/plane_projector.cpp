// SPDX-License-Identifier: Apache-2.0
#include "sim/plane_projector.hpp"

#include "projector/bit_planes.hpp"
#include "projector/dlp/plane_order.hpp"
#include "symrig/board/ticks.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {
namespace {

/// Plane k of a picture, read from its words: eight planes of green, of red, of blue, each from the lowest
/// bit.
Pattern plane_of(const Image<std::uint32_t>& picture, int plane) {
  const unsigned byte = plane < 8 ? 1 : plane < 16 ? 2 : 0;
  const unsigned bit = 8 * byte + static_cast<unsigned>(plane % 8);
  Pattern pattern(picture.grid());
  for (std::size_t i = 0; i < picture.values().size(); ++i)
    pattern.values()[i] = static_cast<float>(picture.values()[i] >> bit & 1U);
  return pattern;
}

bool same(const Pattern& a, const Pattern& b) {
  return std::equal(a.values().begin(), a.values().end(), b.values().begin());
}

}  // namespace

SimulatedPlaneProjector::SimulatedPlaneProjector(Grid grid, board_sim::SimPlaneProjector& raster,
                                                 board_sim::SimBoard& board,
                                                 const board_sim::SimPlaneProjectorConfig& config,
                                                 Nanoseconds refresh_period)
    : SimulatedProjector(grid, refresh_period), raster_(raster), board_(board) {
  const Nanoseconds period{static_cast<std::int64_t>(config.period_ns)};
  timing_ = {config.planes, period, period, Nanoseconds{static_cast<std::int64_t>(config.frame_lead_ns)},
             config.latency};
}

/// Every plane of picture k shows pattern k.
Result<void> SimulatedPlaneProjector::load(std::span<const Pattern> patterns) {
  std::vector<PlanePlan> plans;
  plans.reserve(patterns.size());
  for (std::size_t k = 0; k < patterns.size(); ++k)
    plans.emplace_back(static_cast<std::size_t>(timing_.planes), static_cast<int>(k));
  return load_planes(patterns, plans);
}

Result<void> SimulatedPlaneProjector::load_planes(std::span<const Pattern> patterns,
                                                  std::span<const PlanePlan> plans) {
  const std::vector<int> bits = projector::dlp::PlaneOrder{}.bits(timing_.planes);
  SYMRIG_TRY(auto pictures, projector::pack_planes(patterns, plans, grid(), bits));
  SYMRIG_CHECK(keep(patterns));
  pictures_ = std::move(pictures);
  split(plans);
  raster_.reset();
  return {};
}

/// Planes without a pattern have numbers of their own, far from those of patterns: a controller that shows
/// planes in another order than planned exposes them, too.
constexpr std::uint64_t kUnplanned = std::uint64_t{1} << 62U;

/// Neighbouring planes with the same bits are one light. The plan only gives the noise its number.
void SimulatedPlaneProjector::split(std::span<const PlanePlan> plans) {
  seen_.clear();
  seen_of_.clear();
  for (std::size_t f = 0; f < pictures_.size(); ++f) {
    seen_of_.emplace_back();
    ++unplanned_;
    for (int k = 0; k < timing_.planes; ++k) {
      const auto plane = static_cast<std::size_t>(k);
      const bool black = plane >= plans[f].size() || plans[f][plane] == kBlackPlane;
      const Place place = black ? Place{true, kUnplanned + unplanned_}
                                : SimulatedProjector::place(static_cast<std::size_t>(plans[f][plane]));
      Pattern pattern = plane_of(pictures_[f], k);
      const bool continues = k > 0 && seen_.back().place.number == place.number &&
                             seen_.back().place.dark == place.dark && same(seen_.back().pattern, pattern);
      if (!continues) seen_.push_back({std::move(pattern), place});
      seen_of_.back().push_back(seen_.size() - 1);
    }
  }
}

Result<void> SimulatedPlaneProjector::check_picture(std::size_t index) const {
  if (index < pictures_.size()) return {};
  return Error{ErrorCode::bad_argument,
               fmt::format("picture {} of {} cannot be shown", index, pictures_.size()), "load it first"};
}

Shown SimulatedPlaneProjector::shown_at(std::uint64_t refresh, std::uint64_t tick) const {
  return {refresh, {TickRate{board_.config().tick_hz}.nanoseconds({tick})}};
}

Result<Shown> SimulatedPlaneProjector::show(std::size_t index) {
  SYMRIG_CHECK(check_picture(index));
  const std::uint64_t tick = raster_.show(static_cast<std::int64_t>(index), board_);
  return shown_at(raster_.refreshes(), tick);
}

Result<Shown> SimulatedPlaneProjector::play(std::span<const std::size_t> order) {
  if (order.empty()) return Error{ErrorCode::bad_argument, "there is no picture to show", ""};
  std::vector<std::int64_t> pictures;
  for (const std::size_t index : order) {
    SYMRIG_CHECK(check_picture(index));
    pictures.push_back(static_cast<std::int64_t>(index));
  }
  const auto first = raster_.play(pictures, board_);
  return shown_at(first.refresh, first.tick);
}

Result<std::vector<ShownPicture>> SimulatedPlaneProjector::played() {
  std::vector<ShownPicture> shown;
  for (const auto& flip : raster_.played(board_))
    shown.push_back({static_cast<std::size_t>(flip.picture), shown_at(flip.refresh, flip.tick)});
  return shown;
}

std::string SimulatedPlaneProjector::setting_for_planes(std::span<const int> seen) const {
  return projector::dlp::order_setting(projector::dlp::PlaneOrder{}.bits(timing_.planes), seen);
}

std::string SimulatedPlaneProjector::describe() const {
  return fmt::format("simulated projector {}, {} planes of {} us", to_string(grid()), timing_.planes,
                     timing_.period.count() / 1000);
}

std::vector<SimulatedProjector::Lit> SimulatedPlaneProjector::shown(std::uint64_t begin,
                                                                    std::uint64_t end) const {
  std::vector<Lit> lit;
  for (const auto& plane : raster_.lit(begin, end)) {
    const auto picture = static_cast<std::size_t>(plane.picture);
    if (picture >= seen_of_.size()) continue;
    const std::size_t index = seen_of_[picture][static_cast<std::size_t>(plane.plane)];
    const double share = static_cast<double>(plane.ticks) / static_cast<double>(end - begin);
    if (!lit.empty() && lit.back().index == index) {
      lit.back().share += share;
    } else {
      lit.push_back({index, share});
    }
  }
  return lit;
}

}  // namespace symrig::sim
