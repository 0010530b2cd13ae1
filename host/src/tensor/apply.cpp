// SPDX-License-Identifier: Apache-2.0
#include "tensor/apply.hpp"

#include <array>
#include <cassert>
#include <cstddef>
#include <string>

#include <tbb/parallel_for.h>

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
