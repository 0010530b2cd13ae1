// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace symrig::bench_vm {

/// The pixels of a display: raster order, rows × cols, each 0x00RRGGBB.
struct ScreenPixels {
  std::uint32_t framebuffer = 0;  ///< the kernel's number of the buffer; it changes with a page flip
  int rows = 0;
  int cols = 0;
  std::vector<std::uint32_t> rgb;
};

/// Copies the framebuffer that a display scans out while another process drives it. This is the driver's
/// input, before the colour pipeline of a real display. Works for vkms and for QEMU's display. Needs root,
/// because the kernel gives the buffer's handle to no other user.
/// fails: not_found (no such card, or an empty screen), bad_format (not 32 bits per pixel), io.
Result<ScreenPixels> read_screen(const std::string& card);

/// The number of pixels that differ. All of them if the sizes differ.
std::size_t differing_pixels(const ScreenPixels& a, const ScreenPixels& b);

/// Reads a binary PPM with 8 bits per sample, such as QEMU's screendump.
/// fails: bad_format.
Result<ScreenPixels> parse_ppm(std::span<const std::byte> bytes);

}  // namespace symrig::bench_vm
