// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/camera_transport.hpp"

#include "symrig/tensor/internal/half.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace symrig {
namespace {

using CameraParts = CameraTransport::Parts;
using tensor::from_half;
using tensor::Half;

constexpr int kTogether = 16;  ///< lights of one pass over the rows

/// What does not fit; nothing if all does. Sums are 64 bits wide, because a file may name any numbers.
std::string_view misfit_of_bases(const CameraParts& parts) {
  const std::int64_t cells = parts.cells.grid().size();
  std::int64_t values = 0, columns = 0;
  for (const LightBasis& basis : parts.bases) {
    if (basis.begin < 0 || basis.end <= basis.begin || basis.end > cells) return "a basis";
    if (basis.rank < 1 || basis.rank > basis.end - basis.begin || basis.first != columns) return "a basis";
    columns += basis.rank;
    values += basis.values();
    if (values > std::ssize(parts.basis_values) || columns > INT32_MAX) return "a basis";
  }
  if (values != std::ssize(parts.basis_values)) return "the number of values of the bases";
  // Columns of an orthonormal matrix: no value is beyond 1, but for rounding.
  const auto small = [](Half half) { return std::abs(from_half(half)) <= 1.01F; };
  if (!std::ranges::all_of(parts.basis_values, small)) return "a value of the bases";
  const auto known = [&](CameraTransport::Column k) { return k < columns && -1 - std::int64_t{k} < cells; };
  return std::ranges::all_of(parts.columns, known) ? "" : "the number of a column";
}

std::string_view misfit_of_groups(const CameraParts& parts) {
  std::int64_t columns = 0, pixels = 0, codes = 0;
  for (const CameraTransport::Group& group : parts.groups) {
    if (group.channel < 0 || group.channel >= parts.channels || group.columns < 0 || group.pixels < 0)
      return "a group";
    columns += group.columns;
    pixels += group.pixels;
    codes += std::int64_t{group.columns} * group.pixels;
    if (codes > std::ssize(parts.codes)) return "the number of codes";
  }
  if (columns != std::ssize(parts.columns) || columns != std::ssize(parts.middles) ||
      columns != std::ssize(parts.steps))
    return "the number of columns";
  if (pixels != std::ssize(parts.pixels) || pixels != std::ssize(parts.brightness))
    return "the number of pixels";
  return codes == std::ssize(parts.codes) ? "" : "the number of codes";
}

/// Of a camera whose pixels have one colour each: whether the filter of this pixel lets the channel through.
bool filter_passes(const CameraParts& parts, std::int32_t pixel, std::int32_t channel) {
  if (parts.mosaic.empty()) return true;
  const std::int32_t row = pixel / parts.camera.cols, col = pixel % parts.camera.cols;
  return parts.mosaic[2 * (row % 2) + col % 2] == "RGB"[channel];
}

/// Two rows of one pixel would be written by two threads.
std::string_view misfit_of_pixels(const CameraParts& parts) {
  const std::int64_t camera = parts.camera.size();
  if (camera < 1) return "the size of the camera";
  const bool filters = parts.channels == 3 && parts.mosaic.size() == 4;
  if (!parts.mosaic.empty() && !filters) return "the colour filters";
  std::vector<std::int64_t> named;  // channel after channel
  named.reserve(parts.pixels.size());
  for (const CameraTransport::Group& group : parts.groups)
    for (std::int32_t i = 0; i < group.pixels; ++i) {
      const std::int32_t pixel = parts.pixels[named.size()];
      if (pixel < 0 || pixel >= camera) return "the number of a pixel";
      if (!filter_passes(parts, pixel, group.channel)) return "a row in a colour that its pixel does not see";
      named.push_back(group.channel * camera + pixel);
    }
  std::ranges::sort(named);
  return std::ranges::adjacent_find(named) == named.end() ? "" : "a pixel that is named twice";
}

std::string_view misfit_of_sizes(const CameraParts& parts) {
  std::size_t column = 0, pixel = 0;
  for (const CameraTransport::Group& group : parts.groups) {
    float most = 0, brightest = 0;
    for (std::int32_t k = 0; k < group.columns; ++k, ++column) {
      const float size =
          std::abs(from_half(parts.middles[column])) + 128 * std::abs(from_half(parts.steps[column]));
      if (!(size < CameraTransport::kLargest)) return "the size of a coefficient";
      most = std::max(most, size);
    }
    for (std::int32_t i = 0; i < group.pixels; ++i, ++pixel) {
      if (!(parts.brightness[pixel] >= 0 && parts.brightness[pixel] < CameraTransport::kLargest))
        return "the brightness of a pixel";
      brightest = std::max(brightest, parts.brightness[pixel]);
    }
    if (!(most * brightest < CameraTransport::kLargest)) return "the size of a coefficient";
  }
  return "";
}

std::string_view misfit_of_chi_square(const CameraParts& parts) {
  if (!parts.chi_square.empty() && parts.chi_square.size() != parts.pixels.size())
    return "the number of chi-squares";
  const auto possible = [](Half half) { return from_half(half) >= 0 && std::isfinite(from_half(half)); };
  return std::ranges::all_of(parts.chi_square, possible) ? "" : "a chi-square";
}

/// Sums of a group's pixel: Σ_k code_k z_k for each light. z: [columns × Lights]. The partial sums of one
/// light are what lets the compiler use whole registers.
template <int Lights>
void add_codes(const std::int8_t* codes, const float* z, std::size_t columns, float* sums) {
  if constexpr (Lights == 1) {
    std::array<float, 8> part{};
    std::size_t k = 0;
    for (; k + part.size() <= columns; k += part.size())
      for (std::size_t l = 0; l < part.size(); ++l) part[l] += static_cast<float>(codes[k + l]) * z[k + l];
    for (; k < columns; ++k) part[0] += static_cast<float>(codes[k]) * z[k];
    for (const float one : part) sums[0] += one;
  } else {
    for (std::size_t k = 0; k < columns; ++k) {
      const auto code = static_cast<float>(codes[k]);
      for (int l = 0; l < Lights; ++l) sums[l] += code * z[k * Lights + l];
    }
  }
}

}  // namespace

