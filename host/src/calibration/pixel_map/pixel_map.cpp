// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/pixel_map.hpp"

#include "calibration/pixel_map/raw_map.hpp"
#include "calibration/pixel_map/stripe_decoder.hpp"
#include "calibration/sequence/sequence_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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
  Image<float> sigma;  ///< of a photograph halfway from black to white
  NoiseLine noise;
  Image<std::uint8_t> lit;
};

Result<LightMask> find_light(const CodePhotographs& photographs, const DecodeOptions& options) {
  LightMask light{Image<float>(photographs.camera()), Image<float>(photographs.camera()),
                  calibration::estimate_noise(photographs, options.held_out_pair),
                  Image<std::uint8_t>(photographs.camera())};
  const auto white = photographs.white().values(), black = photographs.black().values();
  for (std::size_t i = 0; i < white.size(); ++i) {
    light.contrast.values()[i] = white[i] - black[i];
    const double level = static_cast<double>(white[i] + black[i]) / 2;
    light.sigma.values()[i] = static_cast<float>(std::sqrt(light.noise.variance(std::max(level, 0.0))));
    const double noise = std::numbers::sqrt2 * static_cast<double>(light.sigma.values()[i]);
    const bool lit = static_cast<double>(light.contrast.values()[i]) > options.policy.contrast_sigmas * noise;
    light.lit.values()[i] = lit ? 1 : 0;
  }
  const auto lit = count(light.lit), pixels = light.lit.grid().size();
  // Some pixels are that bright by chance, and three times as many where noise is no Gaussian.
  const double chance = 3 * (1 + 0.5 * std::erfc(options.policy.contrast_sigmas / std::numbers::sqrt2) *
                                     static_cast<double>(pixels));
  if (static_cast<double>(lit) > std::min(chance, 0.5 * static_cast<double>(pixels))) return light;
  return Error{ErrorCode::bad_value,
               fmt::format("no pixel is brighter in white than in black by {:.3g}{} (the noise is {:.3g})",
                           options.policy.contrast_sigmas * std::numbers::sqrt2 * light.noise.rms,
                           lit == 0 ? "" : fmt::format(", but for {} by chance", lit), light.noise.rms),
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

/// The decoders of the axes whose stripes were photographed.
using Decoders = std::vector<StripeDecoder>;

/// Whether the finest stripes are visible: the mean square of their differences over the 5 × 5 pixels around,
/// against noise alone. Without direct light (a shadow that other surfaces light) they are not, even if the
/// coarse stripes seem to give a position.
Image<std::uint8_t> find_direct_light(const Decoders& decoders, const LightMask& light, double sigmas) {
  const Image<std::uint8_t>& lit = light.lit;
  const Grid grid = lit.grid();
  Image<float> energy(grid);
  tbb::parallel_for(std::size_t{0}, energy.values().size(), [&](std::size_t i) {
    if (!lit.values()[i]) return;
    for (const StripeDecoder& decoder : decoders) energy.values()[i] += decoder.fine_energy(i);
  });
  const double squares = 2 * static_cast<double>(decoders.size());  // of each pixel, with mean 1
  const double spread = light.noise.squares_deviation(squares);
  Image<std::uint8_t> direct(grid);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    const WindowSums sums(energy, lit, row);
    for (int col = 0; col < grid.cols; ++col) {
      if (!lit.at(row, col)) continue;
      const auto [sum, pixels] = sums.around(col);
      direct.at(row, col) = sum > squares * pixels + sigmas * spread * std::sqrt(pixels) ? 1 : 0;
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

/// Whether the columns of the projector run along those of the camera: rows and columns are exchanged, or the
/// camera lies on its side.
bool columns_run_downwards(const RawMap& raw) {
  constexpr int kApart = 8, kStride = 5;
  const auto& col = raw.position[calibration::axis_index(StripeAxis::columns)];
  double right = 0, down = 0;
  for (int r = 0; r + kApart < raw.grid().rows; r += kStride)
    for (int c = 0; c + kApart < raw.grid().cols; c += kStride) {
      if (!raw.mask.at(r, c) || !raw.mask.at(r, c + kApart) || !raw.mask.at(r + kApart, c)) continue;
      right += std::abs(static_cast<double>(col.at(r, c + kApart) - col.at(r, c)));
      down += std::abs(static_cast<double>(col.at(r + kApart, c) - col.at(r, c)));
    }
  return down > right;
}

/// The error for a map that runs backwards. If both axes run backwards, the camera is upside down and
/// orientation is kept. Then, as with a camera on its side, either pair may be swapped.
Error backwards(const CodePhotographs& photographs, const RawMap& raw, double share, bool mirrored) {
  const std::string seen =
      fmt::format("the decoded map runs backwards over {:.0f} % of its pixels", 100 * share);
  if (mirrored)
    return {ErrorCode::bad_value, seen + " against that of a mirror: the projection is not mirrored",
            "leave mirrored out"};
  const bool columns = runs_backwards(raw, StripeAxis::columns), rows = runs_backwards(raw, StripeAxis::rows);
  const std::string column_pair = coarsest_pair(photographs, StripeAxis::columns),
                    row_pair = coarsest_pair(photographs, StripeAxis::rows);
  const char* const rear = "for a rear projection or a mirror, give mirrored (--mirrored)";
  if (columns_run_downwards(raw))
    return {ErrorCode::bad_value,
            fmt::format(
                "{}, and the columns run downwards: the picture is transposed; or the rows come before the "
                "columns; or {}, or {} are swapped",
                seen, column_pair, row_pair),
            fmt::format("save the photographs as the camera takes them, columns first; {}", rear)};
  const std::string pairs = columns == rows ? column_pair + ", or " + row_pair
                            : columns       ? column_pair
                                            : row_pair;
  return {ErrorCode::bad_value, fmt::format("{}: {} are swapped, or the projection is mirrored", seen, pairs),
          fmt::format("exchange the two files; {}", rear)};
}

Result<void> check_orientation(const CodePhotographs& photographs, const RawMap& raw, double orientation) {
  if (count(raw.mask) == 0)
    return calibration::explain_contradiction(
        photographs,
        Error{ErrorCode::bad_value, "no pixel could be decoded: the stripes do not match the sequence",
              "check the order: column pairs (most significant bit first), row pairs, white, black"},
        false);
  const double share = calibration::oriented_share(raw, orientation);
  if (share > 0.5) return {};
  return backwards(photographs, raw, 1 - share, orientation < 0);
}

/// Without stripes there is no position.
Result<void> check_pairs(const GrayCode& code, const std::optional<int>& held_out) {
  if (code.pairs() == 0)
    return Error{ErrorCode::bad_value,
                 fmt::format("the sequence of a projector of {} has no pairs, so no position is known",
                             to_string(code.projector())),
                 "give the size of the whole projector"};
  if (!held_out) return {};
  if (*held_out < 0 || *held_out >= code.pairs())
    return Error{ErrorCode::bad_argument, fmt::format("held-out pair {} does not exist; pairs are 0 to {}",
                                                      *held_out, code.pairs() - 1)};
  if (code.axes() == CodeAxes::both) return {};
  return Error{ErrorCode::bad_argument, "a pair of a sequence of one axis cannot be held out",
               "photograph the pairs of the other axis too"};
}

/// White − black over the noise of a photograph.
Image<float> clarity_of(const LightMask& light) {
  Image<float> clarity(light.contrast.grid());
  for (std::size_t i = 0; i < clarity.values().size(); ++i)
    clarity.values()[i] = light.contrast.values()[i] / light.sigma.values()[i];
  return clarity;
}

/// Removes positions outside the projector from the mask.
void keep_inside(RawMap& raw, Grid projector) {
  for (int row = 0; row < raw.grid().rows; ++row)
    for (int col = 0; col < raw.grid().cols; ++col)
      if (raw.position[0].at(row, col) > static_cast<float>(projector.cols - 1) ||
          raw.position[1].at(row, col) > static_cast<float>(projector.rows - 1))
        raw.mask.at(row, col) = 0;
}

std::vector<StripeAxis> axes_of(const GrayCode& code) {
  std::vector<StripeAxis> axes;
  for (const StripeAxis axis : {StripeAxis::columns, StripeAxis::rows})
    if (code.bits(axis) > 0) axes.push_back(axis);
  return axes;
}

/// What neighbours tell: the derived bit of a held-out pair, wrong positions, the orientation of the map.
Result<void> compare_neighbours(const CodePhotographs& photographs, const DecodeOptions& options,
                                RawMap& raw) {
  const GrayCode& code = photographs.code;
  const double orientation = options.mirrored ? -1 : 1;
  if (options.held_out_pair) {
    const StripePair pair = code.pair(*options.held_out_pair);
    calibration::unfold(raw, pair.axis, 1 << (code.bits(pair.axis) - pair.bit), orientation);
    keep_inside(raw, code.projector());
  }
  if (options.neighbours) {
    calibration::drop_beyond_border(raw, code, options.policy.support_distance);
    calibration::drop_unsupported(raw, options.policy);
  }
  // One coordinate has no orientation.
  if (options.check_sequence && code.axes() == CodeAxes::both)
    return check_orientation(photographs, raw, orientation);
  return {};
}

PixelMap map_of(const CodePhotographs& photographs, LightMask light, RawMap raw,
                std::array<Image<float>, 2> sigma) {
  PixelMap map;
  map.camera = photographs.camera();
  map.projector = photographs.code.projector();
  map.axes = photographs.code.axes();
  map.noise = light.noise.rms;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (!sigma[axis].empty()) continue;
    // This axis is not known.
    sigma[axis] = Image<float>(map.camera, 1, std::numeric_limits<float>::infinity());
    for (std::size_t i = 0; i < raw.mask.values().size(); ++i)
      if (raw.mask.values()[i]) raw.position[axis].values()[i] = std::numeric_limits<float>::quiet_NaN();
  }
  map.contrast = std::move(light.contrast);
  map.col = std::move(raw.position[0]);
  map.row = std::move(raw.position[1]);
  map.col_sigma = std::move(sigma[0]);
  map.row_sigma = std::move(sigma[1]);
  map.mask = std::move(raw.mask);
  return map;
}

}  // namespace

double PixelMap::decoded_share() const {
  return mask.empty() ? 0 : static_cast<double>(count(mask)) / static_cast<double>(mask.grid().size());
}

Result<void> require_both_axes(const PixelMap& map, const char* what) {
  if (map.axes == CodeAxes::both) return {};
  const char* const missing = map.axes == CodeAxes::columns ? "rows" : "columns";
  return Error{ErrorCode::bad_value,
               fmt::format("the map has no {}, but {} needs both coordinates", missing, what),
               fmt::format("photograph the pairs of {} too", missing)};
}

Result<PixelMap> decode(const CodePhotographs& photographs, const DecodeOptions& options) {
  SYMRIG_CHECK(check_gray_code(photographs));
  const GrayCode& code = photographs.code;
  SYMRIG_CHECK(check_pairs(code, options.held_out_pair));
  if (options.check_sequence) SYMRIG_CHECK(calibration::check_sequence(photographs, options));
  SYMRIG_TRY(auto light, find_light(photographs, options));
  const std::vector<StripeAxis> axes = axes_of(code);
  Decoders decoders;
  for (const StripeAxis axis : axes)
    decoders.emplace_back(photographs, axis, options, light.noise, light.lit);
  RawMap raw{{Image<float>(photographs.camera()), Image<float>(photographs.camera())},
             find_direct_light(decoders, light, options.policy.direct_sigmas)};
  std::array<Image<float>, 2> sigma;
  // A pixel must pass each test. So the later ones see only what the earlier ones left.
  for (std::size_t k = 0; k < axes.size(); ++k) {
    AxisSightings seen = decoders[k].decode(raw.mask);
    keep_trusted(raw.mask, seen, options.policy);
    raw.position[calibration::axis_index(axes[k])] = std::move(seen.position);
    sigma[calibration::axis_index(axes[k])] = std::move(seen.sigma);
  }
  SYMRIG_CHECK(compare_neighbours(photographs, options, raw));
  const Image<float> clarity = clarity_of(light);
  for (const StripeAxis axis : axes)
    calibration::scale_to_scatter(sigma[calibration::axis_index(axis)], raw, axis, clarity);
  if (options.smooth) calibration::refine(raw, light.lit);
  return map_of(photographs, std::move(light), std::move(raw), std::move(sigma));
}

Result<PixelMap> decode_gray_code(const std::filesystem::path& folder, const ReadCodeOptions& reading,
                                  const DecodeOptions& decoding) {
  SYMRIG_TRY(const auto photographs, read_gray_code_folder(folder, reading));
  return decode(photographs, decoding);
}

}  // namespace symrig
