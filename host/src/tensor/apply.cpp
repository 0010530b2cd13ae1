// SPDX-License-Identifier: Apache-2.0
// Applies a finished tensor with all threads. Every sum has one owner and one order, so the result has the
// same bits for any number of threads.
#include "symrig/base/result.hpp"
#include "symrig/tensor/internal/kernels.hpp"
#include "tensor/panel_kernels.hpp"
#include "tensor/store.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <tbb/parallel_for.h>

namespace symrig::tensor {
namespace {

/// One part of the low-rank leaves, applied to Width patterns: dots of its columns, an exchange, and the sum
/// of the weighted columns.
template <std::size_t Width>
class PartApplication {
 public:
  PartApplication(const LowRank& part, int channels, bool transposed)
      : part_(part),
        transposed_(transposed),
        lit_(part.lit(transposed)),
        seen_(part.seen(transposed)),
        sums_(lit_.slots() * Width * static_cast<std::size_t>(channels)),
        mates_(seen_.slots() * Width) {}

  /// p: light of the pixels of chunk k.
  void take_dots(int channel, std::size_t k, const float* p) {
    const Chunk& chunk = lit_.chunks()[k];
    if (chunk.pieces == 0) return;
    const Scratch dots(chunk.pieces * Width);
    const std::size_t values = static_cast<std::size_t>(chunk.end - chunk.begin) * Width;
    if (std::any_of(p, p + values, [](float v) { return v != 0.0F; })) {
      panel_dots<Width>({lit_.panels(chunk), part_.lit_stream(channel, transposed_), chunk.first_value}, p,
                        dots.data());
    } else {
      std::fill_n(dots.data(), dots.size(), 0.0F);
    }
    lit_.template keep_dots<Width>(chunk, dots.data(), sums(channel));
  }

  /// Between the dots of a channel and its sums.
  void exchange(int channel) {
    lit_.template add_parts<Width>(sums(channel));
    part_.template exchange<Width>(channel, sums(channel), mates_.data());
  }

  /// y: what the pixels of chunk k see.
  void add(int channel, std::size_t k, float* y) const {
    const Chunk& chunk = seen_.chunks()[k];
    if (chunk.pieces == 0) return;
    const Scratch weights(chunk.pieces * Width);
    seen_.template fetch_weights<Width>(chunk, mates_.data(), weights.data());
    panel_add<Width>({seen_.panels(chunk), part_.seen_stream(channel, transposed_), chunk.first_value},
                     weights.data(), y);
  }

 private:
  float* sums(int channel) const {
    return sums_.data() + static_cast<std::size_t>(channel) * lit_.slots() * Width;
  }

  const LowRank& part_;
  bool transposed_;
  const Panels& lit_;
  const Panels& seen_;
  Scratch sums_;   // [channel][column][Width]: dots
  Scratch mates_;  // [column][Width]: the weight of each column
};

/// Width patterns (1 or kBatch), interleaved pixel by pixel, and their photographs.
///
/// A tensor in memory with one part goes through its pixels twice: light() and see(). Otherwise light() goes
/// through all parts one after the other, and keeps the photographs.
template <std::size_t Width>
class Application {
 public:
  Application(const TransportTensor& shape, const Store& store, bool transposed)
      : shape_(shape),
        store_(store),
        transposed_(transposed),
        lit_(pixels(transposed ? shape.camera_grid() : shape.projector_grid())),
        seen_(pixels(transposed ? shape.projector_grid() : shape.camera_grid())),
        p_(lit_ * Width) {
    if (const LowRank* const only = store.parts.only()) only_.emplace(*only, shape.channels(), transposed);
  }

