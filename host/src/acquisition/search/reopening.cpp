// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/reopening.hpp"

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/placement.hpp"
#include "acquisition/tree/tree_photograph.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

constexpr double kTolerances = 10;    // RMS: the sum of what all leaves of a block may miss stays well below
constexpr double kSuspectSigmas = 5;  // thousands of blocks are looked at: one false alarm in 10^6
constexpr double kFewestSamples = 16;
constexpr double kWrongShare = 0.5;  // of the entries' own size (RMS) that they must be wrong by
constexpr double kPart = 0.1;        // of the excess that a leaf's own light must amount to

// For Work: of a leaf in the noise of the model; of a number of it in its own light.
constexpr std::int64_t kLeafOperations = 16, kShareOperations = 4;

/// Variance per pixel that the noise of known transport adds to the check photographs: Σ over checks, units
/// of F². A leaf's image c has the noise of the photograph that it came from. It shines in with the share of
/// its lit side that is lit.
std::vector<double> model_noise(const BlockTree& tree, const KnownTransport& known,
                                std::span<const Checks::Residual> residuals, const DarkExcess& excess,
                                const Work& work) {
  std::vector<double> step(tree.order().size() + 1);  // differences between neighbouring pixels
  const auto add = [&](std::int32_t begin, std::int32_t end, std::int32_t lit_begin, std::int32_t lit_end,
                       double noise) {
    double shares = 0;
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const double share = excess.lit(k, lit_begin, lit_end) / (lit_end - lit_begin);
      shares += share * share / static_cast<double>(residuals.size());
    }
    step[begin] += noise * shares;
    step[end] -= noise * shares;
  };
  Tally tally(work);
  for (const KnownLeaf& leaf : known.leaves()) {
    tally.add(kLeafOperations * static_cast<std::int64_t>(residuals.size()));
    if (leaf.removed) continue;
    add(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.row_noise);
    if (!leaf.diagonal()) add(leaf.col_begin, leaf.col_end, leaf.row_begin, leaf.row_end, leaf.col_noise);
  }
  const auto scalars = known.scalars();
  for (std::size_t k = 0; k < scalars.size(); ++k) {
    const ScalarLeaf& s = scalars[k];
    if (s.row == s.col) continue;  // dark pixels do not see their own
    add(s.row, s.row + 1, s.col, s.col + 1, known.scalar_noise()[k]);
    add(s.col, s.col + 1, s.row, s.row + 1, known.scalar_noise()[k]);
  }
  std::partial_sum(step.begin(), step.end(), step.begin());
  return step;
}

/// Running sums over dark pixels, units of F², of the energy that wrong entries would leave there in a
/// pattern p of single pixels. Each entry is wrong by half its size, independently: ¼ Σ_j T_ij² p_j, less the
/// common part (random_share).
std::vector<double> allowed_before(const SearchFacts& facts, const KnownTransport& known,
                                   std::span<const float> pattern, double random_share) {
  std::vector<double> energy(pattern.size() + 1);
  const double single = kWrongShare * kWrongShare * random_share;
  const std::size_t channels = facts.channels;
  const auto add = [&](std::span<const float> seen, std::int32_t begin, std::span<const float> lit,
                       std::int32_t lit_begin, double f) {
    double squares = 0;
    for (std::size_t j = 0; j < lit.size(); ++j) {
      const double light =
          static_cast<double>(lit[j]) * static_cast<double>(pattern[static_cast<std::size_t>(lit_begin) + j]);
      squares += light * static_cast<double>(lit[j]);
    }
    const double wrong = single * squares / f;
    for (std::size_t i = 0; i < seen.size(); ++i)
      energy[static_cast<std::size_t>(begin) + i + 1] +=
          wrong * static_cast<double>(seen[i]) * static_cast<double>(seen[i]);
  };
  for (std::size_t channel = 0; channel < channels; ++channel) {
    const double f = facts.flood_squared[channel];
    if (f <= 0) continue;
    Tally tally(facts.options.work);
    for (const KnownLeaf& leaf : known.leaves()) {
      tally.add(kShareOperations * (leaf.rows() + leaf.cols()));
      if (leaf.removed) continue;
      const LeafSides sides = known.sides(leaf, static_cast<int>(channel));
      add(sides.a, leaf.row_begin, sides.b, leaf.col_begin, f);
      if (!leaf.diagonal()) add(sides.b, leaf.col_begin, sides.a, leaf.row_begin, f);
    }
    const auto scalars = known.scalars();
    for (std::size_t k = 0; k < scalars.size(); ++k) {
      const double value = known.scalar_values()[k * channels + channel];
      const std::size_t row = scalars[k].row;
      const std::size_t col = scalars[k].col;
      if (row == col) continue;  // dark pixels do not see their own
      energy[row + 1] += single * value * value / f * static_cast<double>(pattern[col]);
      energy[col + 1] += single * value * value / f * static_cast<double>(pattern[row]);
    }
  }
  for (std::size_t i = 0; i < pattern.size(); ++i)
    if (pattern[i] != 0) energy[i + 1] = 0;
  std::partial_sum(energy.begin(), energy.end(), energy.begin());
  return energy;
}

