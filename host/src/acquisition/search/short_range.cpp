// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/short_range.hpp"

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/forecasts.hpp"
#include "acquisition/search/level_search.hpp"
#include "acquisition/search/placement.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::acquisition {
namespace {

constexpr int kLargestRadius = 3;           // 49 combs: more than what is left of any hierarchy costs
constexpr double kCheckSigmas = 5;          // thousands of blocks are looked at: one false alarm in 10^6
constexpr std::int32_t kFewestPixels = 16;  // pixels of a block that is looked at on its own

constexpr std::int64_t kEntryOperations = 8;  // of an entry of the band, for Work

int distance(int at, int begin, int size) {
  return at < begin ? begin - at : at >= begin + size ? at - begin - size + 1 : 0;
}

/// Every block of every level that is large enough: use(begin, end).
template <class Use>
void for_blocks(const BlockTree& tree, const Use& use) {
  for (int l = 0; l < tree.levels(); ++l)
    for (const Block& block : tree.level(l))
      if (block.size() >= kFewestPixels || l == 0) use(block.begin, block.end);
}

/// The part of an image that lies more than `radius` pixels from a block.
class Beyond {
 public:
  explicit Beyond(const SearchFacts& facts) : facts_(facts) {}

  Energy of(std::span<const float> image, const Block& seen, const Block& lit, int radius,
            std::size_t channel, const PairNoise& noise) const {
    Energy energy;
    const Grid grid = facts_.tree.grid();
    for (std::int32_t t = seen.begin; t < seen.end; ++t) {
      const std::int32_t raster = facts_.tree.order()[t];
      const int far = std::max(distance(raster / grid.cols, lit.row, lit.rows),
                               distance(raster % grid.cols, lit.col, lit.cols));
      if (far <= radius) continue;
      const double v = image[t - seen.begin];
      energy.signal += v * v / facts_.flood_squared[channel];
      ++energy.samples;
    }
    if (noise.valid > 0)
      energy.noise =
          static_cast<double>(noise.variance) / noise.valid * energy.samples / facts_.flood_squared[channel];
    return energy;
  }

 private:
  const SearchFacts& facts_;
};

/// True if a node has no light beyond the radius that a test would see.
bool within(const SearchFacts& facts, const NodeLevel& level, const Node& node, int radius) {
  if (node.diagonal()) return true;
  const Beyond beyond(facts);
  Energy total;
  for (int channel = 0; channel < facts.channels; ++channel) {
    if (facts.flood_squared[channel] <= 0) continue;
    const std::size_t at = channel;
    const Block& i = level.block(node.row);
    const Block& j = level.block(node.col);
    const EstimateSums& sums = level.sums(node, channel);
    for (const Energy& e : {beyond.of(level.c(node, channel), i, j, radius, at, {sums.c_noise, i.size()}),
                            beyond.of(level.r(node, channel), j, i, radius, at, {sums.r_noise, j.size()})}) {
      total.signal += e.signal;
      total.noise += e.noise;
      total.samples += e.samples;
    }
  }
  return is_empty(total, facts.rule());
}

/// The least radius that covers all unknown light, or more than kLargestRadius.
int radius_of(const SearchFacts& facts, const std::vector<NodeLevel>& open) {
  int radius = 0;
  for (const NodeLevel& level : open)
    for (const Node& node : level.nodes()) {
      if (!node.diagonal()) radius = std::max(radius, 1);
      while (radius <= kLargestRadius && !within(facts, level, node, radius)) ++radius;
      if (radius > kLargestRadius) return radius;
    }
  return radius;
}

/// Dark pixels of the check photographs are as dark as empty blocks. noise: variance in units of the
/// photographs' own.
bool dark(const SearchFacts& facts, const std::vector<Checks::Residual>& residuals, double noise) {
  const DarkExcess excess(residuals, facts.flood_squared);
  const RankRule rule = facts.rule();
  bool all = true;
  for_blocks(facts.tree, [&](std::int32_t begin, std::int32_t end) {
    const Comparison seen = excess.of(begin, end);
    all = all && seen.misfit <= seen.samples * rule.empty_fraction * rule.empty_fraction +
                                    noise_allowance(noise * seen.noise, seen.samples, kCheckSigmas);
  });
  return all;
}

/// No level counts for more photographs: four colours, whose blocks light their children one by one.
constexpr int kMostOfLevel = 4 * 4;

/// The level that comes next.
NodeLevel& first_open(std::vector<NodeLevel>& open) {
  return *std::find_if(open.begin(), open.end(), [](const NodeLevel& l) { return !l.nodes().empty(); });
}

}  // namespace

