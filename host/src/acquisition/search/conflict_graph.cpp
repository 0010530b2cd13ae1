// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/conflict_graph.hpp"

#include <algorithm>
#include <numeric>

namespace symrig::acquisition {

ConflictGraph::ConflictGraph(std::int32_t blocks,
                             std::span<const std::pair<std::int32_t, std::int32_t>> unknown)
    : first_(static_cast<std::size_t>(blocks) + 1) {
  for (const auto& [a, b] : unknown) {
    ++first_[static_cast<std::size_t>(a) + 1];
    if (a != b) ++first_[static_cast<std::size_t>(b) + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  partners_.resize(first_.back());
  std::vector<std::int32_t> next(first_.begin(), first_.end() - 1);
  const auto put = [&](std::int32_t at, std::int32_t partner) { partners_[next[at]++] = partner; };
  for (const auto& [a, b] : unknown) {
    put(a, b);
    if (a != b) put(b, a);
  }
  for (std::int32_t b = 0; b < blocks; ++b)
    std::sort(partners_.begin() + first_[b], partners_.begin() + first_[static_cast<std::size_t>(b) + 1]);
}

std::span<const std::int32_t> ConflictGraph::partners(std::int32_t block) const {
  const std::size_t begin = first_[block];
  const std::size_t end = first_[static_cast<std::size_t>(block) + 1];
  return std::span(partners_).subspan(begin, end - begin);
}

bool ConflictGraph::conflict(std::int32_t a, std::int32_t b) const {
  const auto of_a = partners(a);
  const auto of_b = partners(b);
  return std::find_first_of(of_a.begin(), of_a.end(), of_b.begin(), of_b.end()) != of_a.end();
}

std::vector<std::vector<std::int32_t>> ConflictGraph::colour() const {
  const std::size_t n = blocks();
  // Walks within two steps bound the degree in G² and order the blocks as well as the degree itself, for far
  // less work.
  std::vector<std::int64_t> walks(n);
  std::vector<std::int32_t> order;
  for (std::size_t b = 0; b < n; ++b) {
    for (const std::int32_t k : partners(static_cast<std::int32_t>(b))) walks[b] += std::ssize(partners(k));
    if (walks[b] > 0) order.push_back(static_cast<std::int32_t>(b));
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::int32_t a, std::int32_t b) { return walks[a] > walks[b]; });
  std::vector<std::int32_t> colour_of(n, -1);
  std::vector<std::int32_t> taken_by;  // taken_by[c] == block: colour c is taken by a neighbour of `block`
  std::vector<std::vector<std::int32_t>> classes;
  for (const std::int32_t block : order) {
    for (const std::int32_t k : partners(block))
      for (const std::int32_t other : partners(k))
        if (const std::int32_t c = colour_of[other]; c >= 0) taken_by[c] = block;
    const auto free =
        std::find_if(taken_by.begin(), taken_by.end(), [block](std::int32_t by) { return by != block; });
    const std::size_t c = free - taken_by.begin();
    if (c == classes.size()) {
      classes.emplace_back();
      taken_by.push_back(-1);
    }
    colour_of[block] = static_cast<std::int32_t>(c);
    classes[c].push_back(block);
  }
  return classes;
}

}  // namespace symrig::acquisition
