// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig::bench_vm {

/// A picture on the screen: grid values in [0, 1]. nullptr: no picture, not even the black level.
using Picture = std::shared_ptr<const Image<float>>;

/// Records which pattern was on the screen at which time. Not thread-safe.
class ScreenTimeline {
 public:
  /// A pattern, and the share of an exposure in which it was lit.
  struct Lit {
    std::uint64_t number = 0;  ///< number of pictures before it
    Picture pattern;
    double share = 0;
  };

  /// This picture is on the screen from `since` on. Call it in order of time. Returns true if the picture
  /// differs from the previous one.
  bool change(Nanoseconds since, Picture pattern);
  /// The pictures on the screen during [begin, end), begin < end. Shares sum to 1, or to less if there was no
  /// picture for a while. A picture that was shown twice appears twice.
  std::vector<Lit> during(Nanoseconds begin, Nanoseconds end) const;
  /// The picture on the screen at this time.
  Picture at(Nanoseconds time) const;
  /// When pictures began, within (begin, end).
  std::vector<Nanoseconds> changes_within(Nanoseconds begin, Nanoseconds end) const;
  /// Forgets pictures that ended before this time.
  void forget_before(Nanoseconds time);
  /// The newest picture and its number; nullptr before the first.
  Lit newest() const;

 private:
  struct Change {
    Nanoseconds since;
    std::uint64_t number;
    Picture pattern;
  };
  std::deque<Change> changes_;
  std::uint64_t shown_ = 0;
};

/// The screens of several projectors, side by side: their pictures together light the scene. Their refreshes
/// come at different times, so each has a timeline of its own. Not thread-safe.
class JoinedScreens {
 public:
  /// screens: from left to right.
  explicit JoinedScreens(std::size_t screens) : screens_(screens) {}

  /// As ScreenTimeline::change, for one screen.
  bool change(std::size_t screen, Nanoseconds since, Picture pattern);
  /// As ScreenTimeline::during, of the joined pictures. A screen that is off is dark beside one that is on.
  std::vector<ScreenTimeline::Lit> during(Nanoseconds begin, Nanoseconds end);
  void forget_before(Nanoseconds time);
  /// The newest joined picture and its number; nullptr before the first.
  ScreenTimeline::Lit newest();

 private:
  struct Joined {
    std::vector<Picture> parts;
    std::uint64_t number;
    Picture pattern;
  };
  ScreenTimeline::Lit join(const std::vector<Picture>& parts);

  std::vector<ScreenTimeline> screens_;
  std::deque<Joined> joined_;  // the last ones
  std::uint64_t made_ = 0;
};

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

/// The sequence that a controller shows in each refresh. Its trigger outputs are wired to the lines `plane`
/// (an edge at each plane) and `vsync` (an edge before the first plane).
struct ShownSequence {
  std::vector<int> planes;    ///< numbers of the bits, in order
  Nanoseconds period{0};      ///< from plane to plane
  Nanoseconds exposure{0};    ///< how long a plane is bright
  Nanoseconds frame_lead{0};  ///< from the frame trigger to the first plane
  bool frames_all = false;    ///< the frame trigger lasts to the end of the last plane, not only a pulse
};

/// The middle pixel of each cell, 0x00RRGGBB.
std::vector<std::uint32_t> cell_words(const ScanoutPixels& pixels, const Placement& placement);
/// The bit of a word that is plane `number` of a controller: G0 to G7, R0 to R7, B0 to B7.
int bit_of(int number);

/// Light and its begin.
using Change = std::pair<Nanoseconds, Picture>;
/// What is bright from `start` on, the begin of the first plane, until the next refresh.
std::vector<Change> light_of_planes(std::span<const std::uint32_t> words, Grid grid,
                                    const ShownSequence& sequence, Nanoseconds start);

/// A level of a trigger output.
struct TriggerEdge {
  enum class Line : std::uint8_t { frame, plane };
  Nanoseconds at{0};
  Line line = Line::plane;
  bool high = false;
};
/// The edges of a refresh whose first plane begins at `start`, in order of time.
std::vector<TriggerEdge> edges_of_refresh(const ShownSequence& sequence, Nanoseconds start);

}  // namespace symrig::bench_vm
