// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/camera_transport.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

namespace symrig {
namespace {

bool within(std::int64_t first, std::int64_t count, std::size_t size) {
  const auto all = static_cast<std::int64_t>(size);
  return first >= 0 && count >= 0 && first <= all && count <= all - first;
}

bool sound(const CameraTransport::Parts& parts) {
  const auto cells = static_cast<std::int32_t>(parts.cells.grid().size());
  std::int64_t values = 0, columns = 0;
  for (const LightBasis& basis : parts.bases) {
    if (basis.begin < 0 || basis.end < basis.begin || basis.end > cells || basis.rank < 0) return false;
    if (basis.first != columns) return false;
    columns += basis.rank;
    values += std::int64_t{basis.end - basis.begin} * basis.rank;
  }
  if (values != std::ssize(parts.basis_values)) return false;
  const auto column_ok = [&](CameraTransport::Column k) { return k < columns && -1 - k < cells; };
  const auto pixel_ok = [&](std::int32_t i) { return i >= 0 && i < parts.camera.size(); };
  const auto group_ok = [&](const CameraTransport::Group& g) {
    return g.channel >= 0 && g.channel < parts.channels &&
           within(g.first_column, g.columns, parts.columns.size()) &&
           within(g.first_pixel, g.pixels, parts.pixels.size()) &&
           within(g.first_value, std::int64_t{g.columns} * g.pixels, parts.values.size());
  };
  return std::ranges::all_of(parts.columns, column_ok) && std::ranges::all_of(parts.pixels, pixel_ok) &&
         std::ranges::all_of(parts.groups, group_ok);
}

/// bᵀ p of every basis column. p: in tree order.
std::vector<float> products(const CameraTransport::Parts& parts, std::span<const float> p) {
  std::vector<std::size_t> first(parts.bases.size());
  std::size_t values = 0, columns = 0;
  for (std::size_t q = 0; q < parts.bases.size(); ++q) {
    const LightBasis& basis = parts.bases[q];
    first[q] = values;
    values += std::size_t{0} + (basis.end - basis.begin) * std::int64_t{basis.rank};
    columns += basis.rank;
  }
  std::vector<float> sums(columns);
  tbb::parallel_for(std::size_t{0}, parts.bases.size(), [&](std::size_t q) {
    const LightBasis& basis = parts.bases[q];
    const std::size_t length = basis.end - basis.begin;
    for (std::int32_t k = 0; k < basis.rank; ++k) {
      const float* b = &parts.basis_values[first[q] + k * length];
      float sum = 0;
      for (std::size_t j = 0; j < length; ++j) sum += b[j] * p[basis.begin + j];
      sums[basis.first + k] = sum;
    }
  });
  return sums;
}

}  // namespace

Result<CameraTransport> CameraTransport::make(Parts parts) {
  if (!sound(parts))
    return Error{ErrorCode::bad_value, "the parts of the transport on camera pixels do not fit together",
                 "fit the camera again"};
  CameraTransport made;
  made.parts_ = std::move(parts);
  return made;
}

Result<Image<float>> CameraTransport::apply(const Image<float>& pattern) const {
  if (pattern.grid() != projector_grid() || pattern.channels() != 1)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the light is {} with {} channels, the projector has {} cells",
                             to_string(pattern.grid()), pattern.channels(), to_string(projector_grid())),
                 "give one channel of that size"};
  std::vector<float> light(pattern.values().size());
  parts_.cells.to_tree(pattern.values(), light);
  const std::vector<float> shown = products(parts_, light);
  Image<float> photograph(camera_grid(), channels());
  tbb::parallel_for(std::size_t{0}, parts_.groups.size(), [&](std::size_t g) {
    const Group& group = parts_.groups[g];
    std::vector<float> x(group.columns);
    for (std::size_t k = 0; k < x.size(); ++k) {
      const Column column = parts_.columns[group.first_column + k];
      x[k] = column >= 0 ? shown[column] : pattern.values()[-1 - column];
    }
    const std::span<float> plane = photograph.plane(group.channel);
    const float* a = &parts_.values[group.first_value];
    for (std::int32_t i = 0; i < group.pixels; ++i, a += group.columns) {
      float sum = 0;
      for (std::size_t k = 0; k < x.size(); ++k) sum += a[k] * x[k];
      plane[parts_.pixels[group.first_pixel + i]] = sum;
    }
  });
  return photograph;
}

}  // namespace symrig