/// Unexplained energy of every pixel's neighbourhood in one check, per sample. The neighbourhood is the
/// smallest block with enough dark samples. 0 where noise, tolerances and a share of the transport itself
/// explain it.
std::vector<double> unexplained(const SearchFacts& facts, const KnownTransport& known,
                                std::span<const Checks::Residual> residuals, const DarkExcess& excess) {
  const std::vector<double> noise = model_noise(facts.tree, known, residuals, excess, facts.options.work);
  std::vector<double> noise_before(noise.size());
  std::partial_sum(noise.begin(), noise.end() - 1, noise_before.begin() + 1);
  // Signs of errors are as good as random between pixels that are lit independently, but for their common
  // part.
  const auto pixels = static_cast<std::int32_t>(facts.tree.order().size());
  const std::vector<double> allowed =
      allowed_before(facts, known, residuals[0].photograph.pattern, 1 - excess.lit(0, 0, pixels) / pixels);
  std::vector<double> energy(facts.tree.order().size());
  for (int l = 0; l < facts.tree.levels(); ++l) {
    for (const Block& block : facts.tree.level(l)) {
      const Comparison seen = excess.of(block.begin, block.end);
      if (seen.samples < kFewestSamples) continue;
      const auto sum = [&](const std::vector<double>& before) {
        return before[block.end] - before[block.begin];
      };
      const double noise_of_model = sum(noise_before) / block.size() * seen.samples;
      const double left =
          (seen.misfit - noise_allowance(seen.noise + noise_of_model, seen.samples, kSuspectSigmas)) /
          seen.samples;
      const bool wrong =
          left > std::max(kTolerances * kTolerances * facts.tolerance(), sum(allowed) / seen.samples);
      std::fill(energy.begin() + block.begin, energy.begin() + block.end, wrong ? left : 0);
    }
  }
  return energy;
}

/// Mean square of the light that a leaf sends from its lit side into dark pixels of the seen side, units of
/// F².
double own_light(const SearchFacts& facts, std::span<const Checks::Residual> residuals,
                 std::span<const float> seen, std::int32_t seen_begin, std::span<const float> lit,
                 std::int32_t lit_begin, std::size_t channel) {
  double energy = 0;
  double samples = 0;
  for (const Checks::Residual& check : residuals) {
    const std::span<const float> pattern = check.photograph.pattern;
    double light = 0;
    for (std::size_t j = 0; j < lit.size(); ++j)
      light +=
          static_cast<double>(lit[j]) * static_cast<double>(pattern[static_cast<std::size_t>(lit_begin) + j]);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (pattern[static_cast<std::size_t>(seen_begin) + i] != 0) continue;
      const double y = light * static_cast<double>(seen[i]);
      energy += y * y;
      ++samples;
    }
  }
  return samples > 0 ? energy / samples / facts.flood_squared[channel] : 0;
}

}  // namespace

