// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/hdr/mosaic.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/radiance.hpp"
#include "symrig/tensor/transport_operator.hpp"
#include "symrig/tensor/transport_tensor.hpp"
#include "symrig/tensor/view_relight.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace symrig {

/// What is asked of a scene.
struct RelightOptions {
  ViewRelight views = {};
  std::optional<BayerPattern> mosaic = {};  ///< the scene was measured as a raw mosaic: give colour pictures
};

/// Relights one scene, as a job asks for it.
class Relighter {
 public:
  /// So many lights are relit with one pass over T (TransportTensor::apply_batch).
  static constexpr std::size_t kBatch = 16;

  /// fails: as light_grid; bad_argument (a mosaic of a scene in colour, or of single views).
  static Result<Relighter> begin(std::shared_ptr<const TransportOperator> tensor,
                                 const RelightOptions& options);
  static Result<Relighter> begin(TransportTensor tensor, const RelightOptions& options);

  Grid light_grid() const { return light_grid_; }
  Grid picture_grid() const { return picture_grid_; }
  int picture_channels() const { return options_.mosaic ? 3 : tensor_->channels(); }

  /// photograph = T · light.  shapes, error, fails: as symrig::relight. With a mosaic it has 3 channels, as
  /// colour_by_flood makes them.
  Result<Image<float>> relight(const Image<float>& light) const;
  /// The same for many lights. The last bits may differ.
  Result<std::vector<Image<float>>> relight_batch(std::span<const Image<float>> lights) const;

  /// The scene under a light of 1 everywhere.
  Result<Image<float>> flood_lit() const;

 private:
  Relighter() = default;
  Result<Image<float>> in_colour(Image<float> photograph) const;

  std::shared_ptr<const TransportOperator> tensor_;
  RelightOptions options_;
  Grid light_grid_, picture_grid_;
  std::optional<Radiance> flood_mosaic_;  ///< with a mosaic only
};

}  // namespace symrig
