// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/peripherals.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace symrig::test {

/// Settings in memory that a test may damage.
class SettingsInMemory final : public hal::Settings {
 public:
  std::vector<std::uint8_t> bytes;

  std::size_t load(std::uint8_t* out, std::size_t room) const override {
    if (bytes.size() > room) return 0;
    std::copy(bytes.begin(), bytes.end(), out);
    return bytes.size();
  }
  bool save(const std::uint8_t* data, std::size_t size) override {
    bytes.assign(data, data + size);
    return true;
  }
};

}  // namespace symrig::test
