// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/polish.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

/// Levenberg's share of the diagonal: numbers that the photographs hardly determine stay where they are.
constexpr float kDamping = 0.1F;

/// How far a factor may move in one step, as a share of its length. The linear model leaves out δa δb'. So
/// that is at most kReach / 2 of what the model predicts for the leaf.
constexpr double kReach = 0.5;

/// Photographs that are kept between conjugate-gradient steps: as much as 300 of a 310 x 350 grid.
constexpr std::int64_t kKeptBytes = std::int64_t{300} << 20;

/// Batches that are worked on together.
constexpr std::size_t kGroup = 4;

constexpr std::size_t kBlock = 16384;  ///< numbers of one task

/// Calls use(begin, end) for blocks of n numbers, from many threads.
template <class Use>
void in_blocks(std::size_t n, const Use& use) {
  tbb::parallel_for(std::size_t{0}, (n + kBlock - 1) / kBlock,
                    [&](std::size_t k) { use(k * kBlock, std::min(n, (k + 1) * kBlock)); });
}

double inner_of(const float* a, const float* b, std::size_t n) {
  return std::inner_product(a, a + n, b, 0.0, std::plus<>(),
                            [](float x, float y) { return static_cast<double>(x) * static_cast<double>(y); });
}

/// The same bits for any number of threads.
double inner(const PolishNumbers& a, const PolishNumbers& b) {
  std::vector<double> sums((a.size() + kBlock - 1) / kBlock);
  in_blocks(a.size(), [&](std::size_t begin, std::size_t end) {
    sums[begin / kBlock] = inner_of(a.data() + begin, b.data() + begin, end - begin);
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

/// z = residual / diagonal
void precondition(const PolishNumbers& residual, const PolishNumbers& diagonal, PolishNumbers& z) {
  in_blocks(z.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) z[n] = diagonal[n] > 0 ? residual[n] / diagonal[n] : 0;
  });
}

/// to = a + scale b
void combine(PolishNumbers& to, const PolishNumbers& a, float scale, const PolishNumbers& b) {
  in_blocks(to.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) to[n] = a[n] + scale * b[n];
  });
}

/// Share of a move that keeps within kReach of where a factor is.
double within_reach(const float* at, const float* move, std::size_t n) {
  const double wanted = std::sqrt(inner_of(move, move, n));
  const double allowed = kReach * std::sqrt(inner_of(at, at, n));
  return wanted > allowed ? allowed / wanted : 1;
}

std::vector<std::span<TreePhotograph>> batches_of(std::span<TreePhotograph> photographs) {
  std::vector<std::span<TreePhotograph>> batches;
  for (std::size_t first = 0; first < photographs.size(); first += tensor::kBatch)
    batches.push_back(photographs.subspan(first, std::min(tensor::kBatch, photographs.size() - first)));
  return batches;
}

/// Σ weight mean² of each photograph, added up in their order.
double misfit_of(std::span<const TreePhotograph> residuals) {
  std::vector<double> sums(residuals.size());
  tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t k) {
    for (std::size_t at = 0; at < residuals[k].mean.size(); ++at) {
      const double e = residuals[k].mean[at];
      sums[k] += static_cast<double>(residuals[k].variance[at]) * e * e;
    }
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

}  // namespace

Polish::Polish(const SceneFacts& facts, const Photographer& photographer, KnownTransport& known,
               std::vector<LogRange> photographs, std::vector<double> misfit)
    : facts_(facts),
      photographer_(photographer),
      known_(known),
      ranges_(std::move(photographs)),
      misfit_(std::move(misfit)),
      jacobian_(known, facts.channels) {}

/// variance becomes the weight; 0 where nothing was seen.
void Polish::weigh(TreePhotograph& photograph) const {
  const std::size_t pixels = photograph.pattern.size();
  for (std::size_t at = 0; at < photograph.mean.size(); ++at)
    photograph.variance[at] =
        photograph.valid[at] == 0
            ? 0
            : static_cast<float>(1 / (static_cast<double>(photograph.variance[at]) + misfit_[at / pixels]));
}

/// Returns φ.
Result<double> Polish::visit_residuals(const UseResiduals& use) const {
  double total = 0;
  for (const LogRange& range : ranges_)
    SYMRIG_CHECK(photographer_.read(range.first, range.last - range.first,
                                    [&](std::int64_t, std::span<TreePhotograph> photographs) {
                                      known_.subtract_from(photographs);
                                      tbb::parallel_for(std::size_t{0}, photographs.size(),
                                                        [&](std::size_t k) { weigh(photographs[k]); });
                                      total += misfit_of(photographs);
                                      use(photographs);
                                    }));
  return total;
}

bool Polish::keeps() const {
  std::int64_t photographs = 0;
  for (const LogRange& range : ranges_) photographs += range.last - range.first;
  const std::int64_t values = (1 + facts_.channels) * facts_.tree.grid().size();
  return photographs * values * static_cast<std::int64_t>(sizeof(float)) <= kKeptBytes;
}

