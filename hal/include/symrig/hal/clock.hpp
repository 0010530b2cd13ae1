// SPDX-License-Identifier: Apache-2.0
#pragma once

// The C headers, because tool chains of small boards have no <cstdint>.
#include <stddef.h>  // NOLINT(modernize-deprecated-headers)
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::hal {

/// A point on the board's clock, in ticks since power-up. 64 bits: it never wraps.
using Tick = uint64_t;

/// "Not planned."
constexpr Tick kNever = UINT64_MAX;

/// The board's clock. It drives the edge engine and stamps edges.
class Clock {
 public:
  virtual Tick now() const = 0;

 protected:
  ~Clock() = default;
};

}  // namespace symrig::hal
