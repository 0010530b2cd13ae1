// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/known_transport.hpp"

#include "symrig/tensor/internal/kernels.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {

using tensor::kBatch;

std::int32_t KnownTransport::add_leaf(std::int32_t row_begin, std::int32_t row_end, std::int32_t col_begin,
                                      std::int32_t col_end, int level, std::span<const float> factors) {
  leaves_.push_back({row_begin, row_end, col_begin, col_end, level, 0, 0, false,
                     static_cast<std::int64_t>(factors_.size())});
  factors_.append(factors.begin(), factors.end());
  return static_cast<std::int32_t>(leaves_.size()) - 1;
}

LeafSides KnownTransport::sides(const KnownLeaf& leaf, int channel) const {
  const std::size_t rows = leaf.rows();
  const std::size_t cols = leaf.cols();
  const auto both = std::span(factors_).subspan(
      static_cast<std::size_t>(leaf.factors + channel * (std::int64_t{leaf.rows()} + leaf.cols())),
      rows + cols);
  return {both.first(rows), both.subspan(rows)};
}

void KnownTransport::add_empty(int level, std::int32_t row_block, std::int32_t col_block) {
  empties_.push_back({level, row_block, col_block});
}

void KnownTransport::add_scalar(std::int32_t row, std::int32_t col, std::span<const float> values,
                                float noise) {
  scalars_.push_back({row, col});
  scalar_noise_.push_back(noise);
  scalar_values_.append(values.begin(), values.end());
}

void KnownTransport::begin_band(int radius) {
  band_radius_ = radius;
  band_begin_ = scalars_.size();
}

void KnownTransport::rewind(const Mark& mark) {
  if (mark.scalars <= band_begin_) band_radius_ = 0;
  leaves_.resize(mark.leaves);
  factors_.resize(mark.factors);
  empties_.resize(mark.empties);
  scalars_.resize(mark.scalars);
  scalar_noise_.resize(mark.scalars);
  scalar_values_.resize(mark.scalars * static_cast<std::size_t>(channels_));
}

void KnownTransport::release() {
  leaves_ = {};
  factors_ = {};
  empties_ = {};
  scalars_ = {};
  scalar_noise_ = {};
  scalar_values_ = {};
  band_radius_ = 0;
  ++rewritten_;
}

namespace {

// Sixteen lanes of so many pixels are 32 MiB, which no cache holds. With half of the lanes empty, photographs
// one by one read and write less.
constexpr std::size_t kManyPixels = std::size_t{1} << 19;
constexpr std::size_t kFewPhotographs = tensor::kBatch / 2;

// Of a number of T, for Work: there and back, for one photograph and for sixteen; rounding it for the tensor.
constexpr std::int64_t kLightOperations = 2, kBatchOperations = kLightOperations * kBatch,
                       kDraftOperations = 16;

constexpr std::size_t kRun =
    256;  // pixels whose sixteen lanes stay in the first cache while they are sorted in or out

/// A pattern of any values, one a pixel.
struct DensePattern {
  const float* values;

