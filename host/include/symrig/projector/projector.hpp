// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/image/image.hpp"

#include <span>
#include <string>

namespace symrig {

/// A projector that holds a sequence of patterns and goes on to the next one at the first refresh after its
/// trigger line rises. The board times the steps. Not thread-safe.
class Projector {
 public:
  Projector() = default;
  Projector(const Projector&) = delete;
  Projector& operator=(const Projector&) = delete;
  virtual ~Projector() = default;

  virtual Grid grid() const = 0;
  virtual Nanoseconds refresh_period() const = 0;
  /// Takes a sequence; the first pattern appears after the first trigger. fails: size_mismatch, device_lost.
  virtual Result<void> load(std::span<const Pattern> patterns) = 0;
  /// One line for reports.
  virtual std::string describe() const = 0;
};

}  // namespace symrig