Result<CameraTransport> CameraTransport::make(Parts parts) {
  for (const auto misfit :
       {misfit_of_bases, misfit_of_groups, misfit_of_pixels, misfit_of_sizes, misfit_of_chi_square})
    if (const std::string_view what = misfit(parts); !what.empty())
      return Error{ErrorCode::bad_value,
                   fmt::format("the parts of T on camera pixels do not fit together: {}", what), ""};
  CameraTransport made;
  made.places_.reserve(parts.groups.size());
  Place at;
  for (const Group& group : parts.groups) {
    made.places_.push_back(at);
    at.column += group.columns;
    at.pixel += group.pixels;
    at.code += std::int64_t{group.columns} * group.pixels;
  }
  std::int64_t value = 0;
  for (const LightBasis& basis : parts.bases) {
    made.basis_first_.push_back(value);
    value += basis.values();
  }
  made.parts_ = std::move(parts);
  return made;
}

std::int64_t CameraTransport::bytes() const {
  const auto of = [](const auto& values) {
    return std::ssize(values) * static_cast<std::int64_t>(sizeof values[0]);
  };
  return of(parts_.bases) + of(parts_.basis_values) + of(parts_.groups) + of(parts_.columns) +
         of(parts_.middles) + of(parts_.steps) + of(parts_.pixels) + of(parts_.brightness) +
         of(parts_.codes) + of(parts_.chi_square) + of(places_) + of(basis_first_);
}

