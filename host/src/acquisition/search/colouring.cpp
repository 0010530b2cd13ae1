// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/colouring.hpp"

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

Colouring::Colouring(const ConflictGraph& graph) {
  const std::size_t blocks = graph.blocks();
  partners_.resize(blocks);
  for (std::size_t b = 0; b < blocks; ++b) {
    const auto of = graph.partners(static_cast<std::int32_t>(b));
    partners_[b].assign(of.begin(), of.end());
  }
  colour_.assign(blocks, -1);
  place_.resize(blocks);
  const auto classes = graph.colour();
  lit_.assign(classes.size(), std::vector<char>(blocks));
  classes_.resize(classes.size());
  for (std::size_t c = 0; c < classes.size(); ++c)
    for (const std::int32_t b : classes[c]) light(b, c);
}

void Colouring::light(std::int32_t block, std::size_t colour) {
  lit_[colour][block] = 1;
  place_[block] = static_cast<std::int32_t>(classes_[colour].size());
  classes_[colour].push_back(block);
  colour_[block] = static_cast<std::int32_t>(colour);
}

void Colouring::unlight(std::int32_t block) {
  std::int32_t& colour = colour_[block];
  if (colour < 0) return;
  lit_[colour][block] = 0;
  std::vector<std::int32_t>& of_colour = classes_[colour];
  const std::int32_t place = place_[block];
  place_[of_colour.back()] = place;
  of_colour[place] = of_colour.back();
  of_colour.pop_back();
  colour = -1;
}

bool Colouring::free(std::int32_t block, std::size_t colour) const {
  for (const std::int32_t k : partners_[block])
    for (const std::int32_t other : partners_[k])
      if (other != block && lit_[colour][other] != 0) return false;
  return true;
}

std::optional<std::size_t> Colouring::free_colour(std::int32_t block) const {
  for (std::size_t c = 0; c < lit_.size(); ++c)
    if (free(block, c)) return c;
  return std::nullopt;
}

/// Finds a colour for `block`, keeping the one it has if it still fits.
bool Colouring::settle(std::int32_t block) {
  const std::int32_t now = colour_[block];
  if (now >= 0 && free(block, static_cast<std::size_t>(now))) return true;
  unlight(block);
  if (const auto colour = free_colour(block)) {
    light(block, *colour);
    return true;
  }
  return false;
}

bool Colouring::add(std::int32_t a, std::int32_t b) {
  std::vector<std::int32_t>& of_a = partners_[a];
  std::vector<std::int32_t>& of_b = partners_[b];
  const std::int32_t colour_a = colour_[a];
  const std::int32_t colour_b = colour_[b];
  const std::size_t size_a = of_a.size();
  const std::size_t size_b = of_b.size();
  if (size_a == 0 && a != b) of_a.push_back(a);
  if (size_b == 0 && a != b) of_b.push_back(b);
  of_a.push_back(b);
  if (a != b) of_b.push_back(a);
  if (settle(a) && settle(b)) return true;
  unlight(a);
  unlight(b);
  of_a.resize(size_a);
  of_b.resize(size_b);
  if (colour_a >= 0) light(a, static_cast<std::size_t>(colour_a));
  if (colour_b >= 0 && a != b) light(b, static_cast<std::size_t>(colour_b));
  return false;
}

}  // namespace symrig::acquisition
