// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/pixel_map.hpp"

#include "calibration/raw_map.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

namespace symrig {
namespace {

using calibration::RawMap;

/// Median; reorders its argument. 0 of nothing.
double median(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// rms of the values within three robust sigmas of 0; the median alone would be quantised as coarsely as
/// 8-bit codes are.
double robust_rms(const std::vector<double>& values) {
  std::vector<double> sizes;
  sizes.reserve(values.size());
  for (const double v : values) sizes.push_back(std::abs(v));
  const double limit = 3 * 1.4826 * median(sizes);
  double sum = 0, count = 0;
  for (const double v : values) {
    sum += std::abs(v) <= limit ? v * v : 0;
    count += std::abs(v) <= limit ? 1 : 0;
  }
  return count == 0 ? 0 : std::sqrt(sum / count);
}

/// rms noise of one pixel of one photograph. pattern + complement − white − black is zero but for noise (four
/// times its variance) and interreflection (slow: removed by each pair's median).
double estimate_noise(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  const auto white = photographs.white().values(), black = photographs.black().values();
  const std::size_t stride = std::max<std::size_t>(1, white.size() / 20'000) | 1U;
  std::vector<double> deviations;
  for (int pair = 0; pair < photographs.code.pairs(); ++pair) {
    if (pair == held_out) continue;
    const auto pattern = photographs.image(2 * pair).values();
    const auto complement = photographs.image(2 * pair + 1).values();
    std::vector<double> sums;
    for (std::size_t i = 0; i < white.size(); i += stride)
      sums.push_back(static_cast<double>(pattern[i] + complement[i] - white[i] - black[i]));
    for (const double middle = median(sums); const double sum : sums) deviations.push_back(sum - middle);
  }
  return robust_rms(deviations) / 2;
}

/// Decodes one axis of one pixel.
class AxisDecoder {
 public:
  AxisDecoder(const CodePhotographs& photographs, StripeAxis axis, const DecodeOptions& options, double noise)
      : photographs_(photographs),
        first_(axis == StripeAxis::columns ? 0 : photographs.code.column_bits()),
        bits_(photographs.code.bits(axis)),
        held_out_(options.held_out_pair),
        limit_(held_out_                     ? 1 << bits_
               : axis == StripeAxis::columns ? photographs.code.projector().cols
                                             : photographs.code.projector().rows),
        least_margin_(options.margin_sigmas * std::numbers::sqrt2 * noise),
        margin_fraction_(options.margin_fraction) {}

  /// nullopt where more than one bit is ambiguous, or one that is not on an edge between neighbours. A
  /// held-out bit counts as 0.
  std::optional<float> position(std::size_t pixel, double contrast) const {
    const double margin = std::max(least_margin_, margin_fraction_ * contrast);
    int value = 0, binary = 0, ambiguous = -1;
    for (int bit = 0; bit < bits_; ++bit) {
      const double difference = first_ + bit == held_out_ ? 0 : complement_difference(bit, pixel);
      binary ^= difference > 0 ? 1 : 0;
      value = 2 * value + binary;
      // The last bit may always be ambiguous: it decides between two neighbours.
      if (first_ + bit == held_out_ || bit == bits_ - 1 || std::abs(difference) >= margin) continue;
      if (ambiguous >= 0) return std::nullopt;
      ambiguous = bit;
    }
    return on_edge(value, ambiguous);
  }

 private:
  double complement_difference(int bit, std::size_t pixel) const {
    const int pattern = 2 * (first_ + bit);
    return static_cast<double>(photographs_.image(pattern).values()[pixel]) -
           static_cast<double>(photographs_.image(pattern + 1).values()[pixel]);
  }

  std::optional<float> on_edge(int value, int ambiguous) const {
    // Flipping Gray bit k flips the binary bits k, k + 1, ...
    const int other = ambiguous < 0 ? value : value ^ ((1 << (bits_ - ambiguous)) - 1);
    if (std::abs(value - other) > 1 || std::max(value, other) >= limit_) return std::nullopt;
    return static_cast<float>(value + other) / 2;
  }

  const CodePhotographs& photographs_;
  int first_, bits_;
  std::optional<int> held_out_;
  int limit_;  // positions beyond the projector are wrong; unfolding looks after them when a bit is held out
  double least_margin_, margin_fraction_;
};

RawMap decode_pixels(const CodePhotographs& photographs, const DecodeOptions& options, const PixelMap& map,
                     const Image<std::uint8_t>& lit) {
  const Grid grid = map.camera;
  RawMap raw{{Image<float>(grid), Image<float>(grid)}, Image<std::uint8_t>(grid)};
  const AxisDecoder columns(photographs, StripeAxis::columns, options, map.noise),
      rows(photographs, StripeAxis::rows, options, map.noise);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int col = 0; col < grid.cols; ++col) {
      if (!lit.at(row, col)) continue;
      const std::size_t pixel =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.cols) + static_cast<std::size_t>(col);
      const auto contrast = static_cast<double>(map.contrast.at(row, col));
      const auto x = columns.position(pixel, contrast), y = rows.position(pixel, contrast);
      if (!x || !y) continue;
      raw.position[0].at(row, col) = *x;
      raw.position[1].at(row, col) = *y;
      raw.mask.at(row, col) = 1;
    }
  });
  return raw;
}

