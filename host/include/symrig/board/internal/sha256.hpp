// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace symrig::board {

/// SHA-256 of these bytes (FIPS 180-4), as 64 hexadecimal digits in lower case.
std::string sha256(std::span<const std::uint8_t> bytes);

/// The same for bytes that come one after another.
class Sha256 {
 public:
  Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;
  ~Sha256();

  void add(std::span<const std::byte> bytes);
  /// Of all bytes so far; then it is at its end.
  std::string text();

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

}  // namespace symrig::board
