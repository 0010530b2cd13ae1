// SPDX-License-Identifier: Apache-2.0
#include "tensor/low_rank.hpp"

#include <algorithm>

namespace symrig::tensor {
namespace {

constexpr int kColumnTop = 7;  ///< the largest value of a column as a half is in [2⁷, 2⁸)

/// 1 if b = a bit by bit, −1 if b = −a, otherwise 0.
int sign_between(std::span<const Half> a, std::span<const Half> b) {
  if (std::equal(a.begin(), a.end(), b.begin(), b.end())) return 1;
  const auto negative = [](Half x, Half y) { return (x ^ 0x8000) == y; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), negative) ? -1 : 0;
}

}  // namespace

/// One rank of one leaf: the ranges of its two columns and the places of their floats in the pool of channel
/// 0.
struct LowRank::Pair {
  Column row, col;
  std::size_t a, b, channel_stride;

  bool on_diagonal() const { return row.begin == col.begin && row.end == col.end; }
  std::size_t rows() const { return static_cast<std::size_t>(row.end - row.begin); }
  std::size_t cols() const { return static_cast<std::size_t>(col.end - col.begin); }
  template <class T>
  std::span<T> a_of(T* pool, int channel) const {
    return {pool + a + static_cast<std::size_t>(channel) * channel_stride, rows()};
  }
  template <class T>
  std::span<T> b_of(T* pool, int channel) const {
    return {pool + b + static_cast<std::size_t>(channel) * channel_stride, cols()};
  }
};

std::vector<LowRank::Pair> LowRank::pairs_of(std::span<const Leaf> leaves, int channels) {
  std::vector<Pair> pairs;
  std::size_t at = 0;
  for (const Leaf& leaf : leaves) {
    const auto rows = static_cast<std::size_t>(leaf.rows()), cols = static_cast<std::size_t>(leaf.cols());
    const std::size_t rank = leaf.rank;
    for (std::size_t k = 0; k < rank; ++k)
      pairs.push_back({{leaf.row_begin, leaf.row_end},
                       {leaf.col_begin, leaf.col_end},
                       at + k * rows,
                       at + rank * rows + k * cols,
                       rank * (rows + cols)});
    at += static_cast<std::size_t>(channels) * rank * (rows + cols);
  }
  return pairs;
}

LowRank::LowRank(std::span<const Leaf> leaves, std::span<const float> factors, const Shape& shape)
    : symmetric_(shape.symmetric), channels_(shape.channels) {
  const std::vector<Pair> pairs = pairs_of(leaves, channels_);
  pairs_ = pairs.size();
  std::vector<Half> halves(factors.size());
  round_factors(pairs, factors, halves);
  keep(pairs, halves, shape);
}

void LowRank::assign(std::span<const Leaf> leaves, PartValues& values, const Shape& shape) {
  symmetric_ = shape.symmetric;
  channels_ = shape.channels;
  const std::vector<Pair> pairs = pairs_of(leaves, channels_);
  pairs_ = pairs.size();
  diagonal_.clear();
  scale_factors(leaves, values);
  keep(pairs, values.halves, shape);
}

/// Lays out the rounded factors.
void LowRank::keep(std::span<const Pair> pairs, const std::vector<Half>& halves, const Shape& shape) {
  if (symmetric_) find_diagonal(pairs, halves);
  lay_out(pairs, shape);
  for (int channel = 0; channel < channels_; ++channel)
    for (std::size_t side = 0; side < (symmetric_ ? 1 : 2); ++side)
      sides_[side].fill(
          [&](std::size_t column, std::int32_t pixel) {
            const Pair& pair = pairs[symmetric_ ? column / 2 : column];
            const bool is_b = symmetric_ ? column % 2 == 1 : side == 1;
            const auto values = is_b ? pair.b_of(halves.data(), channel) : pair.a_of(halves.data(), channel);
            return values.data() + (pixel - (is_b ? pair.col.begin : pair.row.begin));
          },
          streams_[static_cast<std::size_t>(channel) * (symmetric_ ? 1 : 2) + side].data());
}

/// Brings the largest half of each column to its place, and makes weights of the exponents.
void LowRank::scale_factors(std::span<const Leaf> leaves, PartValues& values) {
  weights_.resize(static_cast<std::size_t>(channels_) * pairs_);
  std::size_t pair = 0;
  Half* at = values.halves.data();
  const std::int32_t* exponent = values.exponents.data();
  for (const Leaf& leaf : leaves) {
    const std::size_t rank = leaf.rank;
    for (int channel = 0; channel < channels_; ++channel) {
      std::vector<int> sum(rank);
      for (const std::int32_t side : {leaf.rows(), leaf.cols()})
        for (std::size_t k = 0; k < rank; ++k, at += side, ++exponent)
          sum[k] += *exponent + to_top({at, static_cast<std::size_t>(side)}, kColumnTop);
      for (std::size_t k = 0; k < rank; ++k) weights(channel)[pair + k] = power_of_two(sum[k]);
    }
    pair += rank;
  }
}

