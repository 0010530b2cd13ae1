// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/polish.hpp"

#include "acquisition/refine/polish_jacobian.hpp"

#include <algorithm>
#include <array>
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
double inner_of(const PolishNumbers& a, const PolishNumbers& b) {
  std::vector<double> sums((a.size() + kBlock - 1) / kBlock);
  in_blocks(a.size(), [&](std::size_t begin, std::size_t end) {
    sums[begin / kBlock] = inner_of(a.data() + begin, b.data() + begin, end - begin);
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

/// z = residual / diagonal
void precondition(const std::vector<PolishNumbers>& residual, const std::vector<PolishNumbers>& diagonal,
                  std::vector<PolishNumbers>& z) {
  for (std::size_t part = 0; part < z.size(); ++part)
    in_blocks(z[part].size(), [&](std::size_t begin, std::size_t end) {
      const PolishNumbers &r = residual[part], &d = diagonal[part];
      for (std::size_t n = begin; n < end; ++n) z[part][n] = d[n] > 0 ? r[n] / d[n] : 0;
    });
}

/// to = a + scale b
void combine(std::vector<PolishNumbers>& to, const std::vector<PolishNumbers>& a, float scale,
             const std::vector<PolishNumbers>& b) {
  for (std::size_t part = 0; part < to.size(); ++part)
    in_blocks(to[part].size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) to[part][n] = a[part][n] + scale * b[part][n];
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

PolishNumbers numbers_of(const KnownTransport& known) {
  PolishNumbers all(known.factors().begin(), known.factors().end());
  all.append(known.scalar_values().begin(), known.scalar_values().end());
  return all;
}

/// to += from, each number rounded.
void add_rounded(const ExactSums& exact, const PagedVector<float>& from, double* to) {
  in_blocks(from.size(), [&](std::size_t begin, std::size_t end) {
    const float* const number = from.data();
    for (std::size_t n = begin; n < end; ++n) to[n] += exact.rounded(number[n]);
  });
}

void swap_means(std::span<TreePhotograph> photographs, std::vector<PagedVector<float>>& means) {
  for (std::size_t k = 0; k < photographs.size(); ++k) std::swap(photographs[k].mean, means[k]);
}

const PolishTeam& alone() {
  static const PolishTeam team;
  return team;
}

}  // namespace

Polish::Polish(const SearchFacts& facts, const Photographer& photographer, KnownTransport& known,
               std::vector<LogRange> photographs, std::vector<double> misfit)
    : Polish(
          alone(), std::span(&known, 1), photographer,
          {static_cast<std::size_t>(facts.tree.grid().size()), std::move(photographs), std::move(misfit)}) {}

Polish::Polish(const PolishTeam& team, std::span<KnownTransport> parts, const Photographer& photographer,
               Photographs photographs)
    : team_(team),
      photographer_(photographer),
      parts_(parts),
      all_(std::move(photographs)),
      channels_(static_cast<int>(all_.misfit.size())) {
  for (const KnownTransport& part : parts_) jacobians_.emplace_back(part, channels_, photographer_.work());
}

/// variance becomes the weight; 0 where nothing was seen.
void Polish::weigh(TreePhotograph& photograph) const {
  const std::size_t pixels = photograph.pattern.size();
  for (std::size_t at = 0; at < photograph.mean.size(); ++at)
    photograph.variance[at] = photograph.valid[at] == 0
                                  ? 0
                                  : static_cast<float>(1 / (static_cast<double>(photograph.variance[at]) +
                                                            all_.misfit[at / pixels]));
}

void Polish::weigh_all(std::span<TreePhotograph> photographs) const {
  tbb::parallel_for(std::size_t{0}, photographs.size(), [&](std::size_t k) { weigh(photographs[k]); });
}

/// All photographs, some at a time. If one process cannot read them, none waits for it.
Result<void> Polish::visit(const Use& use) const {
  Result<void> all;
  for (const LogRange& range : all_.ranges) {
    const Result<void> mine = photographer_.read(
        range.first, range.last - range.first,
        [&](std::int64_t, std::span<TreePhotograph> photographs) {
          if (all) all = team_.all({});
          if (all) use(photographs);
        },
        tensor::kBatch);
    if (all && !mine) all = team_.all(mine);
    if (!all) break;
  }
  return all;
}

/// Returns φ. Every process adds up the same residuals; that of the first part decides.
Result<double> Polish::visit_residuals(const UseResiduals& use) const {
  double total = 0;
  const double most = this->most(nullptr);
  SYMRIG_CHECK(visit([&](std::span<TreePhotograph> photographs) {
    subtract(photographs, most);
    weigh_all(photographs);
    total += misfit_of(photographs);
    use(photographs);
  }));
  std::array<double, 1> decided{team_.first() == 0 ? total : 0};
  team_.add_up(decided);
  return decided[0];
}

std::int64_t Polish::photographs() const {
  std::int64_t sum = 0;
  for (const LogRange& range : all_.ranges) sum += range.last - range.first;
  return sum;
}

/// The residuals with gradient and diagonal, then the conjugate gradients, then the residuals of the move.
std::int64_t Polish::operations(int steps) const {
  using Jacobian = PolishJacobian;
  constexpr std::int64_t kSubtract = 2 * tensor::kBatch, kSample = 8;  // KnownTransport, Photographer
  std::int64_t numbers = 0;
  for (const KnownTransport& part : parts_)
    numbers += static_cast<std::int64_t>(part.factors().size() + part.scalar_values().size());
  const std::int64_t batches = photographs() / static_cast<std::int64_t>(tensor::kBatch) + 1;
  const std::int64_t samples = photographs() * static_cast<std::int64_t>(all_.pixels) * channels_;
  const std::int64_t begin = kSubtract + Jacobian::kGatherOperations + Jacobian::kDiagonalOperations;
  const std::int64_t each = Jacobian::kImageOperations + Jacobian::kGatherOperations;
  return batches * numbers * (begin + steps * each + kSubtract) +
         samples * (2 * (kSample + 2) + (keeps() ? 0 : steps * kSample));
}

bool Polish::keeps() const {
  const std::int64_t photographs = this->photographs();
  const std::int64_t values = (1 + channels_) * static_cast<std::int64_t>(all_.pixels);
  return photographs * values * static_cast<std::int64_t>(sizeof(float)) <= kKeptBytes;
}

/// Added up in the order of all parts, on all processes.
double Polish::sum_of_parts(const std::vector<double>& mine) const {
  std::vector<double> all(team_.parts());
  std::copy(mine.begin(), mine.end(), all.begin() + static_cast<std::ptrdiff_t>(team_.first()));
  team_.add_up(all);
  return std::accumulate(all.begin(), all.end(), 0.0);
}

double Polish::inner(const Numbers& a, const Numbers& b) const {
  std::vector<double> mine(parts_.size());
  for (std::size_t part = 0; part < mine.size(); ++part) mine[part] = inner_of(a[part], b[part]);
  return sum_of_parts(mine);
}

/// Bounds T p, or J direction, for ExactSums.
double Polish::most(const Numbers* direction) const {
  if (!dealt()) return 0;
  std::vector<double> mine(parts_.size());
  tbb::parallel_for(std::size_t{0}, mine.size(), [&](std::size_t part) {
    mine[part] = direction == nullptr ? most_light(parts_[part], channels_, all_.pixels)
                                      : most_change(parts_[part], channels_, all_.pixels, (*direction)[part]);
  });
  return sum_of_parts(mine);
}

/// mean −= T pattern.
void Polish::subtract(std::span<TreePhotograph> photographs, double most) const {
  if (!dealt()) return parts_[0].subtract_from(photographs);
  const ExactSums exact(most);
  const std::size_t samples = photographs[0].mean.size();
  light_.assign(photographs.size() * samples, 0.0);
  means_.resize(photographs.size());
  for (const KnownTransport& part : parts_) {
    for (PagedVector<float>& mean : means_) mean.assign(samples, 0.0F);
    swap_means(photographs, means_);
    part.subtract_from(photographs);
    swap_means(photographs, means_);
    for (std::size_t k = 0; k < means_.size(); ++k)
      add_rounded(exact, means_[k], light_.data() + k * samples);
  }
  team_.add_up({light_.data(), light_.size()});
  tbb::parallel_for(std::size_t{0}, photographs.size(), [&](std::size_t k) {
    for (std::size_t at = 0; at < samples; ++at)
      photographs[k].mean[at] += static_cast<float>(light_[k * samples + at]);
  });
}

/// W J direction for each batch.
Polish::Samples Polish::image(std::span<const PolishBatch> batches, const Tangents& direction,
                              double most) const {
  if (!dealt()) return jacobians_[0].image(batches, direction[0]);
  const ExactSums exact(most);
  const std::size_t samples = batches[0].weight.size();
  light_.assign(batches.size() * samples, 0.0);
  Samples images;
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    jacobians_[part].respond(batches, direction[part], images);
    for (std::size_t k = 0; k < images.size(); ++k)
      add_rounded(exact, images[k], light_.data() + k * samples);
  }
  team_.add_up({light_.data(), light_.size()});
  for (std::size_t k = 0; k < images.size(); ++k)
    in_blocks(samples, [&](std::size_t begin, std::size_t end) {
      for (std::size_t at = begin; at < end; ++at)
        images[k][at] = static_cast<float>(light_[k * samples + at]);
    });
  acquisition::weigh(batches, images);
  return images;
}

Result<void> Polish::curved(const Numbers& direction, Numbers& sum) const {
  SYMRIG_CHECK(team_.all({}));
  sum = zeros();
  const double most = this->most(&direction);
  Tangents tangents;
  for (std::size_t part = 0; part < parts_.size(); ++part)
    tangents.push_back(jacobians_[part].tangents(direction[part]));
  const auto add = [&](std::span<const PolishBatch> batches) {
    const Samples images = image(batches, tangents, most);
    for (std::size_t part = 0; part < parts_.size(); ++part)
      jacobians_[part].gather(batches, images, sum[part]);
  };
  for (std::size_t first = 0; first < kept_.size(); first += kGroup)
    add(std::span(kept_).subspan(first, std::min(kGroup, kept_.size() - first)));
  if (!kept_.empty()) return {};
  return visit([&](std::span<TreePhotograph> photographs) {
    weigh_all(photographs);
    std::vector<PolishBatch> batches;
    for (const auto& batch : batches_of(photographs)) batches.emplace_back(batch);
    add(batches);
  });
}

/// (Jᵀ W J + damping) move = residual, approximately.
Result<Polish::Numbers> Polish::solve(Numbers residual, const Numbers& diagonal, int steps) const {
  Numbers move = zeros();
  Numbers direction = zeros();
  precondition(residual, diagonal, direction);
  Numbers along;  // then z, the preconditioned residual
  double rho = inner(residual, direction);
  for (int k = 0; k < steps && rho > 0; ++k) {
    SYMRIG_CHECK(curved(direction, along));
    for (std::size_t part = 0; part < along.size(); ++part)
      in_blocks(along[part].size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n)
          along[part][n] += kDamping * diagonal[part][n] * direction[part][n];
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
  for (std::size_t part = 0; part < move.size(); ++part) shorten_part(parts_[part], move[part]);
}

void Polish::shorten_part(const KnownTransport& known, PolishNumbers& move) const {
  const float* const value = known.factors().data();
  for (const KnownLeaf& leaf : known.leaves()) {
    if (!polished(leaf)) continue;
    for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels_); ++channel) {
      const LeafNumbers at = numbers_of(leaf, channel);
      const auto share = static_cast<float>(std::min(within_reach(value + at.a, &move[at.a], at.rows),
                                                     within_reach(value + at.b, &move[at.b], at.cols)));
      for (std::size_t n = at.a; n < at.b + at.cols; ++n) move[n] *= share;
    }
  }
}

Polish::Numbers Polish::zeros() const {
  Numbers all;
  for (const KnownTransport& part : parts_)
    all.emplace_back(part.factors().size() + part.scalar_values().size());
  return all;
}

/// Halves the move until φ falls; if it does not, nothing moves.
Result<Polish::Outcome> Polish::move_along(const Numbers& move, double before) {
  Numbers start;
  for (const KnownTransport& part : parts_) start.push_back(numbers_of(part));
  const auto set = [&](float share) {
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      const std::span<float> factors = parts_[part].change_factors();
      const std::span<float> scalars = parts_[part].change_scalar_values();
      for (std::size_t n = 0; n < start[part].size(); ++n)
        (n < factors.size() ? factors[n] : scalars[n - factors.size()]) =
            start[part][n] + share * move[part][n];
    }
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

// One step of Gauss-Newton with Levenberg's damping for φ = Σ w (y − T p)² (polish.hpp):
//
//   (Jᵀ W J + λ D) move = Jᵀ W residual,    D = diagonal of Jᵀ W J,  λ = kDamping
//
// J: derivative of the photographs by all factors and scalars. A leaf a b' and its mirror give δ(T p) =
// δa (b' p) + a (δb' p) + δb (a' p) + b (δa' p). J is never formed: `respond` gives J x, `gather` Jᵀ x.
// 1. All photographs: what is left of them, their weights, φ, the right side and D. They stay in memory
//    if they fit (kept_); otherwise each later pass reads them again.
// 2. `steps` conjugate-gradient steps with D as preconditioner. Each passes through the photographs once
//    (curved): J direction, times W, back through Jᵀ.
// 3. No leaf's factors move by more than half their length (shorten), because the model leaves
//    out δa δb'.
// 4. φ at the new place. While it is above the old one, half of the move; after kHalvings nothing moves.
// Several processes (PolishTeam) share steps 1 and 2 by their sums, so all come to the same decisions.
Result<Polish::Outcome> Polish::step(int steps) {
  Numbers residual = zeros();
  Numbers diagonal = zeros();
  const bool keep = keeps();
  kept_.clear();
  SYMRIG_TRY(const double before, visit_residuals([&](std::span<TreePhotograph> photographs) {
               std::vector<PolishBatch> batches;
               Samples samples;
               for (const auto& batch : batches_of(photographs)) {
                 batches.emplace_back(batch);
                 samples.push_back(means_of(batch));
               }
               acquisition::weigh(batches, samples);
               for (std::size_t part = 0; part < parts_.size(); ++part) {
                 jacobians_[part].gather(batches, samples, residual[part]);
                 jacobians_[part].add_diagonal(batches, diagonal[part]);
               }
               if (keep) std::move(batches.begin(), batches.end(), std::back_inserter(kept_));
             }));
  SYMRIG_TRY(Numbers move, solve(std::move(residual), diagonal, steps));
  shorten(move);
  kept_.clear();
  return move_along(move, before);
}

}  // namespace symrig::acquisition
