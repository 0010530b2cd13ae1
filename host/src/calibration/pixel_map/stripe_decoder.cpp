// SPDX-License-Identifier: Apache-2.0
#include "calibration/pixel_map/stripe_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

namespace symrig::calibration {
namespace {

/// The first guess of a footprint: sharp, with a third of its light spread wide.
constexpr Shape kGuess{0, 0.5F, 0.15F, 0, 0.1F, 0.1F, 0.1F};
/// If a tile's shape explains a pixel worse than this, the pixel gets its own shape, in this many rounds. The
/// value is χ² / degrees of freedom; 1 in 50 exceeds it by chance, at ten bits.
constexpr double kOwnMisfit = 2.3;
constexpr int kOwnRounds = 3;

/// Calls use(pixel) for every stride-th pixel of a tile where the mask is set.
template <class Use>
void for_tile(const Image<std::uint8_t>& mask, int tile_row, int tile_col, int stride, Use use) {
  constexpr int kTile = StripeDecoder::kTile;
  const Grid grid = mask.grid();
  for (int row = tile_row * kTile; row < std::min((tile_row + 1) * kTile, grid.rows); row += stride)
    for (int col = tile_col * kTile; col < std::min((tile_col + 1) * kTile, grid.cols); col += stride)
      if (mask.at(row, col))
        use(static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.cols) +
            static_cast<std::size_t>(col));
}

}  // namespace

StripeDecoder::StripeDecoder(const CodePhotographs& photographs, StripeAxis axis,
                             const DecodeOptions& options, const NoiseLine& noise,
                             const Image<std::uint8_t>& lit)
    : options_(options),
      noise_(noise),
      lit_(lit),
      light_(photographs.code, axis),
      white_(photographs.white().values().data()),
      black_(photographs.black().values().data()) {
  const int first = axis == StripeAxis::columns ? 0 : photographs.code.column_bits();
  for (int bit = 0; bit < light_.bits(); ++bit)
    pairs_[bit] = {photographs.image(2 * (first + bit)).values().data(),
                   photographs.image(2 * (first + bit) + 1).values().data()};
  if (options.held_out_pair) {
    const int bit = *options.held_out_pair - first;
    if (bit >= 0 && bit < light_.bits()) left_out_ = bit;
  }
  usual_ = kGuess;
  for (int round = 0; round < 3; ++round) usual_ = fit_usual_shape(usual_);
}

Differences StripeDecoder::differences(std::size_t pixel) const {
  Differences seen;
  for (int bit = 0; bit < light_.bits(); ++bit) {
    const auto [pattern, complement] = pairs_[bit];
    if (bit != left_out_) seen.value[bit] = pattern[pixel] - complement[pixel];
  }
  const auto white = static_cast<double>(white_[pixel]), black = static_cast<double>(black_[pixel]);
  seen.variance = static_cast<float>(noise_.difference_variance((white + black) / 2) +
                                     std::pow(options_.policy.model_error * (white - black), 2));
  return seen;
}

float StripeDecoder::fine_energy(std::size_t pixel) const {
  double sum = 0;
  int bits = 0;
  for (int bit = light_.bits() - 1; bit >= 0 && bits < 2; --bit) {
    if (bit == left_out_) continue;
    const auto [pattern, complement] = pairs_[bit];
    const auto d = static_cast<double>(pattern[pixel] - complement[pixel]);
    sum += d * d;
    ++bits;
  }
  const double level = static_cast<double>(white_[pixel] + black_[pixel]) / 2;
  return static_cast<float>(sum / noise_.difference_variance(level));
}

ShapeFit StripeDecoder::fit_tile(ShapedLight& light, int tile_row, int tile_col) const {
  ShapeFit fit;
  for_tile(lit_, tile_row, tile_col, 2, [&](std::size_t pixel) {
    const Differences seen = differences(pixel);
    // Both values of a left-out bit fit equally well, and give the same shape.
    if (const auto found = find_position(light, seen, 0); found && found->chi2 < found->rival)
      fit.add(light_, left_out_, static_cast<double>(found->position), seen, contrast(pixel));
  });
  return fit;
}

