// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/polish_jacobian.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

using tensor::kBatch;
using Sixteen = std::array<float, kBatch>;  ///< one value for each photograph of a batch

/// Σ x w over the photographs of a batch, in four sums that fit one vector.
float sum_of(const float* x, const Sixteen& w) {
  std::array<float, 4> sums{};
  for (std::size_t c = 0; c < kBatch; c += 4)
    for (std::size_t l = 0; l < 4; ++l) sums[l] += x[c + l] * w[c + l];
  return (sums[0] + sums[2]) + (sums[1] + sums[3]);
}

/// Σ_i v[i] x[i][c]
Sixteen light(const float* v, const float* x, std::size_t n) {
  Sixteen w;
  tensor::dot_batch(v, x, n, w.data());
  return w;
}

PagedVector<float> interleave(std::span<const TreePhotograph> photographs,
                              PagedVector<float> TreePhotograph::*part) {
  const std::size_t size = (photographs[0].*part).size();
  PagedVector<float> all(size * kBatch);
  constexpr std::size_t kTile = 1024;  // pixels of sixteen photographs that stay in the cache
  for (std::size_t first = 0; first < size; first += kTile)
    for (std::size_t k = 0; k < photographs.size(); ++k) {
      const float* const from = (photographs[k].*part).data();
      for (std::size_t t = first; t < std::min(size, first + kTile); ++t) all[t * kBatch + k] = from[t];
    }
  return all;
}

std::vector<float> any_of(std::span<const TreePhotograph> photographs) {
  std::vector<float> any(photographs[0].pattern.size());
  for (const TreePhotograph& photograph : photographs)
    for (std::size_t t = 0; t < any.size(); ++t) any[t] += photograph.pattern[t] != 0 ? 1.0F : 0.0F;
  return any;
}

/// What a diagonal entry of the other factor weighs in each photograph: (light)² + random part.
Sixteen leverage(const float* v, const float* pattern, std::size_t n) {
  Sixteen w = light(v, pattern, n);
  Sixteen lit{};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t c = 0; c < kBatch; ++c) lit[c] += pattern[i * kBatch + c];
  const float each = tensor::dot(v, v, n) / static_cast<float>(n);
  for (std::size_t c = 0; c < kBatch; ++c) w[c] = w[c] * w[c] + each * lit[c];
  return w;
}

/// Terms of the sums for one factor, added up together.
class TermSums {
 public:
  TermSums(float* to, std::size_t n) : to_(to), n_(n) {}
  void add(const float* samples, const Sixteen& weight) {
    terms_[count_++] = {samples, weight};
    if (count_ == terms_.size()) finish();
  }
  void finish() {
    if (count_ > 0) collapse(std::span(terms_).first(count_), to_, n_);
    count_ = 0;
  }

 private:
  float* to_;
  std::size_t n_;
  std::size_t count_ = 0;
  std::array<PhotographTerm, 8> terms_;
};

struct LitSides {
  bool rows, cols;
  LitSides(const PolishBatch& batch, const KnownLeaf& leaf)
      : rows(batch.lit.any(leaf.row_begin, leaf.row_end)),
        cols(batch.lit.any(leaf.col_begin, leaf.col_end)) {}
};

}  // namespace

LeafNumbers numbers_of(const KnownLeaf& leaf, std::size_t channel) {
  const std::size_t rows = leaf.rows();
  const std::size_t cols = leaf.cols();
  const std::size_t a = static_cast<std::size_t>(leaf.factors) + channel * (rows + cols);
  return {a,
          a + rows,
          rows,
          cols,
          static_cast<std::size_t>(leaf.row_begin),
          static_cast<std::size_t>(leaf.col_begin)};
}

PolishBatch::PolishBatch(std::span<const TreePhotograph> photographs)
    : pattern(interleave(photographs, &TreePhotograph::pattern)),
      weight(interleave(photographs, &TreePhotograph::variance)),
      lit(any_of(photographs)) {}

PolishSamples means_of(std::span<const TreePhotograph> photographs) {
  return interleave(photographs, &TreePhotograph::mean);
}