void LowRank::round_factors(std::span<const Pair> pairs, std::span<const float> factors,
                            std::vector<Half>& halves) {
  weights_.resize(static_cast<std::size_t>(channels_) * pairs_);
  for (int channel = 0; channel < channels_; ++channel) {
    for (std::size_t q = 0; q < pairs_; ++q) {
      const int of_a = to_halves(pairs[q].a_of(factors.data(), channel), kColumnTop,
                                 pairs[q].a_of(halves.data(), channel).data());
      const int of_b = to_halves(pairs[q].b_of(factors.data(), channel), kColumnTop,
                                 pairs[q].b_of(halves.data(), channel).data());
      weights(channel)[q] = power_of_two(of_a + of_b);
    }
  }
}

void LowRank::find_diagonal(std::span<const Pair> pairs, const std::vector<Half>& halves) {
  for (std::size_t q = 0; q < pairs_; ++q) {
    if (!pairs[q].on_diagonal()) continue;
    std::vector<int> signs(channels_);
    for (int channel = 0; channel < channels_; ++channel)
      signs[channel] =

          sign_between(pairs[q].a_of(halves.data(), channel), pairs[q].b_of(halves.data(), channel));
    const bool shared = std::find(signs.begin(), signs.end(), 0) == signs.end();
    diagonal_.push_back({static_cast<std::uint32_t>(q), shared});
    for (int channel = 0; shared && channel < channels_; ++channel)
      weights(channel)[q] *= static_cast<float>(signs[channel]);
  }
  diagonal_.shrink_to_fit();
}

void LowRank::lay_out(std::span<const Pair> pairs, const Shape& shape) {
  std::vector<Column> camera, projector;
  camera.reserve(2 * pairs.size());
  projector.reserve(pairs.size());
  std::vector<Column>& other = symmetric_ ? camera : projector;
  for (const Pair& pair : pairs) {
    camera.push_back(pair.row);
    other.push_back(pair.col);
  }
  for (const auto& [q, shared] : diagonal_)
    if (shared) camera[2 * q + 1] = {};
  sides_[0] = Panels(shape.camera, camera);
  if (!symmetric_) sides_[1] = Panels(shape.projector, projector);
  const std::size_t sides = symmetric_ ? 1 : 2;
  streams_.resize(static_cast<std::size_t>(channels_) * sides);
  for (std::size_t k = 0; k < streams_.size(); ++k)
    streams_[k].resize(sides_[k % sides].values() + Panels::kSlack);
}

/// visit(half, at): every stored half of a channel and its place in the pool.
template <class Visit>
void LowRank::for_values(std::span<const Pair> pairs, int channel, const Visit& visit) const {
  for (std::size_t side = 0; side < (symmetric_ ? 1 : 2); ++side) {
    // Only the constructor fills the streams through this function.
    Half* const values = const_cast<Half*>(stream(channel, side));
    sides_[side].for_values([&](std::size_t column, std::size_t pixel, std::size_t at) {
      const Pair& pair = pairs[symmetric_ ? column / 2 : column];
      const bool is_b = symmetric_ ? column % 2 == 1 : side == 1;
      const std::size_t first =
          (is_b ? pair.b : pair.a) + static_cast<std::size_t>(channel) * pair.channel_stride;
      visit(values[at], first + pixel - static_cast<std::size_t>(is_b ? pair.col.begin : pair.row.begin));
    });
  }
}

std::vector<float> LowRank::factors(std::span<const Leaf> leaves) const {
  const std::vector<Pair> pairs = pairs_of(leaves, channels_);
  std::size_t total = 0;
  for (const Pair& pair : pairs) total += static_cast<std::size_t>(channels_) * (pair.rows() + pair.cols());
  std::vector<float> pool(total);
  for (int channel = 0; channel < channels_; ++channel) {
    for_values(pairs, channel, [&](const Half& stored, std::size_t at) { pool[at] = from_half(stored); });
    for (const auto& [q, shared] : diagonal_)
      if (shared)
        std::ranges::copy(pairs[q].a_of(pool.data(), channel), pairs[q].b_of(pool.data(), channel).begin());
    for (std::size_t q = 0; q < pairs_; ++q)
      for (float& b : pairs[q].b_of(pool.data(), channel)) b *= weights(channel)[q];
  }
  return pool;
}

std::int64_t LowRank::bytes() const {
  std::size_t total = weights_.size() * sizeof(float) + diagonal_.size() * sizeof(Diagonal);
  for (const Stream& stream : streams_) total += stream.size() * sizeof(Half);
  return static_cast<std::int64_t>(total) + sides_[0].bytes() + sides_[1].bytes();
}

}  // namespace symrig::tensor
