// SPDX-License-Identifier: Apache-2.0
#include "acquisition/log/packed_photograph.hpp"

#include "symrig/acquisition/internal/fast_crc32c.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace symrig::acquisition {
namespace {

static_assert(std::endian::native == std::endian::little, "codes are little-endian and copied as they are");

constexpr int kMeanZero = 12500;  ///< code of a mean of 0: noise may be below it
constexpr int kMostMean = 65535;
constexpr std::uint32_t kInvalid = 255, kMostVariance = 254;
constexpr unsigned kVarianceShift = 20;  ///< of a float's bits: what is left is the exponent and three bits

/// The bits of a variance that count.
std::uint32_t magnitude(float variance) {
  return std::bit_cast<std::uint32_t>(variance) >> kVarianceShift;
}

float with_rounding(float variance, float step) {
  return variance + step * step / 12;
}

/// Whether a sample has numbers that a camera can give.
bool usable(std::uint8_t valid, float variance) {
  return valid != 0 && variance >= 0 && std::isfinite(variance);
}

/// What is subtracted from the bits of variances, so that the largest has code kMostVariance.
std::uint32_t base_of(const Radiance& photograph, const Image<float>& steps) {
  std::uint32_t most = kMostVariance;
  const auto variance = photograph.variance.values();
  const auto valid = photograph.valid.values();
  for (std::size_t i = 0; i < variance.size(); ++i)
    if (usable(valid[i], variance[i]))
      most = std::max(most, magnitude(with_rounding(variance[i], steps.values()[i])));
  return most - kMostVariance;
}

std::size_t strip_bytes(Grid camera, int channels, int rows) {
  return padded(std::size_t{3} * static_cast<std::size_t>(channels) * rows * camera.cols);
}

/// Of a sample. A strip has the means of all channels, then the variances.
struct Codes {
  std::uint16_t mean;
  std::uint8_t variance;
};

Codes codes_of(float mean, float variance, float step, std::uint32_t base) {
  const double code = std::nearbyint(static_cast<double>(mean) / step) + kMeanZero;
  if (!(code >= 0 && code <= kMostMean)) return {0, kInvalid};
  const std::uint32_t size = magnitude(with_rounding(variance, step));
  const std::uint32_t kept = size > base ? std::min(size - base, kMostVariance) : 1;
  return {static_cast<std::uint16_t>(code), static_cast<std::uint8_t>(std::max(kept, 1U))};
}

float variance_of(std::uint32_t code, std::uint32_t base) {
  constexpr std::uint32_t kMiddle = 1U << (kVarianceShift - 1);
  return std::bit_cast<float>(((base + code) << kVarianceShift) | kMiddle);
}

void unpack_rows(const std::byte* bytes, std::uint32_t base, const Image<float>& steps, int first_row,
                 int rows, int to_row, Radiance& to) {
  const int channels = steps.channels();
  const std::size_t count = std::size_t{1} * rows * steps.grid().cols;
  const std::byte* variances = bytes + 2 * count * channels;
  for (int c = 0; c < channels; ++c) {
    const float* step = steps.plane(c).data() + std::size_t{1} * first_row * steps.grid().cols;
    const std::size_t at = std::size_t{1} * to_row * steps.grid().cols;
    float* mean = to.mean.plane(c).data() + at;
    float* variance = to.variance.plane(c).data() + at;
    std::uint8_t* valid = to.valid.plane(c).data() + at;
    for (std::size_t i = 0; i < count; ++i) {
      std::uint16_t code = 0;
      std::memcpy(&code, bytes + 2 * (c * count + i), sizeof code);
      const auto size = std::to_integer<std::uint32_t>(variances[c * count + i]);
      const bool good = size != kInvalid;
      mean[i] = good ? static_cast<float>(int{code} - kMeanZero) * step[i] : 0;
      variance[i] = good ? variance_of(size, base) : 0;
      valid[i] = good ? 1 : 0;
    }
  }
}

std::uint32_t number_at(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t number = 0;
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

std::uint32_t crc_of_strip(std::span<const std::byte> front, int strip) {
  return number_at(front, sizeof(std::uint32_t) * (1 + strip));
}

}  // namespace

int strips_of(Grid camera) {
  return (camera.rows + kLogStripRows - 1) / kLogStripRows;
}

int rows_of_strip(Grid camera, int strip) {
  return std::min(kLogStripRows, camera.rows - strip * kLogStripRows);
}

void shape_of_strip(Grid camera, int channels, int strip, Radiance& to) {
  const Grid grid{rows_of_strip(camera, strip), camera.cols};
  if (to.mean.grid() == grid && to.mean.channels() == channels) return;
  to = {Image<float>(grid, channels), Image<float>(grid, channels), Image<std::uint8_t>(grid, channels)};
}

std::size_t packed_front_bytes(Grid camera) {
  return padded(sizeof(std::uint32_t) * (1 + strips_of(camera)));
}

StripPlace place_of_strip(Grid camera, int channels, int strip) {
  return {packed_front_bytes(camera) + strip * strip_bytes(camera, channels, kLogStripRows),
          strip_bytes(camera, channels, rows_of_strip(camera, strip))};
}

std::size_t packed_bytes(Grid camera, int channels) {
  const StripPlace last = place_of_strip(camera, channels, strips_of(camera) - 1);
  return last.begin + last.bytes;
}

void pack(const Radiance& photograph, const Image<float>& steps, std::byte* out) {
  const Grid camera = steps.grid();
  const int channels = steps.channels();
  const std::uint32_t base = base_of(photograph, steps);
  std::memset(out, 0, packed_front_bytes(camera));
  std::memcpy(out, &base, sizeof base);
  for (int strip = 0; strip < strips_of(camera); ++strip) {
    const StripPlace place = place_of_strip(camera, channels, strip);
    const int rows = rows_of_strip(camera, strip);
    const std::size_t count = std::size_t{1} * rows * camera.cols;
    const std::size_t first = std::size_t{1} * strip * kLogStripRows * camera.cols;
    std::byte* means = out + place.begin;
    std::byte* variances = means + 2 * count * channels;
    for (int c = 0; c < channels; ++c) {
      const auto step = steps.plane(c).subspan(first), mean = photograph.mean.plane(c).subspan(first),
                 variance = photograph.variance.plane(c).subspan(first);
      const auto valid = photograph.valid.plane(c).subspan(first);
      for (std::size_t i = 0; i < count; ++i) {
        const Codes codes = usable(valid[i], variance[i]) ? codes_of(mean[i], variance[i], step[i], base)
                                                          : Codes{0, kInvalid};
        std::memcpy(means + 2 * (c * count + i), &codes.mean, sizeof codes.mean);
        variances[c * count + i] = std::byte{codes.variance};
      }
    }
    const std::size_t written = 3 * count * channels;
    std::memset(means + written, 0, place.bytes - written);
    const std::uint32_t crc = fast_crc32c({means, place.bytes});
    std::memcpy(out + sizeof crc * (1 + strip), &crc, sizeof crc);
  }
}

bool strip_sound(std::span<const std::byte> packed, Grid camera, int channels, int strip) {
  const StripPlace place = place_of_strip(camera, channels, strip);
  return fast_crc32c(packed.subspan(place.begin, place.bytes)) == crc_of_strip(packed, strip);
}

void unpack_strip(std::span<const std::byte> packed, const Image<float>& steps, int strip, Radiance& to) {
  const StripPlace place = place_of_strip(steps.grid(), steps.channels(), strip);
  const int first = strip * kLogStripRows;
  unpack_rows(packed.data() + place.begin, number_at(packed, 0), steps, first,
              rows_of_strip(steps.grid(), strip), first, to);
}

bool unpack_strip_alone(std::span<const std::byte> front, std::span<const std::byte> bytes,
                        const Image<float>& steps, int strip, Radiance& to) {
  if (fast_crc32c(bytes) != crc_of_strip(front, strip)) return false;
  unpack_rows(bytes.data(), number_at(front, 0), steps, strip * kLogStripRows,
              rows_of_strip(steps.grid(), strip), 0, to);
  return true;
}

}  // namespace symrig::acquisition