  /// load(begin, end, to): light of the pixels [begin, end), tree order.
  /// fails: as LeafParts::visit.
  template <class Load>
  Result<void> light(const Load& load) {
    for_chunks(lit_, [&](std::size_t k, std::int32_t begin, std::int32_t end) {
      load(begin, end, light_at(begin));
      for (int channel = 0; only_ && channel < shape_.channels(); ++channel)
        only_->take_dots(channel, k, light_at(begin));
    });
    if (!store_.bands.empty()) light_raster();
    if (only_ || store_.parts.size() == 0) return {};
    return visit_parts();
  }

  /// keep(begin, end, from): what the pixels [begin, end) see, tree order.
  template <class Keep>
  void see(int channel, const Keep& keep) {
    if (y_.size() > 0) {
      for_chunks(seen_, [&](std::size_t, std::int32_t begin, std::int32_t end) {
        keep(begin, end, seen_at(channel, begin));
      });
      return;
    }
    begin_channel(channel);
    if (only_) only_->exchange(channel);
    for_chunks(seen_, [&](std::size_t k, std::int32_t begin, std::int32_t end) {
      const Scratch y(values(begin, end));
      start(channel, begin, end, y.data());
      if (only_) only_->add(channel, k, y.data());
      keep(begin, end, y.data());
    });
  }

 private:
  static std::size_t pixels(Grid grid) { return static_cast<std::size_t>(grid.size()); }
  static std::size_t values(std::int32_t begin, std::int32_t end) {
    return static_cast<std::size_t>(end - begin) * Width;
  }
  float* light_at(std::int32_t pixel) const { return p_.data() + static_cast<std::size_t>(pixel) * Width; }
  float* seen_at(int channel, std::int32_t pixel) const {
    return y_.data() + (static_cast<std::size_t>(channel) * seen_ + static_cast<std::size_t>(pixel)) * Width;
  }

  /// Calls use(k, begin, end) for the chunks of so many pixels, from all threads.
  template <class Use>
  static void for_chunks(std::size_t count, const Use& use) {
    tbb::parallel_for(std::size_t{0}, chunk_count(static_cast<std::int64_t>(count)), [&](std::size_t k) {
      const auto begin = static_cast<std::int32_t>(k) * kChunkPixels;
      use(k, begin, static_cast<std::int32_t>(std::min<std::size_t>(count, (k + 1) * kChunkPixels)));
    });
  }

  Result<void> visit_parts() {
    y_ = Scratch(seen_ * Width * static_cast<std::size_t>(shape_.channels()));
    for (int channel = 0; channel < shape_.channels(); ++channel) {
      begin_channel(channel);
      for_chunks(seen_, [&](std::size_t, std::int32_t begin, std::int32_t end) {
        start(channel, begin, end, seen_at(channel, begin));
      });
    }
    return store_.parts.visit(store_.leaves, [&](const LowRank& part) { add_part(part); });
  }

  void add_part(const LowRank& part) {
    PartApplication<Width> one(part, shape_.channels(), transposed_);
    for (int channel = 0; channel < shape_.channels(); ++channel) {
      for_chunks(lit_, [&](std::size_t k, std::int32_t begin, std::int32_t) {
        one.take_dots(channel, k, light_at(begin));
      });
      one.exchange(channel);
      for_chunks(seen_, [&](std::size_t k, std::int32_t begin, std::int32_t) {
        one.add(channel, k, seen_at(channel, begin));
      });
    }
  }

  /// What start() needs of a channel.
  void begin_channel(int channel) {
    if (!store_.bands.empty()) apply_bands(channel);
    if (!store_.columns.rows.empty()) apply_columns(channel);
  }

  /// y = everything but the low-rank leaves.
  void start(int channel, std::int32_t begin, std::int32_t end, float* y) const {
    if (store_.columns.rows.empty()) {
      std::fill_n(y, values(begin, end), 0.0F);
    } else {
      std::copy_n(column_y_.data() + static_cast<std::size_t>(begin) * Width, values(begin, end), y);
    }
    if (!store_.diagonal.empty()) add_diagonal(channel, begin, end, y);
    if (!store_.bands.empty()) add_band(begin, end, y);
    const std::size_t side = transposed_ && !shape_.symmetric() ? 1 : 0;
    store_.entries[side].apply<Width>(channel, begin, end, p_.data(), y);
  }