std::vector<std::int32_t> suspects(const SearchFacts& facts, const KnownTransport& known,
                                   const std::vector<Checks::Residual>& all) {
  const auto residuals = Checks::random(all);
  std::vector<double> energy(facts.tree.order().size());
  std::vector<std::vector<double>> found_by(residuals.size());
  tbb::parallel_for(std::size_t{0}, residuals.size(), [&](std::size_t k) {
    const auto one = residuals.subspan(k, 1);
    found_by[k] = unexplained(facts, known, one, DarkExcess(one, facts.flood_squared));
  });
  for (const std::vector<double>& of_check : found_by)
    for (std::size_t t = 0; t < energy.size(); ++t) energy[t] = std::max(energy[t], of_check[t]);
  if (std::all_of(energy.begin(), energy.end(), [](double e) { return e <= 0; })) return {};
  const auto largest = [&](std::int32_t begin, std::int32_t end) {
    return *std::max_element(energy.begin() + begin, energy.begin() + end);
  };
  std::vector<std::int32_t> found;
  const auto leaves = known.leaves();
  Tally tally(facts.options.work);
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    const KnownLeaf& leaf = leaves[n];
    tally.add(kShareOperations * facts.channels * std::ssize(residuals) * (leaf.rows() + leaf.cols()));
    if (leaf.removed) continue;
    const double row = largest(leaf.row_begin, leaf.row_end);
    const double col = largest(leaf.col_begin, leaf.col_end);
    if (row <= 0 && col <= 0) continue;
    bool part = false;
    for (std::size_t channel = 0; channel < facts.flood_squared.size() && !part; ++channel) {
      if (facts.flood_squared[channel] <= 0) continue;
      const LeafSides sides = known.sides(leaf, static_cast<int>(channel));
      part = (row > 0 && own_light(facts, residuals, sides.a, leaf.row_begin, sides.b, leaf.col_begin,
                                   channel) > kPart * row) ||
             (col > 0 && own_light(facts, residuals, sides.b, leaf.col_begin, sides.a, leaf.row_begin,
                                   channel) > kPart * col);
    }
    if (part) found.push_back(static_cast<std::int32_t>(n));
  }
  return found;
}

namespace {

/// Light that a residual shift moves makes no leaf wrong.
std::vector<Checks::Residual> with_shift(const SearchFacts& facts, std::vector<Checks::Residual> residuals) {
  for (Checks::Residual& one : residuals)
    add_shift_variance(facts.tree, facts.residual_shift, {&one.photograph, 1});
  return residuals;
}

}  // namespace

void Reopening::review(Checks& checks, bool done) {
  // A pattern that deceives all blocks looks no better until single pixels are separated.
  constexpr double kWorse = 0.01;
  const auto& residuals = checks.residuals(found_.known);
  const Comparison seen = DarkExcess(Checks::random(residuals), facts_.flood_squared)
                              .of(0, static_cast<std::int32_t>(facts_.tree.grid().size()));
  if (last_ && seen.misfit - last_->seen.misfit > kWorse * last_->seen.excess()) return put_back();
  changed_ = changed_ || last_;
  last_.reset();
  if (!done) return;
  std::vector<std::int32_t> found =
      acquisition::suspects(facts_, found_.known, with_shift(facts_, residuals));
  suspects_ = std::ssize(found);
  const TransportErrors missed = Checks::errors(residuals);
  sparseness_.misses({missed.indirect, missed.frobenius});
  budget_.begin_reopening();
  if (found.empty()) return;
  // The rest of the budget may be too small for a single leaf. Then the same leaves would be reopened for
  // ever.
  if (budget_.left() <= 0 || last_at_ == photographer_.taken())
    sparseness_.doubt_leaves();
  else
    reopen_all(std::move(found), seen);
}

void Reopening::reopen_all(std::vector<std::int32_t> leaves, const Comparison& seen) {
  last_at_ = photographer_.taken();
  last_ = Attempt{found_.known.mark(), std::move(leaves), seen, found_.level_light.size()};
  for (const std::int32_t leaf : last_->leaves) {
    const int level = found_.known.leaves()[leaf].level;
    reopen(facts_, found_.known, leaf, found_.open[level]);
  }
}

void Reopening::put_back() {
  found_.known.rewind(last_->mark);
  for (const std::int32_t leaf : last_->leaves) found_.known.restore_leaf(leaf);
  found_.level_light.resize(last_->level_light, LevelLight(0, {}, 0, 0));
  last_.reset();
}

}  // namespace symrig::acquisition
