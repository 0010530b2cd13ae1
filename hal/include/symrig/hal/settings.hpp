// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

namespace symrig::hal {

/// A few hundred bytes that survive losing power (flash). What was saved last is what load() gives, or the
/// save before it if power went away half-way; never a mixture.
class Settings {
 public:
  /// Bytes of one record, at most.
  static constexpr size_t kRoom = 1024;

  /// Copies the record to `out` if it fits. Returns its size; 0 if nothing (sound) is stored.
  virtual size_t load(uint8_t* out, size_t room) const = 0;
  /// Takes up to half a second in which nothing else runs: only with outputs safe. false: could not be
  /// written.
  virtual bool save(const uint8_t* bytes, size_t size) = 0;

 protected:
  ~Settings() = default;
};

}  // namespace symrig::hal
