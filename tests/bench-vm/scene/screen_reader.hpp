// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/screen_timeline.hpp"
#include "symrig/base/fd.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace symrig::bench_vm {

/// Where the projector grid is on the screen: cell × cell screen pixels a grid pixel, its first one at
/// (top, left).
struct Placement {
  Grid grid;
  int cell = 1;
  int top = 0;
  int left = 0;
};

/// Screen pixels as XRGB8888 in memory.
struct ScanoutPixels {
  const std::byte* first = nullptr;
  std::size_t pitch = 0;  ///< bytes a row
  int rows = 0;
  int cols = 0;
};

/// The light of each grid pixel: mean of its cell's codes, all three colours, over 255. A pixel whose cell
/// reaches over the border of the screen gets what is on the screen.
Image<float> light_on_grid(const ScanoutPixels& pixels, const Placement& placement);
/// A number that changes if the middle of any cell does: to look whether it is worth looking.
std::uint64_t glance(const ScanoutPixels& pixels, const Placement& placement);

/// A refresh of the screen.
struct Refresh {
  std::uint64_t number = 0;
  Nanoseconds begin{};
};

/// Looks at what a display scans out while another process drives it. Needs root.
class ScreenReader {
 public:
  /// fails: io, not_found (a card without a screen).
  static Result<ScreenReader> open(const std::string& card, const Placement& placement);
  ScreenReader(ScreenReader&& other) noexcept;
  ScreenReader& operator=(ScreenReader&&) = delete;
  ~ScreenReader();

  /// Waits for the next refresh.  fails: device_lost (the screen is off).
  Result<Refresh> wait_refresh() const;
  /// What is scanned out now; nullptr: nothing.
  Picture look();

 private:
  ScreenReader(Fd card, std::uint32_t crtc, const Placement& placement)
      : card_(std::move(card)), crtc_(crtc), placement_(placement) {}
  void unmap();
  bool map(std::uint32_t framebuffer);

  Fd card_;
  std::uint32_t crtc_;
  Placement placement_;
  std::uint32_t framebuffer_ = 0;
  std::size_t mapped_ = 0;
  ScanoutPixels pixels_;
  std::uint64_t glance_ = 0;
  Picture picture_;
};

}  // namespace symrig::bench_vm