  float operator[](std::int32_t t) const { return values[t]; }
  float sum(std::int32_t begin, std::span<const float> factors) const {
    return tensor::dot(factors.data(), values + begin, factors.size());
  }
};

/// Which photographs light a pixel; empty if a pixel is neither lit nor dark. In words of one size, so that
/// compilers make vectors of it.
std::vector<tensor::LitMask> masks_of(std::span<const TreePhotograph> batch, std::size_t pixels) {
  constexpr auto kLit = std::bit_cast<std::uint32_t>(1.0F);
  std::vector<tensor::LitMask> masks(pixels);
  std::uint32_t grey = 0;
  for (std::size_t begin = 0; begin < pixels; begin += kRun) {
    std::array<std::uint32_t, kRun> run{};
    const std::size_t count = std::min(kRun, pixels - begin);
    for (std::size_t k = 0; k < batch.size(); ++k) {
      const float* const pattern = batch[k].pattern.data() + begin;
      for (std::size_t t = 0; t < count; ++t) {
        const auto bits = std::bit_cast<std::uint32_t>(pattern[t]);
        const std::uint32_t lit = bits >> 29 & 1;  // set in 1.0, clear in 0.0
        grey |= bits ^ (kLit & (0 - lit));
        run[t] |= lit << k;
      }
    }
    for (std::size_t t = 0; t < count; ++t) masks[begin + t] = static_cast<tensor::LitMask>(run[t]);
  }
  if (grey != 0) masks.clear();
  return masks;
}

/// p[pixel][lane] = pattern of photograph `lane`; lanes without a photograph stay dark. any: lit in any of
/// them.
void interleave(std::span<const TreePhotograph> batch, float* p, std::vector<float>& any) {
  const std::array<float, kRun> dark{};
  for (std::size_t begin = 0; begin < any.size(); begin += kRun) {
    const std::size_t end = std::min(begin + kRun, any.size());
    tensor::LaneRows lanes{};
    for (std::size_t k = 0; k < kBatch; ++k) {
      lanes[k] = k < batch.size() ? batch[k].pattern.data() + begin : dark.data();
      for (std::size_t t = begin; t < end; ++t) any[t] += lanes[k][t - begin];
    }
    tensor::interleave(lanes, end - begin, p + begin * kBatch);
  }
}

/// y += value · pattern of one pixel.
void add_pixel(float value, const float* p, std::size_t pixel, float* y) {
  for (std::size_t c = 0; c < kBatch; ++c) y[c] += value * p[pixel * kBatch + c];
}
void add_pixel(float value, const tensor::LitMask* lit, std::size_t pixel, float* y) {
  for (unsigned left = lit[pixel]; left != 0; left &= left - 1)  // rarely more than one
    y[std::countr_zero(left)] += value;
}

/// mean −= y, lane by lane.
void subtract_lanes(const float* y, std::size_t pixels, std::size_t channel,
                    std::span<TreePhotograph> batch) {
  std::array<float, kRun * kBatch> run{};
  tensor::LaneRowsOut lanes{};
  for (std::size_t k = 0; k < kBatch; ++k) lanes[k] = run.data() + k * kRun;
  for (std::size_t begin = 0; begin < pixels; begin += kRun) {
    const std::size_t count = std::min(kRun, pixels - begin);
    tensor::deinterleave(y + begin * kBatch, count, lanes);
    for (std::size_t k = 0; k < batch.size(); ++k) {
      float* const mean = batch[k].mean.data() + channel * pixels + begin;
      for (std::size_t t = 0; t < count; ++t) mean[t] -= lanes[k][t];
    }
  }
}

}  // namespace

/// The leaves from `first` on whose factors fit into one window.
std::size_t KnownTransport::end_of_run(std::size_t first) const {
  constexpr std::int64_t kWindow = std::int64_t{1} << 20;  // numbers
  std::size_t last = first + 1;
  while (last < leaves_.size() && leaves_[last].factors - leaves_[first].factors < kWindow) ++last;
  return last;
}

template <class Run>
void KnownTransport::for_runs(std::size_t first, const Run& run) const {
  std::vector<float> buffer;
  for (std::size_t last = first; first < leaves_.size(); first = last) {
    last = end_of_run(first);
    const auto begin = static_cast<std::size_t>(leaves_[first].factors);
    const std::size_t end =
        last < leaves_.size() ? static_cast<std::size_t>(leaves_[last].factors) : factors_.size();
    run(LeafRun{first, last, begin, factors_.window(begin, end - begin, buffer).data()});
  }
}

template <class P>
void KnownTransport::add_light(const P* p, const tensor::LitRanges& lit, std::size_t channel,
                               const Mark& since, float* y) const {
  Tally tally(work_);
  for_runs(since.leaves, [&](const LeafRun& run) {
    for (const KnownLeaf& leaf : std::span(leaves_).subspan(run.first, run.last - run.first)) {
      tally.add(kBatchOperations * (leaf.rows() + leaf.cols()));
      if (leaf.removed) continue;
      const bool row_lit = !leaf.diagonal() && lit.any(leaf.row_begin, leaf.row_end);
      const bool col_lit = lit.any(leaf.col_begin, leaf.col_end);
      if (!row_lit && !col_lit) continue;
      const auto rows = static_cast<std::size_t>(leaf.rows());
      const auto cols = static_cast<std::size_t>(leaf.cols());
      const float* const a =
          run.factors + static_cast<std::size_t>(leaf.factors) - run.begin + channel * (rows + cols);
      const float* const b = a + rows;
      const std::size_t row = leaf.row_begin;
      const std::size_t col = leaf.col_begin;
      if (col_lit)
        tensor::add_leaf_batch({a, b, row, rows, col, cols, 1}, row_lit, p, y);
      else
        tensor::add_leaf_batch({b, a, col, cols, row, rows, 1}, false, p, y);
    }
  });
  for (std::size_t k = since.scalars; k < scalars_.size(); ++k) {
    const std::size_t row = scalars_[k].row;
    const std::size_t col = scalars_[k].col;
    const float value = scalar_values_[k * static_cast<std::size_t>(channels_) + channel];
    add_pixel(value, p, col, y + row * kBatch);
    if (row != col) add_pixel(value, p, row, y + col * kBatch);
  }
  tally.add(kBatchOperations * static_cast<std::int64_t>(scalars_.size() - since.scalars));
}

