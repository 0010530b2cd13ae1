// SPDX-License-Identifier: Apache-2.0
#include "tensor/entries.hpp"

#include <algorithm>

namespace symrig::tensor {

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
