// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

namespace symrig::hal {

/// The board's clock. It drives the edge engine and stamps edges.
class Clock {
 public:
  virtual Tick now() const = 0;

 protected:
  ~Clock() = default;
};

}  // namespace symrig::hal
