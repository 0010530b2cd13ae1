// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace symrig::bench_vm {

/// What a display shows: raster order, rows × cols, each 0x00RRGGBB.
struct ScreenPixels {
  std::uint32_t framebuffer = 0;  ///< the kernel's number of the buffer: another one after a page flip
  int rows = 0;
  int cols = 0;
  std::vector<std::uint32_t> rgb;
};

/// Copies what a display scans out while another process drives it, through that process's own framebuffer:
/// what the driver was given, before any colour pipeline of a real display. Works for vkms and for QEMU's
/// display. Needs root (the kernel gives the buffer's handle to nobody else). fails: not_found (no such card,
/// or nothing is on its screen), bad_format (not 32 bits a pixel), io.
Result<ScreenPixels> read_screen(const std::string& card);

/// How many pixels differ; all of them if the sizes do.
std::size_t differing_pixels(const ScreenPixels& a, const ScreenPixels& b);

/// A binary PPM with 8 bits a sample, as QEMU's screendump is.  fails: bad_format.
Result<ScreenPixels> parse_ppm(std::span<const std::byte> bytes);

}  // namespace symrig::bench_vm
