// SPDX-License-Identifier: Apache-2.0
#include "sim/simulated_projector.hpp"

#include "symrig/board/ticks.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::sim {

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

}  // namespace symrig::sim
