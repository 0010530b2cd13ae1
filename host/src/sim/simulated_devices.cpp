// SPDX-License-Identifier: Apache-2.0

#include "sim/simulated_devices.hpp"

#include "symrig/board/board_info.hpp"
#include "symrig/projector/internal/planes.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {

SimulatedCamera::SimulatedCamera(SimulatedCameraSpec spec, board_sim::SimCamera& shutter, Develop develop)
    : spec_(std::move(spec)), shutter_(shutter), develop_(std::move(develop)) {}

/// In virtual time all frames of a run exist when it has ended, so there is no wait.
Result<std::vector<CameraFrame>> SimulatedCamera::take(std::size_t /*count*/, Nanoseconds /*patience*/) {
  const auto& frames = shutter_.frames();
  std::vector<SimulatedExposure> exposures;
  for (std::size_t i = 0; i < frames.size(); ++i)
    exposures.push_back({taken_ + i, frames[i].begin, frames[i].end});
  taken_ += frames.size();
  shutter_.reset();
  if (exposures.empty()) return std::vector<CameraFrame>{};
  SYMRIG_TRY(auto developed, develop_(exposures));
  if (spec_.tick_hz == 0) return developed;
  for (std::size_t i = 0; i < developed.size() && i < exposures.size(); ++i) {
    developed[i].stamp = {TickRate{spec_.tick_hz}.nanoseconds({exposures[i].end})};
    developed[i].stamp_of = StampOf::exposure_end;
  }
  return developed;
}

std::string SimulatedCamera::describe() const {
  return fmt::format("simulated camera {} x {}, {}", to_string(spec_.grid), spec_.channels,
                     spec_.noise.to_string());
}

SimulatedProjector::SimulatedProjector(Grid grid, board_sim::SimProjector& raster, Nanoseconds refresh_period)
    : grid_(grid), raster_(&raster), refresh_period_(refresh_period) {}

Result<void> SimulatedProjector::keep(std::span<const Pattern> patterns) {
  for (const Pattern& pattern : patterns)
    if (pattern.grid() != grid_ || pattern.channels() != 1)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("a pattern is {} with {} channels, but the projector shows {} with 1",
                               to_string(pattern.grid()), pattern.channels(), to_string(grid_)),
                   "give patterns on the projector's grid"};
  loaded_before_ += sequence_.size();
  sequence_.assign(patterns.begin(), patterns.end());
  places_.clear();
  for (const Pattern& pattern : patterns) {
    const bool dark =
        std::all_of(pattern.values().begin(), pattern.values().end(), [](float v) { return v == 0; });
    places_.push_back({dark, dark ? dark_++ : lit_++});
  }
  return {};
}

Result<void> SimulatedProjector::load(std::span<const Pattern> patterns) {
  SYMRIG_CHECK(keep(patterns));
  raster_->reset();
  return {};
}

Result<Shown> SimulatedProjector::show(std::size_t index) {
  if (host_board_ == nullptr) return Projector::show(index);
  if (index >= sequence_.size())
    return Error{ErrorCode::bad_argument,
                 fmt::format("pattern {} of {} cannot be shown", index, sequence_.size()), "load it first"};
  raster_->show(static_cast<std::int64_t>(index), *host_board_);
  const TickRate rate{host_board_->config().tick_hz};
  return Shown{raster_->refreshes(), {rate.nanoseconds({raster_->changes().back().tick})}};
}

std::string SimulatedProjector::describe() const {
  return fmt::format("simulated projector {}, refresh {:.3f} ms", to_string(grid_),
                     1e3 * seconds(refresh_period_));
}

std::vector<SimulatedProjector::Lit> SimulatedProjector::shown(std::uint64_t begin, std::uint64_t end) const {
  std::vector<Lit> lit;
  const auto& changes = raster_->changes();
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const std::uint64_t from = std::max(begin, changes[i].tick);
    const std::uint64_t to = i + 1 < changes.size() ? std::min(end, changes[i + 1].tick) : end;
    const bool exists =
        changes[i].index >= 0 && static_cast<std::size_t>(changes[i].index) < sequence_.size();
    if (from < to && exists)
      lit.push_back({static_cast<std::size_t>(changes[i].index),
                     static_cast<double>(to - from) / static_cast<double>(end - begin)});
  }
  return lit;
}

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
