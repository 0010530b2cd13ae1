// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/flipper.hpp"

#include <cerrno>
#include <cmath>

#include <fmt/format.h>

namespace symrig::projector::drm {
namespace {

constexpr int kLearningFlips = 4;
constexpr Nanoseconds kBusyPause{1'000'000};
/// Greatest distance of a stamp from a whole number of periods after the previous stamp, as a share of a
/// period.
constexpr double kStampTolerance = 0.25;

std::uint32_t property_id(Kms& kms, std::uint32_t object, Kind kind, std::string_view name) {
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
  if (atomic_) fb_property_ = property_id(kms, route.plane, Kind::plane, "FB_ID");
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
  const Setting setting{route_.plane, Kind::plane, fb_property_, fb};
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
Answer<FlipEvent> Flipper::event_of_current() {
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

}  // namespace symrig::projector::drm
