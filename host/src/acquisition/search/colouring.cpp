// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/colouring.hpp"

#include <algorithm>

namespace symrig::acquisition {

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
