// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/screen.hpp"

#include "projector/drm/takeover.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::projector::drm {
namespace {

/// `symrig list` may hold a card for a moment while it probes the connectors.
constexpr int kMasterAttempts = 5;
constexpr Nanoseconds kMasterPause{100'000'000};
constexpr std::size_t kFewestBuffers = 2;

Result<void> become_master(Cards& cards, const FoundConnector& found) {
  for (int attempt = 0; attempt < kMasterAttempts; ++attempt) {
    if (attempt > 0) found.kms->sleep_until(found.kms->now() + kMasterPause);
    if (found.kms->become_master() == 0) return {};
  }
  const auto holders = cards.holders(found.card);
  return Error{ErrorCode::device_refused,
               fmt::format("{} is in use by {}", found.card,
                           holders.empty() ? "a desktop or another program"
                                           : fmt::format("{}", fmt::join(holders, ", "))),
               "end that program first; for a desktop: sudo systemctl stop display-manager"};
}

}  // namespace

Screen::Screen(std::unique_ptr<Kms> kms, Route route)
    : kms_(std::move(kms)), route_(std::move(route)), driver_(kms_->driver()) {}

Result<std::unique_ptr<Screen>> Screen::take(Cards& cards, const std::string& connector,
                                             const std::string& mode, const ScreenOptions& options) {
  SYMRIG_TRY(const ModeRequest request, parse_mode(mode));
  SYMRIG_TRY(FoundConnector found, find_connector(cards, connector));
  SYMRIG_CHECK(become_master(cards, found));
  const bool atomic = found.kms->enable_atomic();
  SYMRIG_TRY(Route route, choose_route(*found.kms, found, request));
  std::unique_ptr<Screen> screen(new Screen(std::move(found.kms), std::move(route)));
  screen->atomic_ = atomic && !options.legacy && screen->route_.plane != 0;
  SYMRIG_CHECK(screen->make_buffers(std::max(options.buffers, kFewestBuffers)));
  SYMRIG_CHECK(screen->light_up(options));
  return screen;
}

Screen::~Screen() {
  if (saved_) saved_->restore(*kms_);
  for (const Buffer& buffer : buffers_) kms_->destroy_buffer(buffer);
  for (const std::uint32_t blob : blobs_) kms_->destroy_blob(blob);
}

/// Two buffers are enough if there is no memory for more.
Result<void> Screen::make_buffers(std::size_t count) {
  while (buffers_.size() < count) {
    auto buffer = kms_->create_buffer(grid());
    if (!buffer && buffers_.size() >= kFewestBuffers) return {};
    if (!buffer) return refusal(route_.connector_name, "no memory for its pictures", buffer.error);
    std::fill(buffer.value.words.begin(), buffer.value.words.end(), 0U);
    buffers_.push_back(buffer.value);
  }
  return {};
}

Result<void> Screen::light_up(const ScreenOptions& options) {
  saved_ = SavedScreen::take(*kms_, route_);
  Takeover takeover{*kms_, route_, *saved_, warnings_, blobs_};
  const std::uint32_t first = buffers_.front().fb;
  SYMRIG_CHECK(atomic_ ? takeover.atomic(first) : takeover.legacy(first));
  flipper_.emplace(*kms_, route_, atomic_, options.patience);
  // The number of flips is even and the order is 1, 0, 1, 0. So buffer 0 is on the screen afterwards.
  const std::uint32_t fbs[] = {buffers_[1].fb, buffers_[0].fb};
  std::string warning;
  SYMRIG_CHECK(flipper_->learn(fbs, warning));
  if (!warning.empty()) warnings_.push_back(std::move(warning));
  kms_->hotplugged(route_.connector);  // discards hot-plug messages that switching on has caused
  return {};
}

ScreenMemory Screen::memory(std::size_t buffer) const {
  return {buffers_[buffer].words, buffers_[buffer].pitch, grid()};
}

Result<Shown> Screen::await() {
  SYMRIG_TRY(const Shown shown, flipper_->await());
  // Some drivers report a flip at the beginning of the blanking, but its refresh begins at the end of the
  // blanking. A stamp further in the future is wrong; there is no wait for it.
  if (shown.since > kms_->now() && shown.since - kms_->now() < period()) kms_->sleep_until(shown.since);
  return shown;
}

bool Screen::link_is_bad() {
  for (const Property& property : kms_->properties(route_.connector, Kind::connector).value)
    if (property.name == "link-status") return property.value == DRM_MODE_LINK_STATUS_BAD;
  return false;
}

Result<void> Screen::check() {
  const bool moved = kms_->hotplugged(route_.connector);
  const auto connector = kms_->connector(route_.connector, moved);
  const std::string& name = route_.connector_name;
  if (!connector) return refusal(name, "it does not respond", connector.error);
  if (!connector.value.connected)
    return Error{ErrorCode::device_lost, "the projector at " + name + " is unplugged or off",
                 "connect it, and open it again"};
  if (moved)
    return Error{ErrorCode::device_lost, "a display was plugged in or out at " + name + " or nearby",
                 "open it again: the projector may have lost its picture for a while"};
  if (link_is_bad())
    return Error{ErrorCode::device_lost, name + ": the link to the projector failed",
                 "use a better or shorter cable, or a smaller mode; open it again"};
  return {};
}

}  // namespace symrig::projector::drm