/// One channel of one photograph is one task, so its sums have one order.
template <class Task>
void KnownTransport::for_channels(std::span<const std::span<float>> means, const Task& task) const {
  const std::size_t channels = channels_, pixels = tree_.order().size();
  tbb::parallel_for(std::size_t{0}, means.size() * channels, [&](std::size_t k) {
    const std::size_t channel = k % channels;
    task(k / channels, channel, means[k / channels].data() + channel * pixels);
  });
}

template <class Pattern>
void KnownTransport::subtract_each(std::span<const Pattern> patterns, std::span<const std::span<float>> means,
                                   const Mark& since) const {
  for_runs(since.leaves, [&](const LeafRun& run) {
    for_channels(means, [&](std::size_t k, std::size_t channel, float* mean) {
      Tally tally(work_);
      for (const KnownLeaf& leaf : std::span(leaves_).subspan(run.first, run.last - run.first)) {
        tally.add(kLightOperations * (leaf.rows() + leaf.cols()));
        if (leaf.removed) continue;
        const std::size_t rows = leaf.rows(), cols = leaf.cols();
        const float* const a =
            run.factors + static_cast<std::size_t>(leaf.factors) - run.begin + channel * (rows + cols);
        const float* const b = a + rows;
        const float forward = patterns[k].sum(leaf.col_begin, {b, cols});
        if (forward != 0) tensor::add_scaled(-forward, a, mean + leaf.row_begin, rows);
        const float back = leaf.diagonal() ? 0 : patterns[k].sum(leaf.row_begin, {a, rows});
        if (back != 0) tensor::add_scaled(-back, b, mean + leaf.col_begin, cols);
      }
    });
  });
  for_channels(means, [&](std::size_t k, std::size_t channel, float* mean) {
    for (std::size_t n = since.scalars; n < scalars_.size(); ++n) {
      const auto [row, col] = scalars_[n];
      const float value = scalar_values_[n * static_cast<std::size_t>(channels_) + channel];
      mean[row] -= value * static_cast<float>(patterns[k][col]);
      if (row != col) mean[col] -= value * static_cast<float>(patterns[k][row]);
    }
    work_.add(kLightOperations * static_cast<std::int64_t>(scalars_.size() - since.scalars));
  });
}

void KnownTransport::subtract_lit(std::span<const LitBlocks> patterns,
                                  std::span<const std::span<float>> means) const {
  std::vector<LitPixels> lit;
  lit.reserve(patterns.size());
  for (const LitBlocks& blocks : patterns) lit.emplace_back(blocks, tree_.order().size());
  subtract_each(std::span<const LitPixels>(lit), means, {});
}

void KnownTransport::subtract_few(std::span<TreePhotograph> photographs, const Mark& since) const {
  std::vector<DensePattern> patterns;
  std::vector<std::span<float>> means;
  for (TreePhotograph& photograph : photographs) {
    patterns.push_back({photograph.pattern.data()});
    means.emplace_back(photograph.mean);
  }
  subtract_each(std::span<const DensePattern>(patterns), means, since);
}

void KnownTransport::subtract_from(std::span<TreePhotograph> photographs, const Mark& since) const {
  if (photographs.size() <= kFewPhotographs && tree_.order().size() >= kManyPixels)
    return subtract_few(photographs, since);
  const std::size_t batches = (photographs.size() + kBatch - 1) / kBatch;
  const std::size_t channels = channels_;
  tbb::parallel_for(std::size_t{0}, batches * channels, [&](std::size_t task) {
    const std::size_t first = task / channels * kBatch;
    subtract_batch(photographs.subspan(first, std::min(kBatch, photographs.size() - first)), task % channels,
                   since);
  });
}

