// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/coarseness.hpp"
#include "symrig/acquisition/capture.hpp"

#include <optional>

namespace symrig::acquisition {

/// The tolerance with which a capture is expected to reach its target error (docs/research/budgets.md).
/// Coarser leaves cost fewer patterns and shorter exposures. What they miss of a scene is not known before,
/// so a search that ends above its target is followed by a finer one.
class TargetTolerance {
 public:
  explicit TargetTolerance(const CaptureSettings& options);

  /// By how much the next search is coarser than the user's tolerance.
  Coarseness coarseness() const { return now_; }

  /// Whether a search that ended like this has reached the target: its estimated error and the uncertainty.
  bool reached(const CaptureResult& ended) const;
  /// Whether a finer search follows; then coarseness() is its own. None follows if the target is reached, if
  /// a budget has ended the search, or if it was as fine as the user's tolerance.
  bool search_again(const CaptureResult& ended);

 private:
  double target_;
  Coarseness now_ = {};
};

}  // namespace symrig::acquisition
