// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/pixel_map.hpp"

#include "calibration/raw_map.hpp"
#include "calibration/sequence_check.hpp"
#include "calibration/stripe_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

namespace symrig {
namespace {

using calibration::AxisSightings;
using calibration::NoiseLine;
using calibration::RawMap;
using calibration::StripeDecoder;

std::int64_t count(const Image<std::uint8_t>& mask) {
  return std::ranges::count(mask.values(), std::uint8_t{1});
}

/// Contrast, noise and the lit mask.
struct LightMask {
  Image<float> contrast;
  NoiseLine noise;
  Image<std::uint8_t> lit;
};

Result<LightMask> find_light(const CodePhotographs& photographs, const DecodeOptions& options) {
  LightMask light{Image<float>(photographs.camera()),
                  calibration::estimate_noise(photographs, options.held_out_pair),
                  Image<std::uint8_t>(photographs.camera())};
  const auto white = photographs.white().values(), black = photographs.black().values();
  for (std::size_t i = 0; i < white.size(); ++i) {
    light.contrast.values()[i] = white[i] - black[i];
    const double level = static_cast<double>(white[i] + black[i]) / 2;
    const double noise = std::sqrt(2 * light.noise.variance(std::max(level, 0.0)));
    const bool lit = static_cast<double>(light.contrast.values()[i]) > options.policy.contrast_sigmas * noise;
    light.lit.values()[i] = lit ? 1 : 0;
  }
  if (count(light.lit) > 0) return light;
  return Error{
      ErrorCode::bad_value,
      fmt::format("no pixel is brighter in white than in black by {:.3g} (the noise is {:.3g})",
                  options.policy.contrast_sigmas * std::numbers::sqrt2 * light.noise.rms, light.noise.rms),
      "use a longer exposure, or darken the room"};
}

/// Sums over the 5 × 5 pixels around each pixel of a row.
class WindowSums {
 public:
  /// energy: 0 where not lit.
  WindowSums(const Image<float>& energy, const Image<std::uint8_t>& lit, int row)
      : columns_(static_cast<std::size_t>(lit.grid().cols) + 2 * std::size_t{kReach}) {
    const Grid grid = lit.grid();
    for (int r = std::max(row - kReach, 0); r <= std::min(row + kReach, grid.rows - 1); ++r)
      for (int col = 0; col < grid.cols; ++col) {
        columns_[col + kReach].energy += static_cast<double>(energy.at(r, col));
        columns_[col + kReach].pixels += lit.at(r, col);
      }
  }

  struct Sums {
    double energy = 0, pixels = 0;
  };
  Sums around(int col) const {
    Sums sums;
    for (int k = col; k <= col + 2 * kReach; ++k)
      sums.energy += columns_[k].energy, sums.pixels += columns_[k].pixels;
    return sums;
  }

 private:
  static constexpr int kReach = 2;
  std::vector<Sums> columns_;
};

/// Whether the finest stripes are visible: the mean square of their differences over the 5 × 5 pixels around,
/// against noise alone. Without direct light (a shadow that other surfaces light) they are not, even if the
/// coarse stripes seem to give a position.
Image<std::uint8_t> find_direct_light(const StripeDecoder& columns, const StripeDecoder& rows,
                                      const LightMask& light, double sigmas) {
  const Image<std::uint8_t>& lit = light.lit;
  const Grid grid = lit.grid();
  Image<float> energy(grid);
  tbb::parallel_for(std::size_t{0}, energy.values().size(), [&](std::size_t i) {
    if (lit.values()[i]) energy.values()[i] = columns.fine_energy(i) + rows.fine_energy(i);
  });
  constexpr double kSquares = 4;  // of each pixel, with mean 1
  const double spread = light.noise.squares_deviation(kSquares);
  Image<std::uint8_t> direct(grid);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    const WindowSums sums(energy, lit, row);
    for (int col = 0; col < grid.cols; ++col) {
      if (!lit.at(row, col)) continue;
      const auto [sum, pixels] = sums.around(col);
      const double squares = kSquares * pixels;
      direct.at(row, col) = sum > squares + sigmas * spread * std::sqrt(pixels) ? 1 : 0;
    }
  });
  return direct;
}

/// Removes pixels from the mask whose position along an axis is not certain.
void keep_trusted(Image<std::uint8_t>& mask, const AxisSightings& axis, const DecodePolicy& policy) {
  const double largest_misfit = policy.largest_misfit * policy.largest_misfit;
  for (std::size_t i = 0; i < mask.values().size(); ++i)
    if (!axis.clear.values()[i] || axis.sigma.values()[i] > policy.largest_sigma ||
        axis.misfit.values()[i] > largest_misfit)
      mask.values()[i] = 0;
}

/// Whether positions of an axis mostly decrease where they should increase: columns to the right, rows
/// downwards.
bool runs_backwards(const RawMap& raw, StripeAxis axis) {
  constexpr int kApart = 8, kStride = 5;
  const auto& position = raw.position[calibration::axis_index(axis)];
  const int down = axis == StripeAxis::rows ? kApart : 0, right = kApart - down;
  std::int64_t rising = 0, falling = 0;
  for (int row = 0; row + down < raw.grid().rows; row += kStride)
    for (int col = 0; col + right < raw.grid().cols; col += kStride) {
      if (!raw.mask.at(row, col) || !raw.mask.at(row + down, col + right)) continue;
      const float step = position.at(row + down, col + right) - position.at(row, col);
      rising += step > 0 ? 1 : 0;
      falling += step < 0 ? 1 : 0;
    }
  return falling > rising;
}

