// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Lit ranges of tree pixels: what a pattern of blocks is before it is a picture.
struct LitRange {
  std::int32_t begin, end;
};
using LitBlocks = std::vector<LitRange>;

/// Which pixels a pattern of blocks lights, in tree order: a bit and a half for each pixel.
class LitPixels {
 public:
  /// blocks: apart from each other, in any order.
  LitPixels(LitBlocks blocks, std::size_t pixels);

  bool operator[](std::int32_t t) const { return (words_[word(t)] >> (t & 63) & 1) != 0; }
  /// True if a pixel of [begin, end) is lit.
  bool any(std::int32_t begin, std::int32_t end) const { return before(begin) != before(end); }
  /// Σ values[t − begin] over the lit t of [begin, begin + size).  error: n ε Σ|values| for n lit pixels.
  float sum(std::int32_t begin, std::span<const float> values) const;

 private:
  static std::size_t word(std::int32_t t) { return static_cast<std::size_t>(t) / 64; }
  /// The number of lit pixels before this one.
  std::int32_t before(std::int32_t t) const;

  LitBlocks blocks_;  // by begin
  std::vector<std::uint64_t> words_;
  std::vector<std::int32_t> before_word_;
};

}  // namespace symrig::acquisition
