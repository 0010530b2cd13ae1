// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/kms.hpp"

#include <deque>

namespace symrig::projector::drm {

/// Reads what the kernel says of flips from a card's file. Several may come at once.
class FlipEvents {
 public:
  /// As Kms::next_flip.
  Answer<FlipEvent> next(int card, Nanoseconds patience);

 private:
  Errno read_some(int card);

  std::deque<FlipEvent> waiting_;
};

}  // namespace symrig::projector::drm
