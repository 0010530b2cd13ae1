// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/camera_transport.hpp"
#include "symrig/tensor/internal/half.hpp"

#include <cstdint>
#include <utility>
#include <vector>

namespace symrig::test {

/// A camera of 3 x 5 pixels before cells, six or more. Two bases, of the cells 0..4 (rank 2) and 4..6 (rank
/// 1) in tree order; two groups of pixels in each channel. Pixel 14 has no row.
inline CameraTransport::Parts small_camera(int channels = 1, BlockTree cells = BlockTree(Grid{2, 3})) {
  CameraTransport::Parts parts;
  parts.cells = std::move(cells);
  parts.camera = {3, 5};
  parts.channels = channels;
  parts.registration = "01abcdef";
  parts.bases = {{0, 4, 2, 0}, {4, 6, 1, 2}};
  for (const float value : {0.5F, 0.5F, 0.5F, 0.5F, 0.5F, -0.5F, 0.5F, -0.5F, 0.75F, -0.625F})
    parts.basis_values.push_back(tensor::to_half(value));
  const std::vector<CameraTransport::Column> first{0, 1, -1, -6}, second{2, -4, -1};
  std::int32_t code = 3;
  for (std::int32_t channel = 0; channel < channels; ++channel) {
    parts.groups.push_back({channel, 4, 6});
    parts.groups.push_back({channel, 3, 8});
    for (const auto& columns : {first, second})
      for (const CameraTransport::Column column : columns) {
        parts.columns.push_back(column);
        parts.middles.push_back(
            tensor::to_half(0.25F * static_cast<float>(column + 2) + static_cast<float>(channel)));
        parts.steps.push_back(tensor::to_half(0.0078125F));
      }
    for (std::int32_t pixel = 0; pixel < 14; ++pixel) {
      parts.pixels.push_back(13 - pixel);
      parts.brightness.push_back(0.5F + 0.125F * static_cast<float>(pixel));
    }
    for (int k = 0; k < 4 * 6 + 3 * 8; ++k) {
      code = (code * 37 + 11) % 255;
      parts.codes.push_back(static_cast<std::int8_t>(code - 127));
    }
  }
  return parts;
}

/// The same with the filters GRBG: each pixel has a row in its own colour.
inline CameraTransport::Parts small_mosaic(BlockTree cells = BlockTree(Grid{2, 3})) {
  CameraTransport::Parts parts = small_camera(1, std::move(cells));
  parts.channels = 3;
  parts.mosaic = "GRBG";
  const std::vector<CameraTransport::Column> columns{0, -2};
  parts.groups.clear(), parts.columns.clear(), parts.pixels.clear(), parts.codes.clear();
  for (std::int32_t channel = 0; channel < 3; ++channel) {
    std::int32_t count = 0;
    for (std::int32_t pixel = 0; pixel < 14; ++pixel)
      if (parts.mosaic[2 * (pixel / 5 % 2) + pixel % 5 % 2] == "RGB"[channel]) {
        parts.pixels.push_back(pixel);
        parts.codes.insert(parts.codes.end(), {static_cast<std::int8_t>(7 * pixel), -20});
        ++count;
      }
    parts.groups.push_back({channel, 2, count});
    parts.columns.insert(parts.columns.end(), columns.begin(), columns.end());
  }
  parts.middles.assign(parts.columns.size(), tensor::to_half(0.5F));
  parts.steps.assign(parts.columns.size(), tensor::to_half(0.0009765625F));
  parts.brightness.assign(parts.pixels.size(), 1.5F);
  return parts;
}

/// T of these parts as a matrix: [channels · pixels × cells], in double precision.
inline std::vector<std::vector<double>> matrix_of(const CameraTransport::Parts& parts) {
  const std::int64_t cells = parts.cells.grid().size(), camera = parts.camera.size();
  std::vector<std::vector<double>> columns;  // of the bases, in raster order
  std::size_t value = 0;
  for (const LightBasis& basis : parts.bases)
    for (std::int32_t k = 0; k < basis.rank; ++k) {
      columns.emplace_back(cells);
      for (std::int32_t j = basis.begin; j < basis.end; ++j)
        columns.back()[parts.cells.order()[j]] = tensor::from_half(parts.basis_values[value++]);
    }
  std::vector<std::vector<double>> rows(parts.channels * camera, std::vector<double>(cells));
  std::size_t column = 0, pixel = 0, code = 0;
  for (const CameraTransport::Group& group : parts.groups) {
    for (std::int32_t i = 0; i < group.pixels; ++i, ++pixel)
      for (std::int32_t k = 0; k < group.columns; ++k, ++code) {
        const double a =
            static_cast<double>(parts.brightness[pixel]) *
            (static_cast<double>(tensor::from_half(parts.middles[column + k])) +
             static_cast<double>(tensor::from_half(parts.steps[column + k])) * parts.codes[code]);
        std::vector<double>& row = rows[group.channel * camera + parts.pixels[pixel]];
        const CameraTransport::Column number = parts.columns[column + k];
        if (number < 0) row[-1 - number] += a;
        for (std::int64_t j = 0; number >= 0 && j < cells; ++j) row[j] += a * columns[number][j];
      }
    column += group.columns;
  }
  return rows;
}

}  // namespace symrig::test
