// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/kms.hpp"

#include <deque>

namespace symrig::projector::drm {

/// Reads the kernel's flip events from a card's file. One read may return several events.
class FlipEvents {
 public:
  /// As Kms::next_flip().
  Answer<FlipEvent> next(int card, Nanoseconds patience);

 private:
  Errno read_some(int card);

  std::deque<FlipEvent> waiting_;
};

}  // namespace symrig::projector::drm