/// The pair that mirrors a whole axis if it is swapped: "00.png and 01.png (columns, 512 px)".
std::string coarsest_pair(const CodePhotographs& photographs, StripeAxis axis) {
  const int pair = axis == StripeAxis::columns ? 0 : photographs.code.column_bits();
  const std::size_t at = 2 * static_cast<std::size_t>(pair);
  return fmt::format("{} and {} ({})", photographs.names[at], photographs.names[at + 1],
                     photographs.code.pair(pair).name);
}

/// The error for a map that runs backwards. If both axes run backwards, the camera is upside down and
/// orientation is kept. Then, as with a camera on its side, either pair may be swapped.
Error backwards(const CodePhotographs& photographs, const RawMap& raw, double share) {
  const bool columns = runs_backwards(raw, StripeAxis::columns), rows = runs_backwards(raw, StripeAxis::rows);
  const std::string column_pair = coarsest_pair(photographs, StripeAxis::columns),
                    row_pair = coarsest_pair(photographs, StripeAxis::rows);
  const std::string pairs = columns == rows ? column_pair + ", or " + row_pair
                            : columns       ? column_pair
                                            : row_pair;
  return {ErrorCode::bad_value,
          fmt::format("the decoded map runs backwards over {:.0f} % of its pixels: {} are swapped, or the "
                      "projection is mirrored",
                      100 * share, pairs),
          "exchange the two files"};
}

Result<void> check_orientation(const CodePhotographs& photographs, const RawMap& raw, double orientation) {
  if (count(raw.mask) == 0)
    return Error{ErrorCode::bad_value, "no pixel could be decoded: the stripes do not match the sequence",
                 "check the order: column pairs (most significant bit first), row pairs, white, black"};
  const double share = calibration::oriented_share(raw, orientation);
  if (share > 0.5) return {};
  return backwards(photographs, raw, 1 - share);
}

/// A position has a column and a row.
Result<void> check_axes(const GrayCode& code) {
  for (const StripeAxis axis : {StripeAxis::columns, StripeAxis::rows}) {
    if (code.bits(axis) > 0) continue;
    const char* const missing = axis == StripeAxis::columns ? "columns" : "rows";
    return Error{
        ErrorCode::bad_value,
        fmt::format("the sequence of a projector of {} has no pairs of {}, so no position is known",
                    to_string(code.projector()), missing),
        fmt::format("photograph the pairs of {} too, and give the size of the whole projector", missing)};
  }
  return {};
}

/// Removes positions outside the projector from the mask.
void keep_inside(RawMap& raw, Grid projector) {
  for (int row = 0; row < raw.grid().rows; ++row)
    for (int col = 0; col < raw.grid().cols; ++col)
      if (raw.position[0].at(row, col) > static_cast<float>(projector.cols - 1) ||
          raw.position[1].at(row, col) > static_cast<float>(projector.rows - 1))
        raw.mask.at(row, col) = 0;
}

}  // namespace

double PixelMap::decoded_share() const {
  return mask.empty() ? 0 : static_cast<double>(count(mask)) / static_cast<double>(mask.grid().size());
}

Result<PixelMap> decode(const CodePhotographs& photographs, const DecodeOptions& options) {
  SYMRIG_CHECK(check_gray_code(photographs));
  const GrayCode& code = photographs.code;
  SYMRIG_CHECK(check_axes(code));
  if (options.held_out_pair && (*options.held_out_pair < 0 || *options.held_out_pair >= code.pairs()))
    return Error{ErrorCode::bad_argument, fmt::format("held-out pair {} does not exist; pairs are 0 to {}",
                                                      *options.held_out_pair, code.pairs() - 1)};
  if (options.check_sequence) SYMRIG_CHECK(calibration::check_sequence(photographs, options.held_out_pair));
  SYMRIG_TRY(auto light, find_light(photographs, options));
  PixelMap map;
  map.camera = photographs.camera();
  map.projector = code.projector();
  map.noise = light.noise.rms;
  const StripeDecoder columns(photographs, StripeAxis::columns, options, light.noise, light.lit);
  const StripeDecoder rows(photographs, StripeAxis::rows, options, light.noise, light.lit);
  // A pixel must pass each test. So the later ones see only what the earlier ones left.
  auto mask = find_direct_light(columns, rows, light, options.policy.direct_sigmas);
  AxisSightings x = columns.decode(mask);
  keep_trusted(mask, x, options.policy);
  AxisSightings y = rows.decode(mask);
  keep_trusted(mask, y, options.policy);
  RawMap raw{{std::move(x.position), std::move(y.position)}, std::move(mask)};
  const double orientation = options.mirrored ? -1 : 1;
  if (options.held_out_pair) {
    const StripePair pair = code.pair(*options.held_out_pair);
    calibration::unfold(raw, pair.axis, 1 << (code.bits(pair.axis) - pair.bit), orientation);
    keep_inside(raw, code.projector());
  }
  if (options.neighbours) calibration::drop_unsupported(raw, options.policy);
  if (options.check_sequence) SYMRIG_CHECK(check_orientation(photographs, raw, orientation));
  if (options.smooth) calibration::refine(raw, light.lit);
  map.contrast = std::move(light.contrast);
  map.col = std::move(raw.position[0]);
  map.row = std::move(raw.position[1]);
  map.col_sigma = std::move(x.sigma);
  map.row_sigma = std::move(y.sigma);
  map.mask = std::move(raw.mask);
  return map;
}

Result<PixelMap> decode_gray_code(const std::filesystem::path& folder, const ReadCodeOptions& reading,
                                  const DecodeOptions& decoding) {
  SYMRIG_TRY(const auto photographs, read_gray_code_folder(folder, reading));
  return decode(photographs, decoding);
}

}  // namespace symrig