void weigh(std::span<const PolishBatch> batches, std::span<PolishSamples> samples) {
  tbb::parallel_for(std::size_t{0}, batches.size(), [&](std::size_t k) {
    const float* const weight = batches[k].weight.data();
    for (std::size_t s = 0; s < samples[k].size(); ++s) samples[k][s] *= weight[s];
  });
}

PolishJacobian::PolishJacobian(const KnownTransport& known, int channels, Work work)
    : known_(known), channels_(static_cast<std::size_t>(channels)), work_(std::move(work)) {}

/// use_leaf(leaf, its numbers, channel) for every polished leaf, use_scalar(number, scalar, channel) for
/// every scalar, from many threads. operations: of a number, for Work.
template <class UseLeaf, class UseScalar>
void PolishJacobian::for_each_number(std::int64_t operations, const UseLeaf& use_leaf,
                                     const UseScalar& use_scalar) const {
  const auto leaves = known_.leaves();
  const auto scalars = known_.scalars();
  const std::size_t first_scalar = known_.factors().size();
  const auto channels = static_cast<std::int64_t>(channels_);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size()), [&](const auto& range) {
    Tally tally(work_);
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      tally.add(operations * channels * (leaves[n].rows() + leaves[n].cols()));
      if (!polished(leaves[n])) continue;
      for (std::size_t channel = 0; channel < channels_; ++channel)
        use_leaf(leaves[n], numbers_of(leaves[n], channel), channel);
    }
  });
  tbb::parallel_for(std::size_t{0}, scalars.size(), [&](std::size_t k) {
    for (std::size_t channel = 0; channel < channels_; ++channel)
      use_scalar(first_scalar + k * channels_ + channel, scalars[k], channel);
  });
  work_.add(operations * channels * std::ssize(scalars));
}

PolishJacobian::Tangents PolishJacobian::tangents(const PolishNumbers& direction) const {
  Tangents all(known_.factors().size() + direction.size());
  const float* const value = known_.factors().data();
  for_each_number(
      1,
      [&](const KnownLeaf&, const LeafNumbers& at, std::size_t) {
        float* to = all.data() + 2 * at.a;
        to = std::copy_n(value + at.a, at.rows, to);
        to = std::copy_n(direction.data() + at.a, at.rows + at.cols, to);
        std::copy_n(value + at.b, at.cols, to);
      },
      [&](std::size_t at, const ScalarLeaf&, std::size_t) {
        all[known_.factors().size() + at] = direction[at];
      });
  return all;
}

void PolishJacobian::image_of(const PolishBatch& batch, std::size_t channel, const Tangents& direction,
                              float* y) const {
  const float* const p = batch.pattern.data();
  Tally tally(work_);
  for (const KnownLeaf& leaf : known_.leaves()) {
    tally.add(kImageOperations * (leaf.rows() + leaf.cols()));
    if (!polished(leaf)) continue;
    const LitSides lit(batch, leaf);
    if (!lit.rows && !lit.cols) continue;
    const LeafNumbers at = numbers_of(leaf, channel);
    const float* const a = direction.data() + 2 * at.a;
    const float* const b = a + 2 * at.rows;
    if (lit.cols)
      tensor::add_leaf_batch({a, b, at.row_begin, at.rows, at.col_begin, at.cols, 2}, lit.rows, p, y);
    else
      tensor::add_leaf_batch({b, a, at.col_begin, at.cols, at.row_begin, at.rows, 2}, false, p, y);
  }
  const auto scalars = known_.scalars();
  const float* const moves = direction.data() + 2 * known_.factors().size();
  for (std::size_t k = 0; k < scalars.size(); ++k) {
    const float move = moves[k * channels_ + channel];
    const auto row = static_cast<std::size_t>(scalars[k].row) * kBatch;
    const auto col = static_cast<std::size_t>(scalars[k].col) * kBatch;
    for (std::size_t c = 0; c < kBatch; ++c) y[row + c] += move * p[col + c];
    if (row != col)
      for (std::size_t c = 0; c < kBatch; ++c) y[col + c] += move * p[row + c];
  }
  tally.add(kImageOperations * std::ssize(scalars));
}

