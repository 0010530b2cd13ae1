// SPDX-License-Identifier: Apache-2.0
#include "tensor/entries.hpp"

#include "tensor/panel_kernels.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <tuple>

namespace symrig::tensor {
namespace {

constexpr std::int32_t kSide = 256;
constexpr int kEntryTop = 14;  ///< the largest entry as a half is in [2¹⁴, 2¹⁵)

auto square_of(const ScalarLeaf& at) {
  return std::tuple(at.row / kSide, at.col / kSide);
}

}  // namespace

Diagonal::Diagonal(std::int64_t pixels, int channels)
    : pixels_(static_cast<std::size_t>(pixels)),
      values_(pixels_ * static_cast<std::size_t>(channels)),
      stored_((pixels_ + 7) / 8) {}

void Diagonal::add(std::int32_t pixel, std::span<const float> values) {
  for (std::size_t c = 0; c < values.size(); ++c)
    values_[c * pixels_ + static_cast<std::size_t>(pixel)] += values[c];
  std::uint8_t& byte = stored_[static_cast<std::size_t>(pixel) / 8];
  byte = static_cast<std::uint8_t>(byte | (1U << (static_cast<unsigned>(pixel) % 8U)));
}

std::int64_t Diagonal::size() const {
  return std::accumulate(stored_.begin(), stored_.end(), std::int64_t{0},
                         [](std::int64_t sum, std::uint8_t byte) { return sum + std::popcount(byte); });
}

Entries::Entries(std::span<const ScalarLeaf> at, std::span<const float> values, int channels) {
  std::vector<std::size_t> order(at.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tuple(square_of(at[a]), at[a].row, at[a].col) <
           std::tuple(square_of(at[b]), at[b].row, at[b].col);
  });
  for (std::size_t k = 0; k < order.size(); ++k) {
    const ScalarLeaf& entry = at[order[k]];
    if (k == 0 || square_of(entry) != square_of(at[order[k - 1]]))
      squares_.push_back(
          {entry.row / kSide * kSide, entry.col / kSide * kSide, static_cast<std::uint32_t>(k)});
    local_.push_back(
        {static_cast<std::uint8_t>(entry.row % kSide), static_cast<std::uint8_t>(entry.col % kSide)});
  }
  if (at.empty()) return;
  squares_.push_back({std::numeric_limits<std::int32_t>::max(), 0, static_cast<std::uint32_t>(at.size())});
  squares_.shrink_to_fit();
  const std::size_t count = channels;
  values_.resize(count * at.size() + Panels::kSlack);
  std::vector<float> plane(at.size());
  for (std::size_t c = 0; c < count; ++c) {
    for (std::size_t k = 0; k < order.size(); ++k) plane[k] = values[order[k] * count + c];
    scales_.push_back(power_of_two(to_halves(plane, kEntryTop, &values_[c * at.size()])));
  }
}

ScalarLeaf Entries::at(std::size_t entry) const {
  const auto after = std::upper_bound(squares_.begin(), squares_.end(), entry,
                                      [](std::size_t k, const Square& square) { return k < square.first; });
  return {std::prev(after)->row + local_[entry].row, std::prev(after)->col + local_[entry].col};
}

float Entries::value(std::size_t entry, int channel) const {
  const std::size_t c = channel;
  return scales_[c] * from_half(values_[c * size() + entry]);
}

template <std::size_t Width>
void Entries::apply(int channel, std::int32_t begin, std::int32_t end, const float* p, float* y) const {
  const auto starts_at = [&](std::int32_t row) {
    return std::lower_bound(squares_.begin(), squares_.end(), row,
                            [](const Square& square, std::int32_t r) { return square.row < r; });
  };
  const auto first = starts_at(begin), last = starts_at(end);
  if (first == last) return;
  const std::size_t c = channel;
  std::vector<float> values(last->first - first->first);
  to_floats(&values_[c * size() + first->first], values.size(), values.data());
  auto value = values.begin();
  for (auto square = first; square != last; ++square) {
    for (std::size_t k = square->first; k < std::next(square)->first; ++k, ++value) {
      float* const to = y + static_cast<std::size_t>(square->row - begin + local_[k].row) * Width;
      const float* const from = p + static_cast<std::size_t>(square->col + local_[k].col) * Width;
      const float v = scales_[c] * *value;
      for (std::size_t lane = 0; lane < Width; ++lane) to[lane] += v * from[lane];
    }
  }
}

template void Entries::apply<1>(int, std::int32_t, std::int32_t, const float*, float*) const;
template void Entries::apply<kBatch>(int, std::int32_t, std::int32_t, const float*, float*) const;

std::int64_t Entries::bytes() const {
  const auto of = [](const auto& v) { return static_cast<std::int64_t>(v.size() * sizeof(v[0])); };
  return of(squares_) + of(local_) + of(values_) + of(scales_);
}

EmptyList::EmptyList(std::vector<EmptyLeaf> leaves, std::int64_t columns)
    : size_(std::ssize(leaves)), columns_(columns) {
  const auto place = [&](const EmptyLeaf& leaf) { return leaf.row_block * columns_ + leaf.col_block; };
  std::sort(leaves.begin(), leaves.end(),
            [&](const EmptyLeaf& a, const EmptyLeaf& b) { return place(a) < place(b); });
  std::int64_t before = 0;
  for (const EmptyLeaf& leaf : leaves) {
    auto step = static_cast<std::uint64_t>(place(leaf) - before);
    before = place(leaf);
    for (; step >= 0x80; step >>= 7U) steps_.push_back(static_cast<std::uint8_t>(step | 0x80U));
    steps_.push_back(static_cast<std::uint8_t>(step));
  }
  steps_.shrink_to_fit();
}

std::vector<EmptyLeaf> EmptyList::leaves() const {
  std::vector<EmptyLeaf> leaves;
  leaves.reserve(size_);
  std::uint64_t place = 0, step = 0;
  unsigned shift = 0;
  for (const std::uint8_t byte : steps_) {
    step |= (byte & std::uint64_t{0x7F}) << shift;
    shift += 7;
    if ((byte & 0x80U) != 0) continue;
    place += step;
    const auto at = static_cast<std::int64_t>(place);
    leaves.push_back({static_cast<std::int32_t>(at / columns_), static_cast<std::int32_t>(at % columns_)});
    step = 0;
    shift = 0;
  }
  return leaves;
}

}  // namespace symrig::tensor