Image<float> CameraTransport::chi_square() const {
  if (parts_.chi_square.empty()) return {};
  Image<float> picture(parts_.camera, parts_.channels);
  std::size_t at = 0;
  for (const Group& group : parts_.groups)
    for (std::int32_t i = 0; i < group.pixels; ++i, ++at)
      picture.plane(group.channel)[parts_.pixels[at]] = from_half(parts_.chi_square[at]);
  return picture;
}

void CameraTransport::set_chi_square(std::span<const float> values) {
  constexpr float kLeast = 0x1p-24F, kMost = 65504;  // of a half; 0 is: not known
  assert(std::ssize(values) == rows());
  parts_.chi_square.clear();
  for (const float value : values)
    parts_.chi_square.push_back(tensor::to_half(value > 0 ? std::clamp(value, kLeast, kMost) : 0));
}

/// vᵀ p of every column of the bases, [columns × Lights].
template <int Lights>
std::vector<float> CameraTransport::shown(const Image<float>* patterns, int count) const {
  std::vector<float> p(std::size_t{1} * projector_grid().size() * Lights);  // [tree order × Lights]
  const std::span<const std::int32_t> order = parts_.cells.order();
  for (int l = 0; l < count; ++l)
    for (std::size_t t = 0; t < order.size(); ++t) p[t * Lights + l] = patterns[l].values()[order[t]];
  const std::size_t columns =
      parts_.bases.empty() ? 0 : std::size_t{0} + parts_.bases.back().first + parts_.bases.back().rank;
  std::vector<float> sums(columns * Lights);
  tbb::parallel_for(std::size_t{0}, parts_.bases.size(), [&](std::size_t q) {
    const LightBasis& basis = parts_.bases[q];
    const Half* b = &parts_.basis_values[basis_first_[q]];
    for (std::int32_t k = 0; k < basis.rank; ++k) {
      float* sum = &sums[std::size_t{1} * (basis.first + k) * Lights];
      for (std::int32_t j = basis.begin; j < basis.end; ++j, ++b) {
        const float value = from_half(*b);
        for (int l = 0; l < Lights; ++l) sum[l] += value * p[std::size_t{1} * j * Lights + l];
      }
    }
  });
  return sums;
}

template <int Lights>
void CameraTransport::apply_to(const Image<float>* patterns, int count, Image<float>* photographs) const {
  const std::vector<float> of_bases = shown<Lights>(patterns, count);
  tbb::enumerable_thread_specific<std::vector<float>> local;
  tbb::parallel_for(std::size_t{0}, parts_.groups.size(), [&](std::size_t g) {
    const Group& group = parts_.groups[g];
    const Place& place = places_[g];
    const std::size_t columns = group.columns;
    std::vector<float>& z = local.local();  // step_k x_k
    z.assign(columns * Lights, 0);
    std::array<float, Lights> middle{};  // Σ middle_k x_k
    for (std::size_t k = 0; k < columns; ++k) {
      const Column column = parts_.columns[place.column + k];
      const float m = from_half(parts_.middles[place.column + k]),
                  step = from_half(parts_.steps[place.column + k]);
      for (int l = 0; l < count; ++l) {
        const float x =
            column >= 0 ? of_bases[std::size_t{1} * column * Lights + l] : patterns[l].values()[-1 - column];
        middle[l] += m * x;
        z[k * Lights + l] = step * x;
      }
    }
    const std::int8_t* codes = parts_.codes.data() + place.code;
    for (std::int32_t i = 0; i < group.pixels; ++i, codes += columns) {
      std::array<float, Lights> sums = middle;
      add_codes<Lights>(codes, z.data(), columns, sums.data());
      const float brightness = parts_.brightness[place.pixel + i];
      for (int l = 0; l < count; ++l)
        photographs[l].plane(group.channel)[parts_.pixels[place.pixel + i]] = brightness * sums[l];
    }
  });
}

Result<Image<float>> CameraTransport::apply(const Image<float>& pattern) const {
  SYMRIG_CHECK(check_light(pattern));
  Image<float> photograph(camera_grid(), channels());
  apply_to<1>(&pattern, 1, &photograph);
  return photograph;
}

