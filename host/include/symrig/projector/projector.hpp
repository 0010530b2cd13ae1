// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/clock_model.hpp"
#include "symrig/image/image.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// What advances a projector to its next pattern.
enum class Pacing : std::uint8_t {
  trigger,  ///< its trigger line: the pattern changes at the first refresh after the rising edge
  host      ///< show(): the pattern is a picture on a screen of this computer
};

/// When a pattern appeared on the screen.
struct Shown {
  std::uint64_t refresh = 0;  ///< the display's refresh count when the pattern appeared
  SteadyTime since;           ///< when the scan-out of that refresh began
  /// false: the display does not count refreshes. Then `refresh` counts calls of show(), and `since` is the
  /// time when the display got the picture.
  bool counted = true;
};

/// A plane of a picture that shows no pattern.
inline constexpr int kBlackPlane = -1;

/// The pattern of each bit plane of a picture: its index, or kBlackPlane.
using PlanePlan = std::vector<int>;

/// How a projector shows the bit planes of a picture: one after the other, again in every refresh.
struct PlaneTiming {
  int planes = 0;           ///< in each picture; 0: the projector shows whole pictures
  Nanoseconds period{0};    ///< from plane to plane
  Nanoseconds exposure{0};  ///< how long a plane is bright; equal to the period: no dark time between planes
  Nanoseconds frame_lead{0};  ///< its frame trigger comes this long before the trigger of plane 0
  int latency = 1;            ///< refreshes from the scan-out of a picture to its planes
};

/// A picture that appeared on the screen while the projector played.
struct ShownPicture {
  std::size_t picture = 0;  ///< its index in the loaded pictures
  Shown shown;
};

/// A projector that holds a sequence of patterns and shows one of them at a time. Not thread-safe.
class Projector {
 public:
  Projector() = default;
  Projector(const Projector&) = delete;
  Projector& operator=(const Projector&) = delete;
  virtual ~Projector() = default;

  virtual Grid grid() const = 0;
  virtual Nanoseconds refresh_period() const = 0;
  virtual Pacing pacing() const { return Pacing::trigger; }
  /// Loads a sequence. With Pacing::trigger, the first pattern appears after the first trigger. The patterns
  /// stay loaded until the next load().
  /// fails: size_mismatch, device_lost.
  virtual Result<void> load(std::span<const Pattern> patterns) = 0;
  /// Pacing::host only. Shows the loaded pattern `index`, and returns when its first refresh has begun.
  /// fails: bad_argument (no such pattern, or Pacing::trigger), device_lost (unplugged).
  virtual Result<Shown> show(std::size_t index);
  /// Projectors that show bit planes are paced by the host.
  virtual PlaneTiming planes() const { return {}; }
  /// Only if planes().planes > 0. Loads one picture for each plan: plane k of picture f shows the pattern
  /// plans[f][k]. show(f) then shows picture f.
  /// fails: size_mismatch, bad_value (a pattern has values other than 0 and 1), bad_argument (the projector
  /// has no planes, or a plan has more planes than a picture or names no pattern), device_lost.
  virtual Result<void> load_planes(std::span<const Pattern> patterns, std::span<const PlanePlan> plans);
  /// Only if planes().planes > 0. Shows one loaded picture after the other: order[k] in the refresh k after
  /// the first one. Returns when the refresh of order[0] has begun, and goes on meanwhile. A picture that
  /// comes too late for its refresh is not made up for: the next refresh has its own picture again. The last
  /// picture stays. No other call but played() and check() is allowed before played(). fails: as show().
  virtual Result<Shown> play(std::span<const std::size_t> order);
  /// Waits until play() has shown its last picture. Returns the pictures that have appeared, order[0] first,
  /// with their refreshes. fails: as show(), also for a picture in the middle.
  virtual Result<std::vector<ShownPicture>> played();
  /// Only if planes().planes > 0. The setting with which plane k would be what is now in its place, plane
  /// seen[k]: "projector.plane_order = \"RGB\"". Empty: there is none.
  virtual std::string setting_for_planes(std::span<const int> seen) const;
  /// What a user must know of its settings, one line each.
  virtual std::vector<std::string> warnings() const { return {}; }
  /// Checks that the projector still does what it was set to. fails: device_lost.
  virtual Result<void> check() { return {}; }
  /// One line for reports.
  virtual std::string describe() const = 0;
};

/// Where a pattern lies on a screen. Each pattern pixel becomes a square of exactly cell × cell screen
/// pixels:
///   screen(top + cell·r + i, left + cell·c + j) = pattern(r, c),  0 ≤ i, j < cell.
/// Other screen pixels stay black. Nothing is scaled. Mirroring then flips the whole screen, for rear
/// projection (mirror_cols) or a projector that hangs from the ceiling (both).
struct Placement {
  int cell = 1;  ///< screen pixels per pattern pixel, in both directions
  int top = 0;   ///< screen row of the pattern's first row
  int left = 0;  ///< screen column of the pattern's first column
  bool mirror_rows = false;
  bool mirror_cols = false;
};

/// The grid of patterns on a screen: `asked`, or else as many whole cells as fit.
/// fails: bad_argument (cell below 1, negative offset), size_mismatch (does not fit).
Result<Grid> placed_grid(Grid screen, const Placement& placement, std::optional<Grid> asked = {});

/// Converts light to the projector's 8-bit codes. Without a measured response, light is proportional to the
/// code: code = ⌊255·v + ½⌋. 0 and 1 are always the codes 0 and 255, so binary patterns are exact.
class CodeTable {
 public:
  CodeTable() = default;
  /// light: the measured light at each of the 256 codes, in any unit, never decreasing. A value v gets the
  /// code whose light is nearest to l(0) + v·(l(255) − l(0)). Of two equally near codes, it gets the lower
  /// one.
  /// fails: bad_argument (not 256 values), bad_value (not finite, decreasing, or constant).
  static Result<CodeTable> from_light(std::span<const double> light);

  /// v in [0, 1].
  std::uint8_t code(float v) const;
  bool measured() const { return !light_.empty(); }

 private:
  std::vector<double> light_;  // scaled from 0 to 1; empty: proportional
};

/// The codes of a pattern, grid × 1. number: the pattern's index in its sequence, for the error message.
/// fails: size_mismatch (another grid, or not one channel), bad_value (outside [0, 1] or NaN).
Result<Image<std::uint8_t>> to_codes(const Pattern& pattern, Grid grid, const CodeTable& table,
                                     std::size_t number);

/// A picture in graphics memory: rows of 0x00RRGGBB words. `pitch` is the distance between rows in words.
struct ScreenMemory {
  std::span<std::uint32_t> words;
  std::size_t pitch = 0;
  Grid grid;
};

/// Writes every pixel of the screen: codes as grey (R = G = B) at the placement, and black elsewhere. codes
/// must fit (placed_grid). Writes the memory in order and never reads it.
void draw(const Image<std::uint8_t>& codes, const Placement& placement, const ScreenMemory& screen);
/// The same with a word for each pattern pixel instead of a grey code.
void draw(const Image<std::uint32_t>& words, const Placement& placement, const ScreenMemory& screen);
/// The same as 8-bit codes with one channel.
Image<std::uint8_t> draw(const Image<std::uint8_t>& codes, const Placement& placement, Grid screen);

}  // namespace symrig
