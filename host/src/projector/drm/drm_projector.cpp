// SPDX-License-Identifier: Apache-2.0
#include "symrig/projector/drm_projector.hpp"

#include "projector/drm/screen.hpp"

#include <fmt/format.h>

namespace symrig {

Result<std::unique_ptr<DrmProjector>> DrmProjector::open(const DrmProjectorOptions& options) {
  return open(*projector::drm::machine_cards(), options);
}

Result<std::unique_ptr<DrmProjector>> DrmProjector::open(projector::drm::Cards& cards,
                                                         const DrmProjectorOptions& options) {
  if (options.buffers < 2 || options.buffers > 3)
    return Error{ErrorCode::bad_argument, fmt::format("a projector cannot use {} buffers", options.buffers),
                 "give 2 or 3"};
  const projector::drm::ScreenOptions how{static_cast<std::size_t>(options.buffers), options.legacy,
                                          options.patience};
  SYMRIG_TRY(auto screen, projector::drm::Screen::take(cards, options.connector, options.mode, how));
  SYMRIG_TRY(const Grid grid, placed_grid(screen->grid(), options.placement, options.grid));
  return std::unique_ptr<DrmProjector>(new DrmProjector(std::move(screen), options, grid));
}

DrmProjector::DrmProjector(std::unique_ptr<projector::drm::Screen> screen, const DrmProjectorOptions& options,
                           Grid grid)
    : screen_(std::move(screen)),
      placement_(options.placement),
      table_(options.codes),
      grid_(grid),
      drawn_(screen_->buffers()) {}

DrmProjector::~DrmProjector() = default;

Nanoseconds DrmProjector::refresh_period() const {
  return screen_->period();
}

Grid DrmProjector::screen() const {
  return screen_->grid();
}

bool DrmProjector::counts_refreshes() const {
  return screen_->counted();
}

const std::vector<std::string>& DrmProjector::warnings() const {
  return screen_->warnings();
}

Result<void> DrmProjector::load(std::span<const Pattern> patterns) {
  std::vector<Image<std::uint8_t>> codes;
  codes.reserve(patterns.size());
  for (const Pattern& pattern : patterns) {
    SYMRIG_TRY(auto converted, to_codes(pattern, grid_, table_, codes.size()));
    codes.push_back(std::move(converted));
  }
  codes_ = std::move(codes);
  words_.clear();
  drawn_.assign(drawn_.size(), std::nullopt);
  return {};
}

Result<void> DrmProjector::load_words(std::vector<Image<std::uint32_t>> pictures) {
  for (const Image<std::uint32_t>& picture : pictures)
    if (picture.grid() != grid_ || picture.channels() != 1)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("a picture is {} with {} channels, but the projector shows {} with 1",
                               to_string(picture.grid()), picture.channels(), to_string(grid_)),
                   "give pictures on the projector's grid"};
  words_ = std::move(pictures);
  codes_.clear();
  drawn_.assign(drawn_.size(), std::nullopt);
  return {};
}

void DrmProjector::draw_into(std::size_t buffer, std::size_t index) {
  if (words_.empty()) {
    draw(codes_[index], placement_, screen_->memory(buffer));
  } else {
    draw(words_[index], placement_, screen_->memory(buffer));
  }
  drawn_[buffer] = index;
}

Result<Shown> DrmProjector::show(std::size_t index) {
  if (lost_) return *lost_;
  if (index >= loaded())
    return Error{ErrorCode::bad_argument,
                 fmt::format("pattern {} is not one of the {} loaded patterns", index, loaded()),
                 "load it first"};
  auto shown = flip_to(index);
  // After a failure it is unknown which buffer the screen shows, so none of them may be drawn into.
  if (!shown) lost_ = shown.error();
  return shown;
}

/// Checks the connection before, so that no pattern is lost, and after, because flips may succeed without a
/// display.
Result<Shown> DrmProjector::flip_to(std::size_t index) {
  SYMRIG_CHECK(screen_->check());
  const std::size_t back = buffer_with(index);
  SYMRIG_CHECK(screen_->submit(back));
  draw_ahead(index + 1, back);
  auto shown = screen_->await();
  SYMRIG_CHECK(screen_->check());
  if (shown) front_ = back;
  return shown;
}

/// Returns a buffer that the screen does not show and that holds pattern `index`. Draws the pattern if
/// draw_ahead() did not.
std::size_t DrmProjector::buffer_with(std::size_t index) {
  std::size_t back = front_;
  for (std::size_t k = 0; k < drawn_.size(); ++k)
    if (k != front_ && (back == front_ || drawn_[k] == index)) back = k;
  if (drawn_[back] == index) return back;
  draw_into(back, index);
  return back;
}

/// Draws the most likely next pattern while the caller would wait for the refresh.
void DrmProjector::draw_ahead(std::size_t index, std::size_t waiting) {
  if (index >= loaded()) return;
  for (std::size_t k = 0; k < drawn_.size(); ++k) {
    if (k == front_ || k == waiting || drawn_[k] == index) continue;
    draw_into(k, index);
  }
}

std::string DrmProjector::describe() const {
  const projector::drm::Route& route = screen_->route();
  return fmt::format("{} ({}) {}, patterns {} in cells of {}{}", route.connector_name, screen_->driver(),
                     to_string(projector::drm::describe(route.mode)), to_string(grid_), placement_.cell,
                     screen_->counted() ? "" : ", refreshes not counted");
}

}  // namespace symrig
