// SPDX-License-Identifier: Apache-2.0
// Applies a finished tensor with all threads. Every sum has one owner and one order, so the result has the
// same bits for any number of threads.
#pragma once

#include "tensor/panel_kernels.hpp"
#include "tensor/scratch.hpp"
#include "tensor/store.hpp"

#include <algorithm>
#include <cstdint>

#include <tbb/parallel_for.h>

namespace symrig::tensor {

/// Width patterns (1 or kBatch), interleaved pixel by pixel, and their photographs.
template <std::size_t Width>
class Application {
 public:
  Application(const TransportTensor& shape, const Store& store, bool transposed)
      : shape_(shape),
        store_(store),
        transposed_(transposed),
        lit_(store.low_rank.lit(transposed)),
        seen_(store.low_rank.seen(transposed)),
        p_(pixels(lit_) * Width),
        sums_(lit_.slots() * Width * static_cast<std::size_t>(shape.channels())),
        mates_(seen_.slots() * Width) {}

  /// load(begin, end, to): light of the pixels [begin, end), tree order.
  template <class Load>
  void light(const Load& load) {
    tbb::parallel_for(std::size_t{0}, lit_.chunks().size(), [&](std::size_t k) {
      const Chunk& chunk = lit_.chunks()[k];
      load(chunk.begin, chunk.end, light_on(chunk));
      for (int channel = 0; channel < shape_.channels(); ++channel) take_dots(channel, chunk);
    });
    if (!store_.bands.empty()) light_raster();
  }

  /// keep(begin, end, from): what the pixels [begin, end) see, tree order.
  template <class Keep>
  void see(int channel, const Keep& keep) {
    if (!store_.bands.empty()) apply_bands(channel);
    if (!store_.columns.rows.empty()) apply_columns(channel);
    lit_.template add_parts<Width>(sums(channel));
    store_.low_rank.exchange<Width>(channel, sums(channel), mates_.data());
    tbb::parallel_for(std::size_t{0}, seen_.chunks().size(), [&](std::size_t k) {
      const Chunk& chunk = seen_.chunks()[k];
      const Scratch y(values(chunk));
      start(channel, chunk, y.data());
      add_panels(channel, chunk, y.data());
      keep(chunk.begin, chunk.end, y.data());
    });
  }

 private:
  static std::size_t pixels(const Panels& side) {
    return side.chunks().empty() ? 0 : static_cast<std::size_t>(side.chunks().back().end);
  }
  static std::size_t values(const Chunk& chunk) {
    return static_cast<std::size_t>(chunk.end - chunk.begin) * Width;
  }
  float* light_on(const Chunk& chunk) const {
    return p_.data() + static_cast<std::size_t>(chunk.begin) * Width;
  }
  float* sums(int channel) const {
    return sums_.data() + static_cast<std::size_t>(channel) * lit_.slots() * Width;
  }

  void take_dots(int channel, const Chunk& chunk) {
    const float* const p = light_on(chunk);
    const Scratch dots(chunk.pieces * Width);
    if (std::any_of(p, p + values(chunk), [](float v) { return v != 0.0F; })) {
      panel_dots<Width>(
          {lit_.panels(chunk), store_.low_rank.lit_stream(channel, transposed_), chunk.first_value}, p,
          dots.data());
    } else {
      std::fill_n(dots.data(), dots.size(), 0.0F);
    }
    lit_.template keep_dots<Width>(chunk, dots.data(), sums(channel));
  }

  void add_panels(int channel, const Chunk& chunk, float* y) const {
    const Scratch weights(chunk.pieces * Width);
    seen_.template fetch_weights<Width>(chunk, mates_.data(), weights.data());
    panel_add<Width>(
        {seen_.panels(chunk), store_.low_rank.seen_stream(channel, transposed_), chunk.first_value},
        weights.data(), y);
  }

  /// y = everything but the low-rank leaves.
  void start(int channel, const Chunk& chunk, float* y) const {
    if (store_.columns.rows.empty()) {
      std::fill_n(y, values(chunk), 0.0F);
    } else {
      std::copy_n(column_y_.data() + static_cast<std::size_t>(chunk.begin) * Width, values(chunk), y);
    }
    if (!store_.diagonal.empty()) add_diagonal(channel, chunk, y);
    if (!store_.bands.empty()) add_band(chunk, y);
    const std::size_t side = transposed_ && !shape_.symmetric() ? 1 : 0;
    store_.entries[side].apply<Width>(channel, chunk.begin, chunk.end, p_.data(), y);
  }

  void add_diagonal(int channel, const Chunk& chunk, float* y) const {
    const float* const d = store_.diagonal.values(channel).data() + chunk.begin;
    const float* const p = light_on(chunk);
    const std::size_t n = chunk.end - chunk.begin;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t lane = 0; lane < Width; ++lane) y[i * Width + lane] += d[i] * p[i * Width + lane];
  }

  /// Measured columns write to all pixels, so one thread applies them before the others start.
  void apply_columns(int channel) {
    column_y_ = Scratch(pixels(seen_) * Width);
    std::fill_n(column_y_.data(), column_y_.size(), 0.0F);
    store_.columns.apply<Width>(shape_.channels(), channel, transposed_, p_.data(), column_y_.data());
  }

  /// The light in raster order: bands need neighbours in the picture.
  void light_raster() {
    const auto order = shape_.camera_tree().order();
    p_raster_ = Scratch(p_.size());
    band_y_ = Scratch(p_.size());
    for (std::size_t i = 0; i < order.size(); ++i)
      std::copy_n(p_.data() + i * Width, Width,
                  p_raster_.data() + static_cast<std::size_t>(order[i]) * Width);
  }

  void apply_bands(int channel) {
    const Grid grid = shape_.camera_grid();
    const std::size_t row_size = static_cast<std::size_t>(grid.cols) * Width;
    tbb::parallel_for(0, grid.rows, [&](int row) {
      std::fill_n(band_y_.data() + static_cast<std::size_t>(row) * row_size, row_size, 0.0F);
      for (const Band& band : store_.bands)
        band.apply_row<Width>(channel, row, p_raster_.data(), band_y_.data());
    });
  }

  void add_band(const Chunk& chunk, float* y) const {
    const auto order = shape_.camera_tree().order();
    for (std::int32_t i = chunk.begin; i < chunk.end; ++i)
      for (std::size_t lane = 0; lane < Width; ++lane, ++y)
        *y += band_y_.data()[static_cast<std::size_t>(order[i]) * Width + lane];
  }

  const TransportTensor& shape_;
  const Store& store_;
  bool transposed_;
  const Panels& lit_;
  const Panels& seen_;
  Scratch p_;                  // [pixel][Width], tree order
  Scratch sums_;               // [channel][column][Width]: dots
  Scratch mates_;              // [column][Width]: the weight of each column
  Scratch p_raster_, band_y_;  // [pixel][Width], raster order
  Scratch column_y_;           // [pixel][Width], tree order
};

}  // namespace symrig::tensor
