// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/route.hpp"
#include "symrig/projector/projector.hpp"

namespace symrig::projector::drm {

/// Puts framebuffers on a screen at a refresh, one after the other, and tells at which.
class Flipper {
 public:
  /// patience: how long a refresh may be waited for.
  Flipper(Kms& kms, const Route& route, bool atomic, Nanoseconds patience);

  /// Finds out whether the card counts refreshes, by a few flips to framebuffers that show the same. Without
  /// this, nothing counts as counted. warning: why not.  fails: as submit() and await().
  Result<void> learn(std::span<const std::uint32_t> fbs, std::string& warning);

  /// Asks for fb at the next refresh; no other flip may be on its way.
  /// fails: device_lost, limit, device_refused, timeout (the one before never ended).
  Result<void> submit(std::uint32_t fb);
  /// Waits until it is there.  fails: timeout (no refresh came), device_lost (also if the count of refreshes
  /// went back: somebody else has set the mode).
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
