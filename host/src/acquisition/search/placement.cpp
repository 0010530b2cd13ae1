// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/placement.hpp"

#include "acquisition/tree/rank_test.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
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

namespace {

/// Of a sample, for Work: it is copied to each of four children, and its square is added up.
constexpr std::int64_t kPlaceOperations = 16;

/// One entry of T, measured from both sides: their mean weighted by inverse variance; a side without a valid
/// sample does not count.
void add_pixel(const SearchFacts& facts, KnownTransport& known, std::int32_t row, std::int32_t col,
               const NodeEstimate& estimate) {
  std::vector<float> value(estimate.c_noise.size());
  const auto r = row == col ? estimate.c : estimate.r;
  double noise = 0;
  for (std::size_t channel = 0; channel < value.size(); ++channel) {
    const PairNoise& c_noise = estimate.c_noise[channel];
    const PairNoise& r_noise = estimate.r_noise[channel];
    const float both = c_noise.variance + r_noise.variance;
    float weight = both > 0 ? r_noise.variance / both : 0.5F;
    if (c_noise.valid == 0 && r_noise.valid != 0) weight = 0;
    if (c_noise.valid != 0 && r_noise.valid == 0) weight = 1;
    value[channel] = weight * estimate.c[channel] + (1 - weight) * r[channel];
    const double variance =
        weight * weight * c_noise.variance + (1 - weight) * (1 - weight) * r_noise.variance;
    if (facts.flood_squared[channel] > 0) noise += variance / facts.flood_squared[channel];
  }
  known.add_scalar(row, col, value, static_cast<float>(noise));
}

Energy energy_of(const SearchFacts& facts, const NodeEstimate& estimate, std::size_t rows, std::size_t cols) {
  Energy energy;
  for (std::size_t channel = 0; channel < estimate.c_noise.size(); ++channel) {
    if (facts.flood_squared[channel] <= 0) continue;
    const auto add = [&](std::span<const float> image, std::size_t size, const PairNoise& noise) {
      double signal = 0;
      for (const float v : image.subspan(channel * size, size))
        signal += static_cast<double>(v) * static_cast<double>(v);
      energy.signal += signal / facts.flood_squared[channel];
      energy.noise += static_cast<double>(noise.variance) / facts.flood_squared[channel];
      energy.samples += noise.valid;
    };
    add(estimate.c, rows, estimate.c_noise[channel]);
    if (!estimate.r.empty()) add(estimate.r, cols, estimate.r_noise[channel]);
  }
  return energy;
}

/// The images of one child pair, in memory that serves for all.
struct ChildImages {
  std::vector<float> c, r;
  std::vector<PairNoise> c_noise, r_noise;

  void clear() {
    c.clear();
    r.clear();
    c_noise.clear();
    r_noise.clear();
  }
};

/// Child pair (a, b): c = the photograph of lit child b seen on child a, r = that of lit child a seen on
/// child b.
void add_child(const SearchFacts& facts, KnownTransport& known, const NodeLevel& parent, const Node& node,
               int a, int b, double undecayed, NodeLevel& next, ChildImages& images) {
  const Block& i = parent.block(node.row);
  const Block& j = parent.block(node.col);
  const Block& child_i = parent.child(i, a);
  const Block& child_j = parent.child(j, b);
  const bool diagonal = node.diagonal() && a == b;
  images.clear();
  auto& [c, r, c_noise, r_noise] = images;
  for (int channel = 0; channel < facts.channels; ++channel) {
    const auto on_i =
        parent.y(node, b, channel).subspan(child_i.begin - i.begin, static_cast<std::size_t>(child_i.size()));
    const auto on_j =
        parent.z(node, a, channel).subspan(child_j.begin - j.begin, static_cast<std::size_t>(child_j.size()));
    c.insert(c.end(), on_i.begin(), on_i.end());
    if (!diagonal) r.insert(r.end(), on_j.begin(), on_j.end());
    c_noise.push_back(parent.y_noise(node, b, a, channel));
    r_noise.push_back(parent.z_noise(node, a, b, channel));
  }
  place(facts, known, next, i.first_child + a, j.first_child + b,
        {c, r, c_noise, r_noise, undecayed, node.distrusted});
}

}  // namespace

