// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <utility>

namespace symrig::projector::dlp {

/// Does several steps one after the other and keeps the first error.
class Steps {
 public:
  /// A step that fails is done again: one lost answer must not leave a controller half-way.
  static constexpr int kTries = 3;

  template <class Step>
  void take(Step step) {
    Result<void> done = step();
    for (int tries = 1; !done && done.error().code != ErrorCode::device_lost && tries < kTries; ++tries)
      done = step();
    if (first_ && !done) first_ = std::move(done);
  }
  Result<void> result() && { return std::move(first_); }

 private:
  Result<void> first_;
};

}  // namespace symrig::projector::dlp
