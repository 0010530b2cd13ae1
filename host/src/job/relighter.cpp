// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/relighter.hpp"

#include <cstdint>
#include <utility>

namespace symrig {
namespace {

Radiance without_noise(Image<float> mean) {
  const Grid grid = mean.grid();
  return {std::move(mean), Image<float>(grid), Image<std::uint8_t>(grid, 1, 1)};
}

Result<void> check_mosaic(const TransportOperator& tensor, const RelightOptions& options) {
  if (!options.mosaic) return {};
  if (tensor.channels() != 1)
    return Error{ErrorCode::bad_argument, "the scene already has colour channels, so it is no raw mosaic",
                 "leave out mosaic"};
  if (options.views.from || options.views.to)
    return Error{ErrorCode::bad_argument, "a raw mosaic cannot be relit from or to a single view",
                 "relight all views at once"};
  return {};
}

}  // namespace

Result<Relighter> Relighter::begin(TransportTensor tensor, const RelightOptions& options) {
  return begin(std::make_shared<const TransportTensor>(std::move(tensor)), options);
}

Result<Relighter> Relighter::begin(std::shared_ptr<const TransportOperator> tensor,
                                   const RelightOptions& options) {
  SYMRIG_CHECK(check_mosaic(*tensor, options));
  Relighter relighter;
  SYMRIG_TRY(relighter.light_grid_, symrig::light_grid(*tensor, options.views));
  SYMRIG_TRY(relighter.picture_grid_, symrig::picture_grid(*tensor, options.views));
  if (options.mosaic) {
    SYMRIG_TRY(Image<float> flood, tensor->apply(Image<float>(tensor->projector_grid(), 1, 1.F)));
    relighter.flood_mosaic_ = without_noise(std::move(flood));
  }
  relighter.tensor_ = std::move(tensor);
  relighter.options_ = options;
  return relighter;
}

Result<Image<float>> Relighter::in_colour(Image<float> photograph) const {
  if (!flood_mosaic_) return photograph;
  SYMRIG_TRY(Radiance colour,
             colour_by_flood(without_noise(std::move(photograph)), *flood_mosaic_, *options_.mosaic));
  return std::move(colour.mean);
}

Result<Image<float>> Relighter::relight(const Image<float>& light) const {
  SYMRIG_TRY(Image<float> photograph, symrig::relight(*tensor_, light, options_.views));
  return in_colour(std::move(photograph));
}

Result<std::vector<Image<float>>> Relighter::relight_batch(std::span<const Image<float>> lights) const {
  SYMRIG_TRY(std::vector<Image<float>> photographs, symrig::relight_batch(*tensor_, lights, options_.views));
  for (Image<float>& photograph : photographs) {
    SYMRIG_TRY(photograph, in_colour(std::move(photograph)));
  }
  return photographs;
}

Result<Image<float>> Relighter::flood_lit() const {
  return relight(Image<float>(light_grid_, 1, 1.F));
}

}  // namespace symrig
