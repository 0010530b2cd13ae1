// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/camera_transport.hpp"
#include "symrig/tensor/internal/half.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace symrig::test {

/// A camera that looks at cells: turned, larger than their field, and with a lens that bends lines.
struct TurnedCamera {
  Grid cells{24, 32}, camera{180, 200};
  double turn = 1.5, zoom = 0.784;  ///< [degrees], share of the picture
  double bend = 0.04;               ///< of a place's distance from the middle, in the corners of the cells
  std::string mosaic = {};          ///< then 3 channels
  bool misled = false;              ///< the light of each seventh cell comes mostly from another one

  /// Where a place on the cells lies on the picture; both in shares.
  std::pair<double, double> place(double u, double v) const {
    const double x = (u - 0.5) * camera.cols * zoom, y = (v - 0.5) * camera.rows * zoom;
    const double angle = turn * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
    const double grow = 1 + bend * 2 * ((u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5));
    return {0.5 + grow * (c * x - s * y) / camera.cols, 0.5 + grow * (s * x + c * y) / camera.rows};
  }

  /// The cell that a pixel looks at, or −1.
  std::int32_t looks_at(double x, double y) const {
    const double angle = turn * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
    const double across = (x - 0.5) * camera.cols, down = (y - 0.5) * camera.rows;
    const double du = (c * across + s * down) / camera.cols / zoom,
                 dv = (c * down - s * across) / camera.rows / zoom;
    double u = 0.5, v = 0.5;
    for (int k = 0; k < 60; ++k) {
      const double grow = 1 + bend * 2 * ((u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5));
      u = 0.5 + du / grow;
      v = 0.5 + dv / grow;
    }
    const bool in = u >= 0 && v >= 0 && u < 1 && v < 1;
    return in ? static_cast<int>(v * cells.rows) * cells.cols + static_cast<int>(u * cells.cols) : -1;
  }

  /// The pixels of each cell have light of the 3 x 3 cells around it.
  CameraTransport::Parts parts() const {
    CameraTransport::Parts parts;
    parts.cells = BlockTree(cells);
    parts.camera = camera;
    parts.channels = mosaic.empty() ? 1 : 3;
    parts.mosaic = mosaic;
    std::map<std::pair<int, std::int32_t>, std::vector<std::int32_t>> pixels;  // channel and cell
    for (int row = 0; row < camera.rows; ++row)
      for (int col = 0; col < camera.cols; ++col) {
        const std::int32_t cell = looks_at((col + 0.5) / camera.cols, (row + 0.5) / camera.rows);
        const char filter = mosaic.empty() ? 'R' : mosaic[2 * (row % 2) + col % 2];
        if (cell >= 0)
          pixels[{static_cast<int>(std::string("RGB").find(filter)), cell}].push_back(row * camera.cols +
                                                                                      col);
      }
    for (const auto& [of, some] : pixels) add_group(of.first, of.second, some, parts);
    return parts;
  }

 private:
  void add_group(int channel, std::int32_t cell, const std::vector<std::int32_t>& pixels,
                 CameraTransport::Parts& parts) const {
    const int row = cell / cells.cols, col = cell % cells.cols;
    std::int32_t columns = 0;
    for (int y = std::max(row - 1, 0); y <= std::min(row + 1, cells.rows - 1); ++y)
      for (int x = std::max(col - 1, 0); x <= std::min(col + 1, cells.cols - 1); ++x, ++columns) {
        const bool direct = y == row && x == col;
        parts.columns.push_back(-1 - (y * cells.cols + x));
        parts.middles.push_back(tensor::to_half(direct == (misled && cell % 7 == 0) ? 0.125F : 0.5F));
        parts.steps.push_back(tensor::to_half(0x1p-10F));
      }
    parts.groups.push_back({channel, columns, static_cast<std::int32_t>(pixels.size())});
    for (const std::int32_t pixel : pixels) {
      parts.pixels.push_back(pixel);
      parts.brightness.push_back(0.25F + 0.0625F * static_cast<float>(pixel % 11 + channel));
      for (std::int32_t k = 0; k < columns; ++k)
        parts.codes.push_back(static_cast<std::int8_t>((pixel * 7 + k * 5) % 61 - 30));
    }
  }
};

}  // namespace symrig::test
