// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/shrink.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

namespace symrig::acquisition {
namespace {

/// The blocks of one level inside a block.
std::span<const Block> inside(const BlockTree& tree, int level, const Block& around) {
  const auto blocks = tree.level(level);
  const auto before = [](const Block& b, std::int32_t begin) { return b.begin < begin; };
  const auto first = std::lower_bound(blocks.begin(), blocks.end(), around.begin, before);
  const auto last = std::lower_bound(first, blocks.end(), around.end, before);
  return {first, last};
}

}  // namespace

void shrink_noise(const BlockTree& tree, int level, const Block& block, double variance,
                  std::span<float> image) {
  std::vector<double> before(image.size() + 1);
  for (std::size_t t = 0; t < image.size(); ++t) before[t + 1] = before[t] + static_cast<double>(image[t]);
  const auto mean = [&](const Block& of) {
    return (before[static_cast<std::size_t>(of.end) - static_cast<std::size_t>(block.begin)] -
            before[static_cast<std::size_t>(of.begin) - static_cast<std::size_t>(block.begin)]) /
           of.size();
  };
  std::fill(image.begin(), image.end(), static_cast<float>(mean(block)));
  auto parents = inside(tree, level, block);
  for (int l = level + 1; l < tree.levels(); ++l) {
    const auto children = inside(tree, l, block);
    const auto for_details = [&](const auto& use) {
      auto child = children.begin();
      for (const Block& parent : parents) {
        const double around = mean(parent);
        for (; child != children.end() && child->end <= parent.end; ++child)
          if (parent.children > 1) use(*child, mean(*child) - around);
      }
    };
    double energy = 0;
    for_details([&](const Block& of, double detail) { energy += of.size() * detail * detail; });
    const auto count = static_cast<double>(children.size() - parents.size());
    const double keep = energy > 0 ? std::max(0.0, 1 - std::max(0.0, count - 2) * variance / energy) : 0;
    for_details([&](const Block& of, double detail) {
      for (std::int32_t t = of.begin; t < of.end; ++t)
        image[static_cast<std::size_t>(t) - static_cast<std::size_t>(block.begin)] +=
            static_cast<float>(keep * detail);
    });
    parents = children;
  }
}

bool is_noisy(std::span<const float> image, double variance) {
  const double energy = std::inner_product(image.begin(), image.end(), image.begin(), 0.0, std::plus<>(),
                                           [](float a, float b) { return static_cast<double>(a) * b; });
  return 4 * variance * static_cast<double>(image.size()) > energy;
}

}  // namespace symrig::acquisition