  void add_diagonal(int channel, std::int32_t begin, std::int32_t end, float* y) const {
    const float* const d = store_.diagonal.values(channel).data() + begin;
    const float* const p = light_at(begin);
    const std::size_t n = end - begin;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t lane = 0; lane < Width; ++lane) y[i * Width + lane] += d[i] * p[i * Width + lane];
  }

  /// Measured columns write to all pixels, so one thread applies them before the others start.
  void apply_columns(int channel) {
    column_y_ = Scratch(seen_ * Width);
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

  void add_band(std::int32_t begin, std::int32_t end, float* y) const {
    const auto order = shape_.camera_tree().order();
    for (std::int32_t i = begin; i < end; ++i)
      for (std::size_t lane = 0; lane < Width; ++lane, ++y)
        *y += band_y_.data()[static_cast<std::size_t>(order[i]) * Width + lane];
  }

  const TransportTensor& shape_;
  const Store& store_;
  bool transposed_;
  std::size_t lit_, seen_;                      // pixels
  std::optional<PartApplication<Width>> only_;  // of a tensor in memory with one part
  Scratch p_;                                   // [pixel][Width], tree order
  Scratch y_;                                   // [channel][pixel][Width], if there are several parts
  Scratch p_raster_, band_y_;                   // [pixel][Width], raster order
  Scratch column_y_;                            // [pixel][Width], tree order
};

}  // namespace
}  // namespace symrig::tensor

