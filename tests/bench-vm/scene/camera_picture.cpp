// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/camera_picture.hpp"

#include <fmt/format.h>

namespace symrig::bench_vm {

namespace {

void put(std::vector<std::uint8_t>& bytes, std::size_t pixel, std::uint16_t code) {
  bytes[2 * pixel] = static_cast<std::uint8_t>(code & 0xffU);
  bytes[2 * pixel + 1] = static_cast<std::uint8_t>(code >> 8U);
}

}  // namespace

Result<void> CameraPicture::check() const {
  if (top >= 0 && left >= 0 && top + grid.rows <= camera.rows && left + grid.cols <= camera.cols) return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("a grid of {} at row {}, column {} is not inside a picture of {}", to_string(grid),
                           top, left, to_string(camera)),
               "give a larger --camera"};
}

std::vector<std::uint8_t> CameraPicture::bytes(std::span<const std::uint16_t> codes) const {
  const std::size_t pixels = camera.size();
  std::vector<std::uint8_t> picture(2 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) put(picture, i, dark);
  std::size_t i = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      put(picture, static_cast<std::size_t>(top + row) * camera.cols + left + col, codes[i++]);
  return picture;
}

}  // namespace symrig::bench_vm
