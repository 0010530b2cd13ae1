// SPDX-License-Identifier: Apache-2.0
#include "acquisition/polish.hpp"

#include "tensor/kernels.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

/// Levenberg's share of the diagonal: numbers that the photographs hardly determine stay where they are.
constexpr float kDamping = 0.1F;

/// How far a factor may move in one step, as a share of its length: δa δb', which the linear model leaves out,
/// is then at most kReach / 2 of what it predicts for the leaf.
constexpr double kReach = 0.5;

/// Where the numbers of one leaf and channel are, and its pixels.
struct LeafNumbers {
  std::size_t a, b, rows, cols, row_begin, col_begin;
};

LeafNumbers numbers_of(const KnownLeaf& leaf, std::size_t channel) {
  const auto rows = static_cast<std::size_t>(leaf.rows());
  const auto cols = static_cast<std::size_t>(leaf.cols());
  const std::size_t a = static_cast<std::size_t>(leaf.factors) + channel * (rows + cols);
  return {a,
          a + rows,
          rows,
          cols,
          static_cast<std::size_t>(leaf.row_begin),
          static_cast<std::size_t>(leaf.col_begin)};
}

/// Mean of a pattern over a block.
float share(const float* pattern, std::size_t pixels) {
  return static_cast<float>(std::accumulate(pattern, pattern + pixels, 0.0) / static_cast<double>(pixels));
}

double inner(std::span<const float> a, std::span<const float> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0, std::plus<>(),
                            [](float x, float y) { return static_cast<double>(x) * static_cast<double>(y); });
}

/// A leaf of a block with itself has a = b and stays as it is.
bool polished(const KnownLeaf& leaf) {
  return !leaf.removed && !leaf.diagonal();
}

double length(const float* v, std::size_t n) {
  return std::sqrt(inner({v, n}, {v, n}));
}

/// Share of a move that keeps within kReach of where a factor is.
double within_reach(const float* at, const float* move, std::size_t n) {
  const double wanted = length(move, n);
  const double allowed = kReach * length(at, n);
  return wanted > allowed ? allowed / wanted : 1;
}

}  // namespace

Polish::Polish(Context& context, std::vector<Range> photographs, std::vector<double> misfit)
    : context_(context), ranges_(std::move(photographs)), misfit_(std::move(misfit)) {}

Result<void> Polish::visit(const Visit& visit) const {
  for (const Range& range : ranges_)
    SYMRIG_CHECK(context_.photographer.read(
        range.first, range.last - range.first,
        [&](std::int64_t, std::span<TreePhotograph> photographs) { visit(photographs); }));
  return {};
}

/// variance becomes the weight; 0 where nothing was seen.
void Polish::weigh(TreePhotograph& photograph) const {
  const std::size_t pixels = photograph.pattern.size();
  for (std::size_t at = 0; at < photograph.mean.size(); ++at)
    photograph.variance[at] =
        photograph.valid[at] == 0
            ? 0
            : static_cast<float>(1 / (static_cast<double>(photograph.variance[at]) + misfit_[at / pixels]));
}

/// y = what the transport changes by in this photograph when the numbers move along `direction`.
void Polish::image(const Numbers& direction, const TreePhotograph& photograph, std::span<float> y) const {
  const std::size_t pixels = photograph.pattern.size();
  const float* const p = photograph.pattern.data();
  const float* const value = context_.known.factors().data();
  const auto scalars = context_.known.scalars();
  const std::size_t first_scalar = context_.known.factors().size();
  const auto channels = static_cast<std::size_t>(context_.channels);
  std::fill(y.begin(), y.end(), 0.0F);
  for (std::size_t channel = 0; channel < channels; ++channel) {
    float* const out = y.data() + channel * pixels;
    for (const KnownLeaf& leaf : context_.known.leaves()) {
      if (!polished(leaf)) continue;
      const LeafNumbers at = numbers_of(leaf, channel);
      const float light_b = tensor::dot(value + at.b, p + at.col_begin, at.cols);
      const float light_a = tensor::dot(value + at.a, p + at.row_begin, at.rows);
      const float moved_b = tensor::dot(direction.data() + at.b, p + at.col_begin, at.cols);
      const float moved_a = tensor::dot(direction.data() + at.a, p + at.row_begin, at.rows);
      tensor::add_scaled(light_b, direction.data() + at.a, out + at.row_begin, at.rows);
      tensor::add_scaled(moved_b, value + at.a, out + at.row_begin, at.rows);
      tensor::add_scaled(light_a, direction.data() + at.b, out + at.col_begin, at.cols);
      tensor::add_scaled(moved_a, value + at.b, out + at.col_begin, at.cols);
    }
    for (std::size_t k = 0; k < scalars.size(); ++k) {
      const float move = direction[first_scalar + k * channels + channel];
      const auto row = static_cast<std::size_t>(scalars[k].row);
      const auto col = static_cast<std::size_t>(scalars[k].col);
      out[row] += move * p[col];
      if (row != col) out[col] += move * p[row];
    }
  }
}