std::int32_t add_leaf(const SearchFacts& facts, KnownTransport& known, const NodeLevel& level,
                      const Node& node) {
  const Block& i = level.block(node.row);
  const Block& j = level.block(node.col);
  std::vector<float> factors(static_cast<std::size_t>(facts.channels) *
                             static_cast<std::size_t>(i.size() + j.size()));
  auto rest = std::span(factors);
  for (int channel = 0; channel < facts.channels; ++channel) {
    const EstimateSums& sums = level.sums(node, channel);
    const auto scale = sums.s > 0 ? static_cast<float>(1 / std::sqrt(sums.s)) : 0.0F;
    const auto take = [&](std::span<const float> image, const Block& block, float noise) {
      const auto to = rest.first(image.size());
      rest = rest.subspan(image.size());
      std::copy(image.begin(), image.end(), to.begin());
      const double variance = static_cast<double>(noise) / block.size();
      if (facts.options.economy.shrink_noise && variance > 0 && is_noisy(to, variance))
        shrink_noise(facts.tree, level.level(), block, variance, to);
      for (float& v : to) v *= scale;
    };
    take(level.c(node, channel), i, sums.c_noise);
    take(level.r(node, channel), j, sums.r_noise);
  }
  const std::int32_t leaf = known.add_leaf(i.begin, i.end, j.begin, j.end, level.level(), factors);
  double row_noise = 0;
  double col_noise = 0;
  for (int channel = 0; channel < facts.channels; ++channel) {
    const double f = facts.flood_squared[channel];
    if (f <= 0) continue;
    row_noise += static_cast<double>(level.sums(node, channel).c_noise) / i.size() / f;
    col_noise += static_cast<double>(level.sums(node, channel).r_noise) / j.size() / f;
  }
  known.set_noise(leaf, static_cast<float>(row_noise), static_cast<float>(col_noise));
  return leaf;
}

void add_direct(const SearchFacts& facts, KnownTransport& known, const NodeLevel& level, const Node& node) {
  std::vector<float> value(facts.channels);
  const Block& block = level.block(node.row);
  for (std::int32_t t = block.begin; t < block.end; ++t) {
    for (int channel = 0; channel < facts.channels; ++channel)
      value[channel] = level.c(node, channel)[t - block.begin];
    known.add_scalar(t, t, value);
  }
}

void place(const SearchFacts& facts, KnownTransport& known, NodeLevel& into, std::int32_t row,
           std::int32_t col, const NodeEstimate& estimate) {
  const Block& i = into.block(row);
  const Block& j = into.block(col);
  const Energy energy =
      energy_of(facts, estimate, static_cast<std::size_t>(i.size()), static_cast<std::size_t>(j.size()));
  if (is_empty(energy, facts.rule())) {
    known.add_empty(into.level(), row, col);
  } else if (i.single_pixel() && j.single_pixel()) {
    add_pixel(facts, known, i.begin, j.begin, estimate);
  } else {
    into.add(row, col, estimate.c, estimate.r, estimate.c_noise, estimate.r_noise, estimate.undecayed);
    if (estimate.distrusted) into.distrust_last();
  }
}

void settle(const SearchFacts& facts, KnownTransport& known, const NodeLevel& level,
            std::span<const Tested> tested, NodeLevel& next) {
  ChildImages images;
  Tally tally(facts.options.work);
  for (const Tested& t : tested) {
    const Node& node = level.nodes()[t.node];
    tally.add(kPlaceOperations * facts.channels *
              (level.block(node.row).size() + level.block(node.col).size()));
    if (t.leaf) {
      add_leaf(facts, known, level, node);
      continue;
    }
    for (int a = 0; a < level.block(node.row).children; ++a)
      for (int b = 0; b < (node.diagonal() ? a + 1 : level.block(node.col).children); ++b) {
        const int pair = 4 * a + b;
        add_child(facts, known, level, node, a, b, t.undecayed[pair], next, images);
      }
  }
}

void reopen(const SearchFacts& facts, KnownTransport& known, std::int32_t leaf, NodeLevel& level) {
  const KnownLeaf& of = known.leaves()[leaf];
  std::vector<float> c, r;
  for (int channel = 0; channel < facts.channels; ++channel) {
    const auto [a, b] = known.sides(of, channel);
    const double light_b = std::accumulate(b.begin(), b.end(), 0.0);
    const double light_a = std::accumulate(a.begin(), a.end(), 0.0);
    for (const float v : a) c.push_back(static_cast<float>(light_b * static_cast<double>(v)));
    if (!of.diagonal())
      for (const float v : b) r.push_back(static_cast<float>(light_a * static_cast<double>(v)));
  }
  const std::size_t channels = facts.channels;
  const std::vector<PairNoise> c_noise(channels, {0, of.rows()});
  const std::vector<PairNoise> r_noise(channels, {0, of.cols()});
  const std::int32_t row = facts.tree.block_at(of.level, of.row_begin);
  const std::int32_t col = facts.tree.block_at(of.level, of.col_begin);
  known.remove_leaf(leaf);
  level.add(row, col, c, r, c_noise, r_noise, std::numeric_limits<double>::infinity());
  level.split_last();
}

}  // namespace symrig::acquisition
