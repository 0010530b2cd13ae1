// SPDX-License-Identifier: Apache-2.0

#include "symrig/projector/internal/drm_projector.hpp"

#include "projector/drm/screen.hpp"
#include "symrig/projector/internal/driver.hpp"

#include <algorithm>
#include <thread>
#include <utility>

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

/// A play() that goes on.
struct DrmProjector::Playing {
  std::vector<std::size_t> order;
  std::vector<ShownPicture> shown;
  std::optional<Error> error;
  std::jthread thread;  // last: it uses the others
};

DrmProjector::~DrmProjector() = default;  // ends the thread before the screen

Nanoseconds DrmProjector::refresh_period() const {
  return screen_->period();
}

Grid DrmProjector::screen() const {
  return screen_->grid();
}

bool DrmProjector::counts_refreshes() const {
  return screen_->counted();
}

std::vector<std::string> DrmProjector::warnings() const {
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

Result<void> DrmProjector::check_loaded(std::span<const std::size_t> indices) const {
  for (const std::size_t index : indices)
    if (index >= loaded())
      return Error{ErrorCode::bad_argument,
                   fmt::format("pattern {} is not one of the {} loaded patterns", index, loaded()),
                   "load it first"};
  return {};
}

Result<Shown> DrmProjector::show(std::size_t index) {
  if (lost_) return *lost_;
  SYMRIG_CHECK(check_loaded({&index, 1}));
  auto shown = flip_to(index);
  // After a failure it is unknown which buffer the screen shows, so none of them may be drawn into.
  if (!shown) lost_ = shown.error();
  return shown;
}

/// Checks the connection before, so that no pattern is lost, and after, because flips may succeed without a
/// display.
Result<Shown> DrmProjector::flip_to(std::size_t index) {
  SYMRIG_CHECK(screen_->check());
  auto shown = flip(index, index + 1);
  SYMRIG_CHECK(screen_->check());
  return shown;
}

/// next: what is probably shown after it.
Result<Shown> DrmProjector::flip(std::size_t index, std::size_t next) {
  const std::size_t back = buffer_with(index);
  SYMRIG_CHECK(screen_->submit(back));
  draw_ahead(next, back);
  auto shown = screen_->await();
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

Result<Shown> DrmProjector::play(std::span<const std::size_t> order) {
  if (!screen_->counted())
    return Error{ErrorCode::device_refused, screen_->route().connector_name + " does not count refreshes",
                 "use another connector or graphics card"};
  if (playing_ || order.empty())
    return Error{ErrorCode::bad_argument,
                 playing_ ? "the projector plays pictures already" : "there is no picture to play",
                 "play at least one picture, and wait for its end"};
  SYMRIG_CHECK(check_loaded(order));
  SYMRIG_TRY(const Shown first, show(order.front()));
  playing_ = std::make_unique<Playing>();
  playing_->order.assign(order.begin(), order.end());
  playing_->shown = {{order.front(), first}};
  playing_->thread = std::jthread(
      [this, &playing = *playing_](const std::stop_token& stop) { keep_playing(playing, stop); });
  return first;
}

Result<std::vector<ShownPicture>> DrmProjector::played() {
  if (!playing_)
    return Error{ErrorCode::bad_argument, "the projector plays no pictures", "call play() before"};
  playing_->thread.join();
  const auto done = std::exchange(playing_, nullptr);
  if (!done->error) {
    if (auto checked = screen_->check(); !checked) done->error = checked.error();
  }
  if (!done->error) return std::move(done->shown);
  lost_ = done->error;
  return *lost_;
}

/// The refresh that shows a picture which is requested now.
std::uint64_t DrmProjector::next_refresh(const Shown& last) const {
  constexpr Nanoseconds kRequestTime{500'000};  // a request that comes later misses its refresh
  const Nanoseconds since = screen_->now() + kRequestTime - last.since;
  return last.refresh + 1 + static_cast<std::uint64_t>(std::max<std::int64_t>(0, since / screen_->period()));
}

/// Requests a picture in every refresh: the one that belongs to the refresh in which it will appear. So a
/// late picture delays no other.
void DrmProjector::keep_playing(Playing& playing, const std::stop_token& stop) {
  const std::vector<std::size_t>& order = playing.order;
  const std::uint64_t first = playing.shown.front().shown.refresh;
  while (!stop.stop_requested()) {
    const std::uint64_t next = next_refresh(playing.shown.back().shown) - first;
    if (next >= order.size()) return;
    const std::size_t index = order[next];
    const auto shown = flip(index, next + 1 < order.size() ? order[next + 1] : index);
    if (!shown) {
      playing.error = shown.error();
      return;
    }
    playing.shown.push_back({index, *shown});
  }
}

std::string DrmProjector::describe() const {
  const projector::drm::Route& route = screen_->route();
  return fmt::format("{} ({}) {}, patterns {} in cells of {}{}", route.connector_name, screen_->driver(),
                     to_string(projector::drm::describe(route.mode)), to_string(grid_), placement_.cell,
                     screen_->counted() ? "" : ", refreshes not counted");
}

}  // namespace symrig

// The keys of `[projector]` for a screen: docs/rig-file.md.

namespace symrig::projector {
namespace {

class DrmSource final : public ProjectorSource {
 public:
  DrmSource(std::string connector, std::string mode)
      : connector_(std::move(connector)), mode_(std::move(mode)) {}

  Result<std::unique_ptr<Projector>> open(const ScreenFacts& screen, Grid grid) const override {
    DrmProjectorOptions options;
    options.connector = connector_;
    options.mode = mode_;
    options.placement = screen.placement;
    options.grid = grid;
    options.codes = screen.codes;
    SYMRIG_TRY(auto projector, DrmProjector::open(options));
    return std::unique_ptr<Projector>(std::move(projector));
  }

  Pacing pacing() const override { return Pacing::host; }

  std::string identity(const Placement& placement) const override {
    return fmt::format("projector {} {}, cell {}+{}+{}{}{}", connector_, mode_, placement.cell, placement.top,
                       placement.left, placement.mirror_rows ? ", rows mirrored" : "",
                       placement.mirror_cols ? ", columns mirrored" : "");
  }

 private:
  std::string connector_;  // "HDMI-A-1"; empty: the only connected one
  std::string mode_;       // "1920x1080@60"; empty: the preferred mode
};

std::unique_ptr<ProjectorSource> read_drm_projector(base::TableReader& table) {
  std::string connector, mode;
  table.read("connector", connector);
  table.read("mode", mode);
  return std::make_unique<DrmSource>(std::move(connector), std::move(mode));
}

}  // namespace

ProjectorDriver drm_driver() {
  return {"drm", "a screen of this computer", "", read_drm_projector};
}

}  // namespace symrig::projector