/// gradient += Jᵀ e over the photographs (mean = weighted residual e), diagonal += diag(Jᵀ W J) (variance =
/// weight), but for terms that are small where blocks are large. Each leaf is one task: the same sums in the
/// same order for any number of threads.
void Polish::gather(std::span<const TreePhotograph> weighted, Numbers& gradient, Numbers* diagonal) const {
  const auto leaves = context_.known.leaves();
  const auto scalars = context_.known.scalars();
  const float* const value = context_.known.factors().data();
  const std::size_t first_scalar = context_.known.factors().size();
  const auto channels = static_cast<std::size_t>(context_.channels);
  const std::size_t pixels = context_.tree.order().size();
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t n) {
    if (!polished(leaves[n])) return;
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const LeafNumbers at = numbers_of(leaves[n], channel);
      for (const TreePhotograph& photograph : weighted) {
        const float* const p = photograph.pattern.data();
        const float* const e = photograph.mean.data() + channel * pixels;
        const float* const w = photograph.variance.data() + channel * pixels;
        const float light_b = tensor::dot(value + at.b, p + at.col_begin, at.cols);
        const float light_a = tensor::dot(value + at.a, p + at.row_begin, at.rows);
        const float seen_a = tensor::dot(value + at.a, e + at.row_begin, at.rows);
        const float seen_b = tensor::dot(value + at.b, e + at.col_begin, at.cols);
        tensor::add_scaled(light_b, e + at.row_begin, gradient.data() + at.a, at.rows);
        tensor::add_scaled(seen_b, p + at.row_begin, gradient.data() + at.a, at.rows);
        tensor::add_scaled(light_a, e + at.col_begin, gradient.data() + at.b, at.cols);
        tensor::add_scaled(seen_a, p + at.col_begin, gradient.data() + at.b, at.cols);
        if (diagonal == nullptr) continue;
        const float random_b =
            share(p + at.col_begin, at.cols) * tensor::dot(value + at.b, value + at.b, at.cols);
        const float random_a =
            share(p + at.row_begin, at.rows) * tensor::dot(value + at.a, value + at.a, at.rows);
        tensor::add_scaled(light_b * light_b + random_b, w + at.row_begin, diagonal->data() + at.a, at.rows);
        tensor::add_scaled(light_a * light_a + random_a, w + at.col_begin, diagonal->data() + at.b, at.cols);
      }
    }
  });
  tbb::parallel_for(std::size_t{0}, scalars.size(), [&](std::size_t k) {
    const auto row = static_cast<std::size_t>(scalars[k].row);
    const auto col = static_cast<std::size_t>(scalars[k].col);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const std::size_t at = first_scalar + k * channels + channel;
      for (const TreePhotograph& photograph : weighted) {
        const float* const p = photograph.pattern.data();
        const float* const e = photograph.mean.data() + channel * pixels;
        const float* const w = photograph.variance.data() + channel * pixels;
        gradient[at] += p[col] * e[row];
        if (row != col) gradient[at] += p[row] * e[col];
        if (diagonal == nullptr) continue;
        (*diagonal)[at] += p[col] * p[col] * w[row];
        if (row != col) (*diagonal)[at] += p[row] * p[row] * w[col];
      }
    }
  });
}

Result<double> Polish::misfit_of(const Known& known) const {
  double total = 0;
  SYMRIG_CHECK(visit([&](std::span<TreePhotograph> photographs) {
    known.subtract_from(photographs);
    for (TreePhotograph& photograph : photographs) {
      weigh(photograph);
      for (std::size_t at = 0; at < photograph.mean.size(); ++at)
        total += static_cast<double>(photograph.variance[at]) * static_cast<double>(photograph.mean[at]) *
                 static_cast<double>(photograph.mean[at]);
    }
  }));
  return total;
}

