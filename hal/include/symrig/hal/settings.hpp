// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

namespace symrig::hal {

/// A few hundred bytes that survive power-off (flash). load() returns the last saved record. If power failed
/// during a save, it returns the record before it, never a mixture.
class Settings {
 public:
  /// The largest record in bytes.
  static constexpr size_t kRoom = 1024;

  /// Copies the record to `out` if it fits. Returns its size; 0 if no valid record is stored.
  virtual size_t load(uint8_t* out, size_t room) const = 0;
  /// Takes up to half a second, in which nothing else runs. So call it only with safe outputs. false: the
  /// write failed.
  virtual bool save(const uint8_t* bytes, size_t size) = 0;

 protected:
  ~Settings() = default;
};

}  // namespace symrig::hal