namespace symrig {
namespace {

using tensor::kBatch;

/// The pixels of a picture of one channel.
using Light = std::span<const float>;

Result<void> check_light(const Image<float>& light, Grid expected) {
  if (light.grid() == expected && light.channels() == 1) return {};
  return Error{ErrorCode::size_mismatch,
               "light is " + to_string(light.grid()) + " with " + std::to_string(light.channels()) +
                   " channels, the tensor needs " + to_string(expected) + " with 1",
               "resize the picture to " + to_string(expected) + " (rows x columns)"};
}

/// Photographs of up to Width patterns. Lanes without a pattern read a dark picture and write to an unused
/// one, so that the loops over lanes have a fixed length.
template <std::size_t Width>
Result<void> photograph(const TransportTensor& tensor, const tensor::Store& store, bool transposed,
                        std::span<const Light> lights, std::span<Image<float>> out) {
  const std::int32_t* const from =
      (transposed ? tensor.camera_tree() : tensor.projector_tree()).order().data();
  const std::int32_t* const to = (transposed ? tensor.projector_tree() : tensor.camera_tree()).order().data();
  const std::vector<float> dark(out.size() < Width ? lights[0].size() : 0);
  Image<float> spare(out.size() < Width ? out[0].grid() : Grid{1, 1});
  std::array<const float*, Width> lit{};
  std::array<float*, Width> seen{};
  for (std::size_t lane = 0; lane < Width; ++lane)
    lit[lane] = lane < lights.size() ? lights[lane].data() : dark.data();
  tensor::Application<Width> application(tensor, store, transposed);
  SYMRIG_CHECK(application.light([&](std::int32_t begin, std::int32_t end, float* p) {
    for (std::int32_t i = begin; i < end; ++i, p += Width)
      for (std::size_t lane = 0; lane < Width; ++lane) p[lane] = lit[lane][from[i]];
  }));
  for (int channel = 0; channel < tensor.channels(); ++channel) {
    for (std::size_t lane = 0; lane < Width; ++lane)
      seen[lane] = lane < out.size() ? out[lane].plane(channel).data() : spare.plane(0).data();
    application.see(channel, [&](std::int32_t begin, std::int32_t end, const float* y) {
      for (std::int32_t i = begin; i < end; ++i, y += Width)
        for (std::size_t lane = 0; lane < Width; ++lane) seen[lane][to[i]] = y[lane];
    });
  }
  return {};
}

}  // namespace

Result<Image<float>> TransportTensor::apply_between(std::span<const float> light, const BlockTree& from,
                                                    const BlockTree& to, bool transposed) const {
  if (static_cast<std::int64_t>(light.size()) != from.grid().size())
    return Error{
        ErrorCode::size_mismatch,
        "light has " + std::to_string(light.size()) + " pixels, the tensor needs " + to_string(from.grid()),
        "give a picture of " + to_string(from.grid()) + " (rows x columns)"};
  Image<float> out(to.grid(), channels_);
  if (draft_) {
    std::vector<float> p(light.size()), y(static_cast<std::size_t>(to.grid().size()));
    from.to_tree(light, p);
    for (int channel = 0; channel < channels_; ++channel) {
      std::fill(y.begin(), y.end(), 0.0F);
      SYMRIG_CHECK(add_tree(p, y, channel, transposed));
      to.to_raster(y, out.plane(channel));
    }
  } else {
    SYMRIG_CHECK(photograph<1>(*this, store(), transposed, std::span(&light, 1), std::span(&out, 1)));
  }
  return out;
}

Result<Image<float>> TransportTensor::apply(const Image<float>& pattern) const {
  SYMRIG_CHECK(check_light(pattern, projector_grid()));
  return apply_between(pattern.plane(0), projector_tree(), camera_tree(), false);
}

Result<Image<float>> TransportTensor::apply_values(std::span<const float> pattern) const {
  return apply_between(pattern, projector_tree(), camera_tree(), false);
}

Result<Image<float>> TransportTensor::apply_transposed(const Image<float>& light) const {
  SYMRIG_CHECK(check_light(light, camera_grid()));
  return apply_between(light.plane(0), camera_tree(), projector_tree(), true);
}

Result<std::vector<Image<float>>> TransportTensor::apply_batch(std::span<const Image<float>> patterns) const {
  for (const Image<float>& pattern : patterns) SYMRIG_CHECK(check_light(pattern, projector_grid()));
  std::vector<Image<float>> out;
  if (draft_) {
    for (const Image<float>& pattern : patterns) {
      SYMRIG_TRY(Image<float> photograph, apply(pattern));
      out.push_back(std::move(photograph));
    }
    return out;
  }
  // The system clears new memory page by page, so all threads ask for it.
  out.resize(patterns.size());
  tbb::parallel_for(std::size_t{0}, patterns.size(),
                    [&](std::size_t k) { out[k] = Image<float>(camera_grid(), channels_); });
  std::vector<Light> lights;
  for (const Image<float>& pattern : patterns) lights.push_back(pattern.plane(0));
  for (std::size_t first = 0; first < patterns.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, patterns.size() - first);
    SYMRIG_CHECK(photograph<kBatch>(*this, store(), false,
                                    std::span<const Light>(lights).subspan(first, count),
                                    std::span(out).subspan(first, count)));
  }
  return out;
}

Result<void> TransportTensor::add_tree(std::span<const float> p, std::span<float> y, int channel,
                                       bool transposed) const {
  if (draft_) {
    draft_->apply(*this, channel, transposed, p, y);
    return {};
  }
  tensor::Application<1> application(*this, store(), transposed);
  SYMRIG_CHECK(application.light([&](std::int32_t begin, std::int32_t end, float* to) {
    std::copy(p.begin() + begin, p.begin() + end, to);
  }));
  application.see(channel, [&](std::int32_t begin, std::int32_t end, const float* from) {
    for (std::int32_t i = begin; i < end; ++i) y[i] += from[i - begin];
  });
  return {};
}

void TransportTensor::apply_tree(std::span<const float> p, std::span<float> y, int channel,
                                 bool transposed) const {
  assert(in_memory());
  static_cast<void>(add_tree(p, y, channel, transposed).ok());
}

}  // namespace symrig