void KnownTransport::subtract_batch(std::span<TreePhotograph> batch, std::size_t channel,
                                    const Mark& since) const {
  const std::size_t pixels = tree_.order().size();
  const tensor::Scratch y(pixels * kBatch);
  std::fill_n(y.data(), y.size(), 0.0F);
  if (const std::vector<tensor::LitMask> masks = masks_of(batch, pixels); !masks.empty()) {
    add_light(masks.data(), tensor::LitRanges(masks), channel, since, y.data());
  } else {
    const tensor::Scratch p(pixels * kBatch);
    std::vector<float> any(pixels);
    interleave(batch, p.data(), any);
    add_light(p.data(), tensor::LitRanges(any), channel, since, y.data());
  }
  subtract_lanes(y.data(), pixels, channel, batch);
  work_.add(kBatchOperations * static_cast<std::int64_t>(pixels));
}

void KnownTransport::add_band_to(TensorBuilder& builder) const {
  const Grid grid = tree_.grid();
  const std::size_t pixels = tree_.order().size();
  const auto offsets = band_offsets(band_radius_);
  const std::size_t channels = channels_;
  PagedVector<float> band(channels * offsets.size() * pixels);
  const auto offset_of = [&](std::int32_t from, std::int32_t to) {
    const BandOffset d{to / grid.cols - from / grid.cols, to % grid.cols - from % grid.cols};
    for (std::size_t k = 0; k < offsets.size(); ++k)
      if (offsets[k].dy == d.dy && offsets[k].dx == d.dx) return k;
    return offsets.size();
  };
  for (std::size_t n = band_begin_; n < scalars_.size(); ++n) {
    const auto values = std::span(scalar_values_).subspan(n * channels, channels);
    if (scalars_[n].row == scalars_[n].col) {
      builder.add_scalar(scalars_[n].row, scalars_[n].col, values);
      continue;
    }
    std::int32_t from = tree_.order()[scalars_[n].row];
    std::int32_t to = tree_.order()[scalars_[n].col];
    std::size_t k = offset_of(from, to);
    if (k == offsets.size()) {
      std::swap(from, to);
      k = offset_of(from, to);
    }
    for (std::size_t channel = 0; channel < channels; ++channel)
      band[(channel * offsets.size() + k) * pixels + static_cast<std::size_t>(from)] = values[channel];
  }
  builder.add_band(band_radius_, band);
}

void KnownTransport::add_leaves_to(TensorBuilder& builder) const {
  std::vector<float> factors;
  for (std::size_t first = 0, next = 0; first < leaves_.size(); first = next) {
    const KnownLeaf& leaf = leaves_[first];
    for (next = first + 1; next < leaves_.size() && leaves_[next].joined;) ++next;
    if (leaf.removed) continue;
    const auto rows = static_cast<std::int64_t>(leaf.rows());
    work_.add(kDraftOperations * static_cast<std::int64_t>(next - first) * channels_ * (rows + leaf.cols()));
    factors.clear();
    const auto append = [&](std::int64_t offset, std::int64_t size) {
      for (std::size_t n = first; n < next; ++n) {
        const float* const from = factors_.begin() + leaves_[n].factors + offset;
        factors.insert(factors.end(), from, from + size);
      }
    };
    for (int channel = 0; channel < channels_; ++channel) {
      append(channel * (rows + leaf.cols()), rows);
      append(channel * (rows + leaf.cols()) + rows, leaf.cols());
    }
    builder.add_leaf(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end,
                     static_cast<int>(next - first), leaf.level, factors);
  }
}

TensorBuilder KnownTransport::draft() const {
  TensorBuilder builder(tree_, channels_);
  builder.pack_leaves();
  add_leaves_to(builder);
  for (const Empty& empty : empties_) builder.add_empty(empty.level, empty.row_block, empty.col_block);
  const std::size_t plain = band_radius_ > 0 ? band_begin_ : scalars_.size();
  for (std::size_t k = 0; k < plain; ++k)
    builder.add_scalar(
        scalars_[k].row, scalars_[k].col,
        std::span(scalar_values_)
            .subspan(k * static_cast<std::size_t>(channels_), static_cast<std::size_t>(channels_)));
  if (band_radius_ > 0) add_band_to(builder);
  return builder;
}

}  // namespace symrig::acquisition