void PolishJacobian::respond(std::span<const PolishBatch> batches, const Tangents& direction,
                             std::vector<PolishSamples>& images) const {
  images.resize(batches.size());
  for (std::size_t k = 0; k < batches.size(); ++k) images[k].assign(batches[k].weight.size(), 0.0F);
  tbb::parallel_for(std::size_t{0}, batches.size() * channels_, [&](std::size_t task) {
    const std::size_t k = task / channels_;
    const std::size_t channel = task % channels_;
    image_of(batches[k], channel, direction, images[k].data() + channel * batches[k].pattern.size());
  });
}

std::vector<PolishSamples> PolishJacobian::image(std::span<const PolishBatch> batches,
                                                 const Tangents& direction) const {
  std::vector<PolishSamples> images;
  respond(batches, direction, images);
  weigh(batches, images);
  return images;
}

void PolishJacobian::gather(std::span<const PolishBatch> batches, std::span<const PolishSamples> samples,
                            PolishNumbers& gradient) const {
  const float* const value = known_.factors().data();
  const auto of_leaf = [&](const KnownLeaf& leaf, const LeafNumbers& at, std::size_t channel) {
    TermSums of_a(&gradient[at.a], at.rows);
    TermSums of_b(&gradient[at.b], at.cols);
    for (std::size_t k = 0; k < batches.size(); ++k) {
      const LitSides lit(batches[k], leaf);
      const float* const p = batches[k].pattern.data();
      const float* const e = samples[k].data() + channel * batches[k].pattern.size();
      const float* const e_row = e + at.row_begin * kBatch;
      const float* const e_col = e + at.col_begin * kBatch;
      const float* const p_row = p + at.row_begin * kBatch;
      const float* const p_col = p + at.col_begin * kBatch;
      if (lit.cols) {
        of_a.add(e_row, light(value + at.b, p_col, at.cols));
        of_b.add(p_col, light(value + at.a, e_row, at.rows));
      }
      if (lit.rows) {
        of_b.add(e_col, light(value + at.a, p_row, at.rows));
        of_a.add(p_row, light(value + at.b, e_col, at.cols));
      }
    }
    of_a.finish();
    of_b.finish();
  };
  const auto dot = [](const float* x, const float* y) {
    Sixteen w;
    std::copy_n(y, kBatch, w.begin());
    return sum_of(x, w);
  };
  const std::int64_t operations = kGatherOperations * std::ssize(batches);
  for_each_number(operations, of_leaf, [&](std::size_t at, const ScalarLeaf& scalar, std::size_t channel) {
    const auto row = static_cast<std::size_t>(scalar.row) * kBatch;
    const auto col = static_cast<std::size_t>(scalar.col) * kBatch;
    for (std::size_t k = 0; k < batches.size(); ++k) {
      const float* const p = batches[k].pattern.data();
      const float* const e = samples[k].data() + channel * batches[k].pattern.size();
      gradient[at] += dot(p + col, e + row);
      if (row != col) gradient[at] += dot(p + row, e + col);
    }
  });
}