Result<std::vector<Image<float>>> CameraTransport::apply_batch(std::span<const Image<float>> patterns) const {
  for (const Image<float>& pattern : patterns) SYMRIG_CHECK(check_light(pattern));
  std::vector<Image<float>> photographs(patterns.size(), Image<float>(camera_grid(), channels()));
  for (std::size_t k = 0; k < patterns.size(); k += kTogether) {
    const auto count = static_cast<int>(std::min<std::size_t>(kTogether, patterns.size() - k));
    if (count == 1)
      apply_to<1>(&patterns[k], 1, &photographs[k]);
    else
      apply_to<kTogether>(&patterns[k], count, &photographs[k]);
  }
  return photographs;
}

Result<Image<float>> CameraTransport::adjoint(const Image<float>& picture) const {
  if (picture.grid() != camera_grid() || picture.channels() != channels())
    return Error{
        ErrorCode::size_mismatch,
        fmt::format("the picture is {} with {} channels, the camera's are {} with {}",
                    to_string(picture.grid()), picture.channels(), to_string(camera_grid()), channels()),
        "give a picture of that size"};
  // Of each column of each group: Σ_i a_ik y_i. Groups share columns, so these are added up afterwards.
  std::vector<float> sums(parts_.columns.size());
  tbb::parallel_for(std::size_t{0}, parts_.groups.size(), [&](std::size_t g) {
    const Group& group = parts_.groups[g];
    const Place& place = places_[g];
    const std::span<float> sum = std::span(sums).subspan(place.column, group.columns);
    float bright = 0;
    for (std::int32_t i = 0; i < group.pixels; ++i) {
      const std::int64_t pixel = place.pixel + i;
      const float y = parts_.brightness[pixel] * picture.plane(group.channel)[parts_.pixels[pixel]];
      const std::int8_t* codes = parts_.codes.data() + place.code + std::int64_t{i} * group.columns;
      bright += y;
      for (std::int32_t k = 0; k < group.columns; ++k) sum[k] += static_cast<float>(codes[k]) * y;
    }
    for (std::int32_t k = 0; k < group.columns; ++k)
      sum[k] = from_half(parts_.middles[place.column + k]) * bright +
               from_half(parts_.steps[place.column + k]) * sum[k];
  });
  Image<float> light(projector_grid());
  const std::size_t columns =
      parts_.bases.empty() ? 0 : std::size_t{0} + parts_.bases.back().first + parts_.bases.back().rank;
  std::vector<float> of_bases(columns);
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const Column column = parts_.columns[k];
    (column >= 0 ? of_bases[column] : light.values()[-1 - column]) += sums[k];
  }
  const std::span<const std::int32_t> order = parts_.cells.order();
  for (std::size_t q = 0; q < parts_.bases.size(); ++q) {
    const LightBasis& basis = parts_.bases[q];
    const Half* b = &parts_.basis_values[basis_first_[q]];
    for (std::int32_t k = 0; k < basis.rank; ++k)
      for (std::int32_t j = basis.begin; j < basis.end; ++j, ++b)
        light.values()[order[j]] += of_bases[basis.first + k] * from_half(*b);
  }
  return light;
}

Result<void> CameraTransport::check_light(const Image<float>& pattern) const {
  if (pattern.grid() == projector_grid() && pattern.channels() == 1) return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("the light is {} with {} channels, the projector has {} cells",
                           to_string(pattern.grid()), pattern.channels(), to_string(projector_grid())),
               "give one channel of that size"};
}

