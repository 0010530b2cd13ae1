// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/screen_timeline.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace symrig::bench_vm {

/// Where the projector grid is on the screen: cell × cell screen pixels per grid pixel, the first one at
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
  std::size_t pitch = 0;  ///< bytes per row
  int rows = 0;
  int cols = 0;
};

/// The light of each grid pixel: the mean of its cell's codes over all three colours, divided by 255. For a
/// cell that reaches beyond the screen, the mean of the visible part.
Image<float> light_on_grid(const ScanoutPixels& pixels, const Placement& placement);
/// A checksum of the middle pixels of all cells. If it changes, the picture must be read again.
std::uint64_t cell_checksum(const ScanoutPixels& pixels, const Placement& placement);

/// A refresh of the screen.
struct Refresh {
  std::uint64_t number = 0;
  Nanoseconds begin{};
};

/// Reads the picture that a display scans out while another process drives it. Needs root.
class ScreenReader {
 public:
  /// fails: io, not_found (a card without a screen).
  static Result<ScreenReader> open(const std::string& card, const Placement& placement);
  ScreenReader(ScreenReader&& other) noexcept;
  ScreenReader& operator=(ScreenReader&&) = delete;
  ~ScreenReader();

  /// Waits for the next refresh.  fails: device_lost (the screen is off).
  Result<Refresh> wait_refresh() const;
  /// The picture that is scanned out now. nullptr: none.
  Picture read();
  /// Its pixels, until the next call. nullptr: none.
  const ScanoutPixels* scanned_out();

 private:
  ScreenReader(Fd card, std::uint32_t crtc, const Placement& placement)
      : card_(std::move(card)), crtc_(crtc), placement_(placement) {}
  void unmap();
  bool follow_framebuffer();
  bool map(std::uint32_t framebuffer);

  Fd card_;
  std::uint32_t crtc_;
  Placement placement_;
  std::uint32_t framebuffer_ = 0;
  std::size_t mapped_ = 0;
  ScanoutPixels pixels_;
  bool mapped_anew_ = false;  // by the last look at the screen
  std::uint64_t glance_ = 0;
  Picture picture_;
};

}  // namespace symrig::bench_vm