void PolishJacobian::add_diagonal(std::span<const PolishBatch> batches, PolishNumbers& diagonal) const {
  const float* const value = known_.factors().data();
  const auto of_leaf = [&](const KnownLeaf& leaf, const LeafNumbers& at, std::size_t channel) {
    TermSums of_a(&diagonal[at.a], at.rows);
    TermSums of_b(&diagonal[at.b], at.cols);
    for (const PolishBatch& batch : batches) {
      const LitSides lit(batch, leaf);
      const float* const p = batch.pattern.data();
      const float* const w = batch.weight.data() + channel * batch.pattern.size();
      if (lit.cols)
        of_a.add(w + at.row_begin * kBatch, leverage(value + at.b, p + at.col_begin * kBatch, at.cols));
      if (lit.rows)
        of_b.add(w + at.col_begin * kBatch, leverage(value + at.a, p + at.row_begin * kBatch, at.rows));
    }
    of_a.finish();
    of_b.finish();
  };
  const auto squares = [](const float* p, const float* w) {
    Sixteen squared;
    for (std::size_t c = 0; c < kBatch; ++c) squared[c] = p[c] * p[c];
    return sum_of(w, squared);
  };
  const std::int64_t operations = kDiagonalOperations * std::ssize(batches);
  for_each_number(operations, of_leaf, [&](std::size_t at, const ScalarLeaf& scalar, std::size_t channel) {
    const auto row = static_cast<std::size_t>(scalar.row) * kBatch;
    const auto col = static_cast<std::size_t>(scalar.col) * kBatch;
    for (const PolishBatch& batch : batches) {
      const float* const p = batch.pattern.data();
      const float* const w = batch.weight.data() + channel * batch.pattern.size();
      diagonal[at] += squares(p + col, w + row);
      if (row != col) diagonal[at] += squares(p + row, w + col);
    }
  });
}

namespace {

double sum_of_magnitudes(const float* values, std::size_t n) {
  double sum = 0;
  for (std::size_t k = 0; k < n; ++k) sum += std::abs(static_cast<double>(values[k]));
  return sum;
}

/// Σ over leaves of what each may add to a pixel, in one channel.
class Most {
 public:
  explicit Most(std::size_t pixels) : pixels_(pixels) {}

  /// The leaf a b' and its mirror image.
  void add(const LeafNumbers& at, const float* a, const float* b, bool mirrored) {
    add_side(at.row_begin, a, at.rows, sum_of_magnitudes(b, at.cols));
    if (mirrored) add_side(at.col_begin, b, at.cols, sum_of_magnitudes(a, at.rows));
  }
  void add(const ScalarLeaf& scalar, float value) {
    const double magnitude = std::abs(static_cast<double>(value));
    pixels_[static_cast<std::size_t>(scalar.row)] += magnitude;
    if (scalar.row != scalar.col) pixels_[static_cast<std::size_t>(scalar.col)] += magnitude;
  }
  double largest() const { return *std::max_element(pixels_.begin(), pixels_.end()); }

 private:
  void add_side(std::size_t begin, const float* values, std::size_t n, double light) {
    for (std::size_t k = 0; k < n; ++k)
      pixels_[begin + k] += std::abs(static_cast<double>(values[k])) * light;
  }

  std::vector<double> pixels_;
};

/// add_leaf(most, leaf, its numbers) for the leaves, scalar_values: [scalar][channel].
template <class AddLeaf>
double most_of(const KnownTransport& known, int channels, std::size_t pixels, const AddLeaf& add_leaf,
               const float* scalar_values) {
  double largest = 0;
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels); ++channel) {
    Most most(pixels);
    for (const KnownLeaf& leaf : known.leaves())
      if (!leaf.removed) add_leaf(most, leaf, numbers_of(leaf, channel));
    const auto scalars = known.scalars();
    for (std::size_t k = 0; k < scalars.size(); ++k)
      most.add(scalars[k], scalar_values[k * static_cast<std::size_t>(channels) + channel]);
    largest = std::max(largest, most.largest());
  }
  return largest;
}

}  // namespace

double most_light(const KnownTransport& known, int channels, std::size_t pixels) {
  const float* const value = known.factors().data();
  return most_of(
      known, channels, pixels,
      [&](Most& most, const KnownLeaf& leaf, const LeafNumbers& at) {
        most.add(at, value + at.a, value + at.b, !leaf.diagonal());
      },
      known.scalar_values().data());
}

double most_change(const KnownTransport& known, int channels, std::size_t pixels,
                   const PolishNumbers& direction) {
  const float* const value = known.factors().data();
  return most_of(
      known, channels, pixels,
      [&](Most& most, const KnownLeaf& leaf, const LeafNumbers& at) {
        if (!polished(leaf)) return;
        most.add(at, value + at.a, direction.data() + at.b, true);
        most.add(at, direction.data() + at.a, value + at.b, true);
      },
      direction.data() + known.factors().size());
}

}  // namespace symrig::acquisition
