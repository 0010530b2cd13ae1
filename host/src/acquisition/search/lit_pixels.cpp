// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/lit_pixels.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <utility>

namespace symrig::acquisition {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

/// One partial sum for each of eight places, so that compilers make vectors of it.
float sum_of(const float* values, std::size_t count) {
  std::array<float, 8> parts{};
  std::size_t t = 0;
  for (; t + parts.size() <= count; t += parts.size())
    for (std::size_t k = 0; k < parts.size(); ++k) parts[k] += values[t + k];
  for (; t < count; ++t) parts[0] += values[t];
  return ((parts[0] + parts[4]) + (parts[2] + parts[6])) + ((parts[1] + parts[5]) + (parts[3] + parts[7]));
}

/// Sets bits [begin, end).
void set(std::int32_t begin, std::int32_t end, std::vector<std::uint64_t>& words) {
  for (std::int32_t t = begin; t < end;) {
    const std::int32_t stop = std::min(end, (t | 63) + 1);
    const int count = stop - t;
    words[static_cast<std::size_t>(t) / 64] |= (kAll >> (64 - count)) << (t & 63);
    t = stop;
  }
}

}  // namespace

LitPixels::LitPixels(LitBlocks blocks, std::size_t pixels)
    : blocks_(std::move(blocks)), words_(pixels / 64 + 1), before_word_(words_.size()) {
  std::ranges::sort(blocks_, {}, &LitRange::begin);
  for (const LitRange& r : blocks_) set(r.begin, r.end, words_);
  std::int32_t lit = 0;
  for (std::size_t w = 0; w < words_.size(); ++w) {
    before_word_[w] = lit;
    lit += std::popcount(words_[w]);
  }
}

std::int32_t LitPixels::before(std::int32_t t) const {
  const std::uint64_t lower = (std::uint64_t{1} << (t & 63)) - 1;
  return before_word_[word(t)] + std::popcount(words_[word(t)] & lower);
}

float LitPixels::sum(std::int32_t begin, std::span<const float> values) const {
  const std::int32_t end = begin + static_cast<std::int32_t>(values.size());
  float sum = 0;
  if (!any(begin, end)) return sum;
  auto r = std::ranges::upper_bound(blocks_, begin, {}, &LitRange::end);
  for (; r != blocks_.end() && r->begin < end; ++r) {
    const std::int32_t from = std::max(begin, r->begin), to = std::min(end, r->end);
    sum += sum_of(values.data() + (from - begin), static_cast<std::size_t>(to - from));
  }
  return sum;
}

}  // namespace symrig::acquisition
