// SPDX-License-Identifier: Apache-2.0
#include "calibration/light_model.hpp"

#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// Direct light above this many sigmas of its noise is kept. A shadow sees only near and far light.
constexpr double kDirectSigmas = 3;
/// A size of near light is kept if it lowers χ² by more than this. Then it predicts other photographs better
/// than without it [Akaike74].
constexpr double kNearGain = 2;

float shown(const GrayCode& code, int index, int position) {
  if (index >= code.white()) return index == code.white() ? 1.0F : 0.0F;
  const bool complement = index % 2 != 0;
  return code.lit(index / 2, position) != complement ? 1.0F : 0.0F;
}

}  // namespace

Footprint footprint(const PixelMap& map, std::size_t pixel, double sigma) {
  return {gaussian_taps(static_cast<double>(map.col.values()[pixel]), sigma, map.projector.cols),
          gaussian_taps(static_cast<double>(map.row.values()[pixel]), sigma, map.projector.rows)};
}

LightModel::LightModel(const CodePhotographs& photographs, const DecodeOptions& options,
                       std::span<const Surroundings> surroundings)
    : surroundings_(surroundings), model_error_(options.policy.model_error) {
  for (int i = 0; i < photographs.code.photographs(); ++i)
    if (i >= photographs.code.white() || i / 2 != options.held_out_pair)
      seen_.push_back(observe(photographs, i));
}

LightModel::Observation LightModel::observe(const CodePhotographs& photographs, int index) const {
  const GrayCode& code = photographs.code;
  Observation o;
  o.pixels = photographs.images[index].values().data();
  if (index < code.white()) o.axis = code.pair(index / 2).axis;
  const bool columns = o.axis == StripeAxis::columns;
  const int size = columns ? code.projector().cols : code.projector().rows;
  o.stripes.reserve(size);
  for (int x = 0; x < size; ++x) o.stripes.push_back(shown(code, index, x));
  for (std::size_t z = 0; z < kNearSizes; ++z)
    o.blocks[z] = columns ? surroundings_[z].column_means(o.stripes) : surroundings_[z].row_means(o.stripes);
  o.mean = std::accumulate(o.stripes.begin(), o.stripes.end(), 0.0) / size;
  return o;
}

PixelLight LightModel::fit(const PixelMap& map, std::size_t pixel, double sigma) const {
  const bool lit = map.mask.values()[pixel] != 0;
  const Footprint foot = lit ? footprint(map, pixel, sigma) : Footprint{};
  std::array<Footprint, kNearSizes> near{};
  for (std::size_t z = 0; lit && z < kNearSizes; ++z)
    near[z] = {surroundings_[z].column_taps(static_cast<double>(map.col.values()[pixel])),
               surroundings_[z].row_taps(static_cast<double>(map.row.values()[pixel]))};
  PixelLightFit fit;
  for (const Observation& o : seen_) {
    const bool columns = o.axis == StripeAxis::columns;
    PatternLight light{static_cast<double>((columns ? foot.col : foot.row).sum(o.stripes)), {}, o.mean};
    for (std::size_t z = 0; z < kNearSizes; ++z)
      light.near[z] = static_cast<double>((columns ? near[z].col : near[z].row).sum(o.blocks[z]));
    fit.add(light, static_cast<double>(o.pixels[pixel]));
  }
  // An edge is not known better than decoding knows it. That error must not count as near light.
  const double model = model_error_ * static_cast<double>(map.contrast.values()[pixel]) / std::numbers::sqrt2;
  return fit.solve(lit, kDirectSigmas * map.noise, std::sqrt(kNearGain) * std::hypot(map.noise, model));
}

std::vector<PixelLight> LightModel::fit_all(const PixelMap& map, double sigma) const {
  std::vector<PixelLight> light(map.mask.values().size());
  tbb::parallel_for(std::size_t{0}, light.size(),
                    [&](std::size_t pixel) { light[pixel] = fit(map, pixel, sigma); });
  return light;
}

double LightModel::squared_residual(const PixelMap& map, double sigma) const {
  const std::size_t pixels = map.mask.values().size();
  const std::size_t stride = std::max<std::size_t>(1, pixels / 3'000) | 1U;
  std::vector<double> squares((pixels + stride - 1) / stride, 0);
  tbb::parallel_for(std::size_t{0}, squares.size(), [&](std::size_t i) {
    if (map.mask.values()[i * stride]) squares[i] = fit(map, i * stride, sigma).squared_residual;
  });
  return std::accumulate(squares.begin(), squares.end(), 0.0);
}

/// Golden-section search: the residual decreases towards the best blur from both sides.
Blur LightModel::best_blur(const PixelMap& map) const {
  constexpr double kGolden = 0.6180339887498949;
  constexpr double kNarrowest = 0.1, kPrecision = 0.05;  // projector pixels
  double low = kNarrowest, high = kLargestSigma;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double at_a = squared_residual(map, a), at_b = squared_residual(map, b);
  while (high - low > kPrecision) {
    if (at_a < at_b) {
      high = std::exchange(b, a);
      at_b = at_a;
      a = high - kGolden * (high - low);
      at_a = squared_residual(map, a);
    } else {
      low = std::exchange(a, b);
      at_a = at_b;
      b = low + kGolden * (high - low);
      at_b = squared_residual(map, b);
    }
  }
  return {(low + high) / 2, std::min(at_a, at_b)};
}

}  // namespace symrig::calibration
