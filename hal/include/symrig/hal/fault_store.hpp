// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

namespace symrig::hal {

/// A latched fault in the form that survives a reset.
struct FaultRecord {
  uint32_t code = 0;  ///< FaultCode of the wire; 0 = none
  Tick tick = 0;
  uint64_t arg = 0;
};

/// Memory that survives a reset (scratch registers, no-init RAM, flash). Power-off may erase it.
class FaultStore {
 public:
  /// code 0 if nothing is stored.
  virtual FaultRecord load() const = 0;
  virtual void save(const FaultRecord& record) = 0;

 protected:
  ~FaultStore() = default;
};

}  // namespace symrig::hal
