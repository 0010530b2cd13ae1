// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace symrig::tensor::h5 {

/// Takes numbers from bytes that nobody has checked. After a step past their end, all is 0 and ok() is false.
class Bytes {
 public:
  explicit Bytes(std::span<const std::uint8_t> bytes) : left_(bytes) {}

  std::span<const std::uint8_t> take(std::uint64_t size) {
    if (size > left_.size()) {
      ok_ = false;
      left_ = {};
      return {};
    }
    const auto taken = left_.first(static_cast<std::size_t>(size));
    left_ = left_.subspan(taken.size());
    return taken;
  }
  void skip(std::uint64_t size) { take(size); }
  /// A little-endian number of 0 to 8 bytes.
  std::uint64_t number(std::uint64_t size) {
    const auto from = take(size);
    if (from.size() > 8) ok_ = false;
    std::uint64_t value = 0;
    for (std::size_t k = std::min<std::size_t>(from.size(), 8); k-- > 0;) value = value << 8U | from[k];
    return value;
  }
  unsigned byte() { return static_cast<unsigned>(number(1)); }
  /// Takes the signature of a structure. false: there is another one.
  bool signature(std::string_view letters) {
    const auto found = take(letters.size());
    return std::equal(found.begin(), found.end(), letters.begin(), letters.end(),
                      [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); });
  }
  std::span<const std::uint8_t> left() const { return left_; }
  bool ok() const { return ok_; }

 private:
  std::span<const std::uint8_t> left_;
  bool ok_ = true;
};

}  // namespace symrig::tensor::h5
