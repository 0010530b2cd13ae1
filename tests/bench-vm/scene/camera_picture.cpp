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
  if (top >= 0 && left >= 0 && top + camera.rows <= picture.rows && left + camera.cols <= picture.cols)
    return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("a camera of {} at row {}, column {} is not inside a picture of {}",
                           to_string(camera), top, left, to_string(picture)),
               "give a larger --picture"};
}

std::vector<std::uint8_t> CameraPicture::bytes(std::span<const std::uint16_t> codes) const {
  const std::size_t pixels = picture.size();
  std::vector<std::uint8_t> bytes(2 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) put(bytes, i, dark);
  std::size_t i = 0;
  for (int row = 0; row < camera.rows; ++row)
    for (int col = 0; col < camera.cols; ++col)
      put(bytes, static_cast<std::size_t>(top + row) * picture.cols + left + col, codes[i++]);
  return bytes;
}

}  // namespace symrig::bench_vm