Shape StripeDecoder::fit_usual_shape(const Shape& guess) const {
  const Grid grid = lit_.grid();
  const int rows = (grid.rows + kTile - 1) / kTile, cols = (grid.cols + kTile - 1) / kTile;
  const ShapeFit fit = tbb::parallel_deterministic_reduce(
      tbb::blocked_range<int>(0, rows, 8), ShapeFit{},
      [&](const tbb::blocked_range<int>& range, ShapeFit sum) {
        ShapedLight light(light_, left_out_);
        light.set_shape(guess);
        for (int row = range.begin(); row != range.end(); ++row)
          for (int col = row % 4; col < cols; col += 4) sum += fit_tile(light, row, col);
        return sum;
      },
      [](ShapeFit a, const ShapeFit& b) { return a += b; });
  return fit.solve(guess, 0.01 * fit.pixels() * fit.information());
}

StripeDecoder::Tiles StripeDecoder::fit_tiles() const {
  const Grid grid = lit_.grid();
  Tiles tiles{(grid.rows + kTile - 1) / kTile, (grid.cols + kTile - 1) / kTile, {}};
  const auto count = static_cast<std::size_t>(tiles.rows) * static_cast<std::size_t>(tiles.cols);
  tiles.shape.resize(count);
  tbb::parallel_for(tbb::blocked_range<int>(0, tiles.rows), [&](const tbb::blocked_range<int>& range) {
    ShapedLight light(light_, left_out_);
    light.set_shape(usual_);
    for (int row = range.begin(); row != range.end(); ++row)
      for (int col = 0; col < tiles.cols; ++col) {
        const ShapeFit tile = fit_tile(light, row, col);
        tiles.at(row, col) = tile.solve(usual_, options_.policy.tile_weight * tile.information());
      }
  });
  return tiles;
}

/// Positions are found with the left-out bit 0. If the bit is 1, the position is the mirror image inside the
/// block.
float StripeDecoder::reflected(float position) const {
  const auto block = static_cast<float>(1 << (light_.bits() - *left_out_));
  const float begin = block * std::floor((position + 0.5F) / block);
  return 2 * begin + block - 1 - position;
}

/// Tries both values of a left-out bit. The photographs distinguish them only near the border of the block.
std::optional<StripeSighting> StripeDecoder::sight(const Differences& seen, ShapedLight& light) const {
  const auto found = find_position(light, seen, evidence());
  if (!left_out_) return found;
  const auto other = find_position(light, seen, evidence(), true);
  return other && (!found || other->chi2 < found->chi2) ? other : found;
}

void StripeDecoder::decode_pixel(std::size_t pixel, const Shape& shape, ShapedLight& light, ShapedLight& own,
                                 AxisSightings& out) const {
  const Differences seen = differences(pixel);
  auto found = sight(seen, light);

  // A pixel that the tile's shape does not explain gets its own shape.
  ShapedLight* used = &light;
  for (int round = 0;
       round < kOwnRounds && found && static_cast<double>(found->chi2) > kOwnMisfit * freedom(); ++round) {
    ShapeFit fit;
    fit.add(light_, left_out_, static_cast<double>(found->position), seen, contrast(pixel));
    own.set_shape(fit.solve(shape, 1 / std::pow(options_.policy.shape_spread, 2)));
    found = find_position(own, seen, evidence(), found->bit_value);
    used = &own;
  }
  if (!found) return;

  out.position.values()[pixel] = found->bit_value ? reflected(found->position) : found->position;
  const float misfit = found->chi2 / freedom();
  // A position that does not fit well is less certain than its noise says [Birge32].
  out.sigma.values()[pixel] = deviation(*used, seen, found->index) * std::sqrt(std::max(misfit, 1.0F));
  out.misfit.values()[pixel] = misfit;
  out.clear.values()[pixel] = found->rival - found->chi2 > evidence() ? 1 : 0;
}

AxisSightings StripeDecoder::decode(const Image<std::uint8_t>& wanted) const {
  const Grid grid = lit_.grid();
  Tiles tiles = fit_tiles();
  AxisSightings out{Image<float>(grid), Image<float>(grid, 1, std::numeric_limits<float>::infinity()),
                    Image<float>(grid), Image<std::uint8_t>(grid)};
  tbb::parallel_for(tbb::blocked_range<int>(0, tiles.rows), [&](const tbb::blocked_range<int>& range) {
    ShapedLight light(light_, left_out_), own(light_, left_out_);
    for (int row = range.begin(); row != range.end(); ++row)
      for (int col = 0; col < tiles.cols; ++col) {
        const Shape& shape = tiles.at(row, col);
        light.set_shape(shape);
        for_tile(wanted, row, col, 1,
                 [&](std::size_t pixel) { decode_pixel(pixel, shape, light, own, out); });
      }
  });
  return out;
}

}  // namespace symrig::calibration
