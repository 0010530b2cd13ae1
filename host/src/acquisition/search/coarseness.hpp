// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace symrig::acquisition {

/// How much coarser than options.rule a budget makes a level. It has steps, so that a log can hold it
/// exactly.
struct Coarseness {
  int steps = 0;  ///< of half as much again

  /// Of the misfit that a leaf may have.
  double factor() const { return std::pow(1.5, steps); }
};

}  // namespace symrig::acquisition