namespace {

/// The root mean square of a pixel's coefficients, each in units of that of its column. So rows of pixels
/// that are alike but for their brightness become the same numbers.
std::vector<float> brightness_of(std::span<const float> rows, std::size_t columns) {
  constexpr double kDarkest = 0.05;  // of the mean; a darker pixel would stretch the codes of the others
  const std::size_t pixels = rows.size() / columns;
  std::vector<double> unit(columns);
  for (std::size_t i = 0; i < rows.size(); ++i)
    unit[i % columns] += static_cast<double>(rows[i]) * static_cast<double>(rows[i]);
  std::vector<double> bright(pixels);
  double mean = 0;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (unit[i % columns] > 0)
      bright[i / columns] += static_cast<double>(rows[i]) * static_cast<double>(rows[i]) / unit[i % columns];
  for (double& one : bright) {
    one = std::sqrt(one);
    mean += one / static_cast<double>(pixels);
  }
  std::vector<float> brightness;
  brightness.reserve(pixels);
  for (const double one : bright)
    brightness.push_back(mean > 0 ? static_cast<float>(std::max(one, kDarkest * mean)) : 1.F);
  return brightness;
}

/// The half that is not below a value ≥ 0.
Half half_above(float value) {
  const Half half = tensor::to_half(value);
  return from_half(half) < value ? static_cast<Half>(half + 1) : half;
}

/// Codes of one column, whose values become what the codes have left.
void pack_column(CameraTransport::Column column, std::vector<float>& values, PackedRows& packed,
                 std::vector<std::int8_t>& codes) {
  constexpr float kCodes = 127;
  const auto [least, most] = std::ranges::minmax(values);
  packed.columns.push_back(column);
  packed.middles.push_back(tensor::to_half(least + (most - least) / 2));
  const float middle = from_half(packed.middles.back());
  packed.steps.push_back(half_above(std::max(most - middle, middle - least) / kCodes));
  const float step = from_half(packed.steps.back());
  for (float& value : values) {
    const float code = step > 0 ? std::clamp(std::round((value - middle) / step), -kCodes, kCodes) : 0;
    codes.push_back(static_cast<std::int8_t>(code));
    value -= middle + step * code;
  }
}

}  // namespace

PackedRows pack_rows(std::span<const CameraTransport::Column> columns, std::span<const float> shown,
                     std::span<const float> rows, std::span<const float> light) {
  constexpr double kCoarsest = 5e-4;     // of a pixel's light; the rms error is 0.29 of a step
  constexpr float kLargestHalf = 16384;  // so that the smallest of a group are whole halves too
  constexpr double kNegligible = 1e-4;   // of a pixel's light
  PackedRows packed;
  const std::size_t pixels = light.size();
  if (columns.empty()) {
    packed.brightness.assign(pixels, 0);
    return packed;
  }
  packed.brightness = brightness_of(rows, columns.size());
  float largest = 0;
  for (std::size_t i = 0; i < rows.size(); ++i)
    largest = std::max(largest, std::abs(rows[i]) / packed.brightness[i / columns.size()]);
  for (float& one : packed.brightness) one *= largest > 0 ? largest / kLargestHalf : 1;
  double usual = 0;  // light in units of brightness
  for (std::size_t i = 0; i < pixels; ++i)
    usual += std::abs(static_cast<double>(light[i])) / static_cast<double>(packed.brightness[i]);
  usual /= static_cast<double>(pixels);
  std::vector<std::int8_t> codes;  // column by column
  std::vector<float> values(pixels);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    double most = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      values[i] = rows[i * columns.size() + k] / packed.brightness[i];
      most = std::max(most, static_cast<double>(std::abs(values[i]) * shown[k]));
    }
    if (most <= kNegligible * usual) continue;
    pack_column(columns[k], values, packed, codes);
    if (static_cast<double>(from_half(packed.steps.back()) * shown[k]) > kCoarsest * usual)
      pack_column(columns[k], values, packed, codes);
  }
  packed.codes.resize(codes.size());
  for (std::size_t k = 0; k < codes.size(); ++k)
    packed.codes[k % pixels * packed.columns.size() + k / pixels] = codes[k];
  return packed;
}

}  // namespace symrig
