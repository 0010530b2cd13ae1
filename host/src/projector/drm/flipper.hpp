// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/route.hpp"
#include "symrig/projector/projector.hpp"

namespace symrig::projector::drm {

/// Shows framebuffers one after the other, each at a refresh, and reports that refresh.
class Flipper {
 public:
  /// patience: longest wait for a refresh.
  Flipper(Kms& kms, const Route& route, bool atomic, Nanoseconds patience);

  /// Finds out if the card counts refreshes, with a few flips between framebuffers of equal content. Until
  /// this is called, counted() is false. warning: why the card does not count.
  /// fails: as submit() and await().
  Result<void> learn(std::span<const std::uint32_t> fbs, std::string& warning);

  /// Requests fb for the next refresh. No other flip may be pending.
  /// fails: device_lost, limit, device_refused, timeout (the previous flip never ended).
  Result<void> submit(std::uint32_t fb);
  /// Waits until the screen shows it.
  /// fails: timeout (no refresh), device_lost (also if the refresh count went back: another program has set
  /// the mode).
  Result<Shown> await();

  bool counted() const { return counted_; }

 private:
  Errno send(std::uint32_t fb);
  Answer<FlipEvent> event_of_current();
  Result<std::uint64_t> extend(std::uint32_t sequence);

  Kms& kms_;
  const Route& route_;
  bool atomic_;
  Nanoseconds patience_;
  std::uint32_t fb_property_ = 0;
  bool counted_ = false;
  bool began_ = false;
  std::uint64_t token_ = 0;
  std::uint64_t refresh_ = 0;
};

}  // namespace symrig::projector::drm