// Light that goes p pixels at most is a band of T: T_ij = 0 unless i and j are within p rows and p
// columns. Comb (y, x) lights the pixels with row ≡ y and column ≡ x modulo 2p + 1. So a camera pixel i
// has at most one lit pixel j of each comb within reach, and the photograph of the comb shows the entry
// itself:
//
//   photograph_comb(j) (i) = T_ij
//
// This is the colouring of [Garg06 §5.2] where any two pixels up to 2p rows and columns apart conflict.
// (2p + 1)² of them conflict with each other, so no fewer photographs will do. Steps:
// 1. The patterns of the (2p + 1)² combs, each a list of single pixels, and their photographs.
// 2. From each photograph, what is known of T by now is subtracted: the rest belongs to the band.
// 3. T_ij of each unordered pair: the mean of pixel i of j's comb and pixel j of i's comb. Both show it,
//    because T is symmetric, and the mean has half the variance. For i = j that is one
//    photograph, of its own comb.
// 4. The entries go into a band of this radius, which needs no index (KnownTransport::begin_band).
// The check photographs decide whether the light does end at p (settle).
Result<void> ShortRange::add_band(int radius) {
  const Grid grid = facts_.tree.grid();
  const int step = 2 * radius + 1;
  const std::size_t pixels = grid.size();
  std::vector<std::int32_t> tree_of(pixels);
  for (std::size_t t = 0; t < pixels; ++t) tree_of[facts_.tree.order()[t]] = static_cast<std::int32_t>(t);
  const auto tree_at = [&](int row, int col) {
    const int raster = row * grid.cols + col;
    return tree_of[raster];
  };
  const auto comb_at = [&](int row, int col) {
    const int comb = row % step * step + col % step;
    return static_cast<std::size_t>(comb);
  };
  std::vector<LitBlocks> combs;
  for (int y = 0; y < step; ++y)
    for (int x = 0; x < step; ++x) {
      LitBlocks comb;
      for (int row = y; row < grid.rows; row += step)
        for (int col = x; col < grid.cols; col += step) {
          const std::int32_t t = tree_at(row, col);
          comb.push_back({t, t + 1});
        }
      combs.push_back(std::move(comb));
    }
  const std::int64_t first = photographer_.taken();
  photographer_.expect_later({});  // the search goes on if the combs find light that goes further
  SYMRIG_CHECK(photographer_.take("short-range light", combs));
  // seen[offset of the comb][channel][pixel]
  std::vector<PagedVector<float>> seen;
  SYMRIG_CHECK(
      photographer_.read(first, std::ssize(combs), [&](std::int64_t, std::span<TreePhotograph> photographs) {
        found_.known.subtract_from(photographs);
        for (TreePhotograph& p : photographs) seen.push_back(std::move(p.mean));
      }));
  found_.known.begin_band(radius);
  std::vector<float> value(facts_.channels);
  Tally tally(facts_.options.work);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      for (int dy = 0; dy <= radius && row + dy < grid.rows; ++dy)
        for (int dx = dy == 0 ? 0 : -radius; dx <= radius; ++dx) {
          tally.add(kEntryOperations * facts_.channels);
          if (col + dx < 0 || col + dx >= grid.cols) continue;
          const std::size_t i = tree_at(row, col);
          const std::size_t j = tree_at(row + dy, col + dx);
          const std::size_t comb_of_i = comb_at(row, col);
          const std::size_t comb_of_j = comb_at(row + dy, col + dx);
          for (std::size_t channel = 0; channel < value.size(); ++channel)
            value[channel] =
                (seen[comb_of_j][channel * pixels + i] + seen[comb_of_i][channel * pixels + j]) / 2;
          found_.known.add_scalar(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j), value);
        }
  return {};
}

/// The photographs of the next level are planned. If there are few, the later levels are no more than these
/// can grow to.
bool ShortRange::cheaper_than_levels(std::int64_t combs) const {
  NodeLevel& next = first_open(found_.open);
  const std::int64_t levels_left = facts_.tree.levels() - 1 - next.level();
  if (combs > levels_left * kMostOfLevel) return false;  // needs no plan
  const std::vector<double> children = children_per_block(facts_.tree);
  const double levels =
      most_photographs({.level = next.level(),
                        .planned = LevelSearch(facts_, photographer_, found_, next).foreseen(),
                        .before = found_.patterns_per_level[static_cast<std::size_t>(next.level())],
                        .children = children});
  return static_cast<double>(combs) <= levels;
}

Result<bool> ShortRange::settle(Checks& checks, std::int64_t budget) {
  const int radius = radius_of(facts_, found_.open);
  const std::int64_t combs = radius == 0 ? 0 : (2 * radius + 1) * (2 * radius + 1);
  if (radius > kLargestRadius || refused_.contains(radius)) return false;
  if (combs > 0 && (combs > budget || !cheaper_than_levels(combs))) return false;
  const KnownTransport::Mark mark = found_.known.mark();
  if (radius == 0) {
    for (const NodeLevel& level : found_.open)
      for (const Node& node : level.nodes()) add_direct(facts_, found_.known, level, node);
  } else {
    SYMRIG_CHECK(add_band(radius));
  }
  const auto& residuals = checks.residuals(found_.known);
  // Half of a pixel's (2p + 1)² - 1 neighbours are lit, each known to half the variance of a dark sample.
  const double model_noise = (static_cast<double>((2 * radius + 1) * (2 * radius + 1)) - 1) / 4;
  if (!dark(facts_, residuals, 1 + model_noise)) {
    refused_.insert(radius);
    found_.known.rewind(mark);
    checks.forget();
    return false;
  }
  found_.close_all(facts_);
  return true;
}

}  // namespace symrig::acquisition
