// SPDX-License-Identifier: Apache-2.0

#include "projector/drm/screen.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::projector::drm {

SavedScreen SavedScreen::take(Kms& kms, const Route& route) {
  SavedScreen saved;
  saved.crtc_ = kms.crtc(route.crtc).value;
  saved.crtc_.id = route.crtc;
  const auto connector = kms.connector(route.connector, false);
  if (connector.value.crtc == route.crtc) saved.connectors_.push_back(route.connector);
  saved.connectors_.insert(saved.connectors_.end(), route.other_connectors.begin(),
                           route.other_connectors.end());
  return saved;
}

void SavedScreen::remember(Kms& kms, const IdentityValue& identity) {
  SavedProperty saved{identity.setting, {}};
  saved.setting.value = identity.property.value;
  if (identity.property.blob && identity.property.value != 0)
    saved.blob = kms.blob(static_cast<std::uint32_t>(identity.property.value)).value;
  properties_.push_back(std::move(saved));
}

void SavedScreen::restore(Kms& kms) const {
  std::vector<std::uint32_t> blobs;
  for (const SavedProperty& saved : properties_) {
    Setting setting = saved.setting;
    if (!saved.blob.empty()) {
      const auto blob = kms.create_blob(saved.blob);
      if (!blob) continue;
      blobs.push_back(blob.value);
      setting.value = blob.value;
    }
    kms.set_property(setting);
  }
  const bool was_on = crtc_.mode && crtc_.fb != 0 && !connectors_.empty();
  if (!was_on || kms.set_crtc(crtc_, connectors_) != 0) kms.set_crtc(Crtc{.id = crtc_.id}, {});
  if (gamma_) kms.set_gamma(crtc_.id, *gamma_);
  for (const std::uint32_t blob : blobs) kms.destroy_blob(blob);  // the CRTC keeps the blobs that it uses
}

namespace {

constexpr int kLearningFlips = 4;
constexpr Nanoseconds kBusyPause{1'000'000};
/// Greatest distance of a stamp from a whole number of periods after the previous stamp, as a share of a
/// period.
constexpr double kStampTolerance = 0.25;

std::uint32_t property_id(Kms& kms, std::uint32_t object, ObjectKind kind, std::string_view name) {
  for (const Property& property : kms.properties(object, kind).value)
    if (property.name == name) return property.id;
  return 0;
}

/// true: the refresh count agrees with the time between two flips.
bool agrees(const Shown& before, const Shown& after, Nanoseconds period) {
  if (after.refresh <= before.refresh) return false;
  const auto count = static_cast<double>(after.refresh - before.refresh);
  return std::abs(seconds(after.since - before.since) - count * seconds(period)) <
         kStampTolerance * seconds(period);
}

}  // namespace

Flipper::Flipper(Kms& kms, const Route& route, bool atomic, Nanoseconds patience)
    : kms_(kms), route_(route), atomic_(atomic), patience_(patience) {
  if (atomic_) fb_property_ = property_id(kms, route.plane, ObjectKind::plane, "FB_ID");
}

Result<void> Flipper::learn(std::span<const std::uint32_t> fbs, std::string& warning) {
  const Errno error = kms_.counts_refreshes(route_.crtc);
  counted_ = error == 0;
  if (!counted_)
    warning = "the driver does not count refreshes: pattern times are hand-over times, not light times";
  std::optional<Shown> before;
  for (std::size_t k = 0; k < kLearningFlips; ++k) {
    SYMRIG_CHECK(submit(fbs[k % fbs.size()]));
    SYMRIG_TRY(const Shown shown, await());
    if (counted_ && before && !agrees(*before, shown, route_.period())) {
      counted_ = false;
      warning = fmt::format(
          "the driver's refresh stamps do not agree with its mode ({:.3f} ms for {} of {:.3f} ms): "
          "pattern times are hand-over times",
          1e3 * seconds(shown.since - before->since), shown.refresh - before->refresh,
          1e3 * seconds(route_.period()));
    }
    before = shown;
  }
  return {};
}

Errno Flipper::send(std::uint32_t fb) {
  if (!atomic_) return kms_.page_flip(route_.crtc, fb, token_);
  const Setting setting{route_.plane, ObjectKind::plane, fb_property_, fb};
  return kms_.commit({&setting, 1}, Commit::flip, token_);
}

Result<void> Flipper::submit(std::uint32_t fb) {
  ++token_;
  const SteadyTime deadline = kms_.now() + patience_;
  Errno error = send(fb);
  // Some drivers report a flip shortly before they accept the next one.
  while (error == EBUSY && kms_.now() < deadline) {
    kms_.next_flip(kBusyPause);
    error = send(fb);
  }
  if (error == 0) return {};
  return refusal(route_.connector_name, "the next picture was not accepted", error);
}

/// Skips events of flips whose wait timed out.
KernelAnswer<FlipEvent> Flipper::event_of_current() {
  const SteadyTime deadline = kms_.now() + patience_;
  while (true) {
    const Nanoseconds left = std::max(Nanoseconds{0}, deadline - kms_.now());
    const auto event = kms_.next_flip(left);
    if (!event || event.value.token == token_) return event;
    if (left.count() == 0) return {ETIMEDOUT, {}};
  }
}

Result<Shown> Flipper::await() {
  const auto event = event_of_current();
  if (event.error == ETIMEDOUT)
    return refusal(route_.connector_name, fmt::format("no refresh came within {:.3g} s", seconds(patience_)),
                   ETIMEDOUT);
  if (!event) return refusal(route_.connector_name, "cannot read its refresh events", event.error);
  if (!counted_) return Shown{++refresh_, event.value.stamp, false};
  SYMRIG_TRY(refresh_, extend(event.value.sequence));
  return Shown{refresh_, event.value.stamp, true};
}

/// Extends the kernel's 32-bit refresh count, which wraps after two years at 60 Hz.
Result<std::uint64_t> Flipper::extend(std::uint32_t sequence) {
  if (!began_) {
    began_ = true;
    return std::uint64_t{sequence};
  }
  const std::uint32_t step = sequence - static_cast<std::uint32_t>(refresh_);
  if (step != 0 && step < 0x8000'0000U) return refresh_ + step;
  return Error{ErrorCode::device_lost,
               fmt::format("{}: its refresh count went from {} to {}", route_.connector_name,
                           static_cast<std::uint32_t>(refresh_), sequence),
               "keep other programs off this card, and open the projector again"};
}

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
  for (const Property& property : kms_->properties(route_.connector, ObjectKind::connector).value)
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