Polish::Numbers Polish::numbers() const {
  Known& known = context_.known;
  Numbers all(known.factors().begin(), known.factors().end());
  all.insert(all.end(), known.scalar_values().begin(), known.scalar_values().end());
  return all;
}

/// A leaf that holds little but noise hardly changes the photographs to first order even where both factors
/// grow a hundredfold, and then δa δb' outweighs the leaf.
void Polish::shorten(Numbers& move) const {
  const float* const value = context_.known.factors().data();
  for (const KnownLeaf& leaf : context_.known.leaves()) {
    if (!polished(leaf)) continue;
    for (std::size_t channel = 0; channel < static_cast<std::size_t>(context_.channels); ++channel) {
      const LeafNumbers at = numbers_of(leaf, channel);
      const auto share = static_cast<float>(std::min(within_reach(value + at.a, &move[at.a], at.rows),
                                                     within_reach(value + at.b, &move[at.b], at.cols)));
      if (share == 1) continue;
      for (std::size_t n = at.a; n < at.b + at.cols; ++n) move[n] *= share;
    }
  }
}

Result<Polish::Outcome> Polish::step(int steps) {
  Known& known = context_.known;
  const Numbers start = numbers();
  Numbers residual(start.size()), diagonal(start.size());
  Outcome outcome;
  SYMRIG_CHECK(visit([&](std::span<TreePhotograph> photographs) {
    known.subtract_from(photographs);
    for (TreePhotograph& photograph : photographs) {
      weigh(photograph);
      for (std::size_t at = 0; at < photograph.mean.size(); ++at) {
        const double e = photograph.mean[at];
        outcome.before += static_cast<double>(photograph.variance[at]) * e * e;
        photograph.mean[at] *= photograph.variance[at];
      }
    }
    gather(photographs, residual, &diagonal);
  }));
  const auto precondition = [&](const Numbers& r) {
    Numbers z(r.size());
    for (std::size_t n = 0; n < r.size(); ++n) z[n] = diagonal[n] > 0 ? r[n] / diagonal[n] : 0;
    return z;
  };
  Numbers move(start.size());
  Numbers z = precondition(residual);
  Numbers direction = z;
  double rho = inner(residual, z);
  for (int k = 0; k < steps && rho > 0; ++k) {
    Numbers curved(start.size());  // Jᵀ W J direction
    SYMRIG_CHECK(visit([&](std::span<TreePhotograph> photographs) {
      tbb::parallel_for(std::size_t{0}, photographs.size(), [&](std::size_t i) {
        image(direction, photographs[i], photographs[i].mean);
        weigh(photographs[i]);
        for (std::size_t at = 0; at < photographs[i].mean.size(); ++at)
          photographs[i].mean[at] *= photographs[i].variance[at];
      });
      gather(photographs, curved, nullptr);
    }));
    for (std::size_t n = 0; n < curved.size(); ++n) curved[n] += kDamping * diagonal[n] * direction[n];
    const double curvature = inner(direction, curved);
    if (curvature <= 0) break;
    const auto length = static_cast<float>(rho / curvature);
    for (std::size_t n = 0; n < move.size(); ++n) {
      move[n] += length * direction[n];
      residual[n] -= length * curved[n];
    }
    z = precondition(residual);
    const double next = inner(residual, z);
    const auto turn = static_cast<float>(next / rho);
    rho = next;
    for (std::size_t n = 0; n < direction.size(); ++n) direction[n] = z[n] + turn * direction[n];
  }
  shorten(move);
  const auto set = [&](float share) {
    const std::size_t factors = known.factors().size();
    for (std::size_t n = 0; n < factors; ++n) known.factors()[n] = start[n] + share * move[n];
    for (std::size_t n = factors; n < start.size(); ++n)
      known.scalar_values()[n - factors] = start[n] + share * move[n];
  };
  for (float share = 1; share > 0.05F; share /= 2) {
    set(share);
    Result<double> after = misfit_of(known);
    if (!after) {
      set(0);
      return after.error();
    }
    outcome.after = *after;
    if (outcome.after <= outcome.before) return outcome;
  }
  set(0);
  outcome.after = outcome.before;
  return outcome;
}

}  // namespace symrig::acquisition