Result<void> Polish::curved(const Numbers& direction, Numbers& sum) const {
  sum.assign(direction.size(), 0);
  const PolishJacobian::Tangents tangents = jacobian_.tangents(direction);
  const auto add = [&](std::span<const PolishBatch> batches) {
    jacobian_.gather(batches, jacobian_.image(batches, tangents), sum);
  };
  for (std::size_t first = 0; first < kept_.size(); first += kGroup)
    add(std::span(kept_).subspan(first, std::min(kGroup, kept_.size() - first)));
  if (!kept_.empty()) return {};
  for (const LogRange& range : ranges_)
    SYMRIG_CHECK(photographer_.read(range.first, range.last - range.first,
                                    [&](std::int64_t, std::span<TreePhotograph> photographs) {
                                      tbb::parallel_for(std::size_t{0}, photographs.size(),
                                                        [&](std::size_t k) { weigh(photographs[k]); });
                                      std::vector<PolishBatch> batches;
                                      for (const auto& batch : batches_of(photographs))
                                        batches.emplace_back(batch);
                                      add(batches);
                                    }));
  return {};
}

/// (Jᵀ W J + damping) move = residual, approximately.
Result<Polish::Numbers> Polish::solve(Numbers residual, const Numbers& diagonal, int steps) const {
  Numbers move(residual.size());
  Numbers direction(residual.size());
  precondition(residual, diagonal, direction);
  Numbers along;  // then z, the preconditioned residual
  double rho = inner(residual, direction);
  for (int k = 0; k < steps && rho > 0; ++k) {
    SYMRIG_CHECK(curved(direction, along));
    in_blocks(along.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) along[n] += kDamping * diagonal[n] * direction[n];
    });
    const double curvature = inner(direction, along);
    if (curvature <= 0) break;
    const auto length = static_cast<float>(rho / curvature);
    combine(move, move, length, direction);
    combine(residual, residual, -length, along);
    precondition(residual, diagonal, along);
    const double next = inner(residual, along);
    combine(direction, along, static_cast<float>(next / rho), direction);
    rho = next;
  }
  return move;
}

/// Brings each leaf's move within reach; both its factors move by the same share of what was solved for.
void Polish::shorten(Numbers& move) const {
  const float* const value = known_.factors().data();
  for (const KnownLeaf& leaf : known_.leaves()) {
    if (!polished(leaf)) continue;
    for (std::size_t channel = 0; channel < static_cast<std::size_t>(facts_.channels); ++channel) {
      const LeafNumbers at = numbers_of(leaf, channel);
      const auto share = static_cast<float>(std::min(within_reach(value + at.a, &move[at.a], at.rows),
                                                     within_reach(value + at.b, &move[at.b], at.cols)));
      for (std::size_t n = at.a; n < at.b + at.cols; ++n) move[n] *= share;
    }
  }
}

Polish::Numbers Polish::numbers() const {
  Numbers all(known_.factors().begin(), known_.factors().end());
  all.append(known_.scalar_values().begin(), known_.scalar_values().end());
  return all;
}

/// Halves the move until φ falls; if it does not, nothing moves.
Result<Polish::Outcome> Polish::move_along(const Numbers& move, double before) {
  const Numbers start = numbers();
  const auto set = [&](float share) {
    const std::span<float> factors = known_.change_factors();
    const std::span<float> scalars = known_.change_scalar_values();
    for (std::size_t n = 0; n < start.size(); ++n)
      (n < factors.size() ? factors[n] : scalars[n - factors.size()]) = start[n] + share * move[n];
  };
  constexpr int kHalvings = 4;
  for (int halvings = 0; halvings <= kHalvings; ++halvings) {
    set(std::ldexp(1.0F, -halvings));
    const Result<double> after = visit_residuals([](std::span<TreePhotograph>) {});
    if (!after) {
      set(0);
      return after.error();
    }
    if (*after <= before) return Outcome{before, *after};
  }
  set(0);
  return Outcome{before, before};
}

Result<Polish::Outcome> Polish::step(int steps) {
  Numbers residual(numbers().size());
  Numbers diagonal(residual.size());
  const bool keep = keeps();
  kept_.clear();
  SYMRIG_TRY(const double before, visit_residuals([&](std::span<TreePhotograph> photographs) {
               std::vector<PolishBatch> batches;
               std::vector<PolishSamples> samples;
               for (const auto& batch : batches_of(photographs)) {
                 batches.emplace_back(batch);
                 samples.push_back(means_of(batch));
                 PolishSamples& e = samples.back();
                 for (std::size_t s = 0; s < e.size(); ++s) e[s] *= batches.back().weight[s];
               }
               jacobian_.gather(batches, samples, residual);
               jacobian_.add_diagonal(batches, diagonal);
               if (keep) std::move(batches.begin(), batches.end(), std::back_inserter(kept_));
             }));
  SYMRIG_TRY(Numbers move, solve(std::move(residual), diagonal, steps));
  shorten(move);
  kept_.clear();
  return move_along(move, before);
}

}  // namespace symrig::acquisition