std::int64_t count(const Image<std::uint8_t>& mask) {
  return std::ranges::count(mask.values(), std::uint8_t{1});
}

/// Contrast, noise and the lit mask.
struct Light {
  Image<float> contrast;
  double noise = 0;
  Image<std::uint8_t> lit;
};

Result<Light> find_light(const CodePhotographs& photographs, const DecodeOptions& options) {
  Light light{Image<float>(photographs.camera()), estimate_noise(photographs, options.held_out_pair),
              Image<std::uint8_t>(photographs.camera())};
  std::ranges::transform(photographs.white().values(), photographs.black().values(),
                         light.contrast.values().begin(), std::minus{});
  const auto least = static_cast<float>(options.contrast_sigmas * std::numbers::sqrt2 * light.noise);
  std::ranges::transform(light.contrast.values(), light.lit.values().begin(),
                         [least](float c) { return c > least ? std::uint8_t{1} : std::uint8_t{0}; });
  if (count(light.lit) > 0) return light;
  return Error{ErrorCode::bad_value,
               fmt::format("no pixel is brighter in white than in black by {:.3g} (the noise is {:.3g})",
                           least, light.noise),
               "expose longer, or darken the room"};
}

Result<void> check_orientation(const RawMap& raw, double orientation) {
  if (count(raw.mask) == 0)
    return Error{ErrorCode::bad_value,
                 "no pixel could be decoded: the stripes are not where the sequence says",
                 "the order is: column pairs (most significant bit first), row pairs, white, black"};
  const double share = calibration::oriented_share(raw, orientation);
  if (share > 0.5) return {};
  return Error{ErrorCode::bad_value,
               fmt::format("the decoded map runs backwards over {:.0f} % of its pixels", 100 * (1 - share)),
               "a pattern and its complement are swapped, photographs are out of order, or the projection is "
               "mirrored"};
}

/// Positions beyond the projector leave the mask.
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
  if (options.held_out_pair && (*options.held_out_pair < 0 || *options.held_out_pair >= code.pairs()))
    return Error{ErrorCode::bad_argument, fmt::format("held-out pair {} does not exist; pairs are 0 to {}",
                                                      *options.held_out_pair, code.pairs() - 1)};
  SYMRIG_TRY(auto light, find_light(photographs, options));
  PixelMap map{photographs.camera(), code.projector(), {}, {}, {}, std::move(light.contrast), light.noise};
  RawMap raw = decode_pixels(photographs, options, map, light.lit);
  const double orientation = options.mirrored ? -1 : 1;
  if (options.held_out_pair) {
    const StripePair pair = code.pair(*options.held_out_pair);
    calibration::unfold(raw, pair.axis, 1 << (code.bits(pair.axis) - pair.bit), orientation);
    keep_inside(raw, code.projector());
  }
  SYMRIG_CHECK(check_orientation(raw, orientation));
  if (options.subpixel) calibration::refine(raw, light.lit);
  map.col = std::move(raw.position[0]);
  map.row = std::move(raw.position[1]);
  map.mask = std::move(raw.mask);
  return map;
}

Result<PixelMap> decode_gray_code(const std::filesystem::path& folder, const ReadCodeOptions& reading,
                                  const DecodeOptions& decoding) {
  SYMRIG_TRY(const auto photographs, read_gray_code_folder(folder, reading));
  return decode(photographs, decoding);
}

}  // namespace symrig
