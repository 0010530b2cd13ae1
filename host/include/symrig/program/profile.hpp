// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// How a camera uses its trigger line.
enum class ExposureMode : std::uint8_t {
  trigger_width = 0,  ///< the camera exposes while the line is active
  timed = 1           ///< an edge starts an exposure; its length is set in the camera
};

/// A camera's timing, from a file in host/profiles or a file of the user.
struct CameraProfile {
  std::string name;
  ExposureMode mode = ExposureMode::trigger_width;
  bool active_low = false;
  Nanoseconds exposure_offset{0};   ///< trigger_width: exposure = pulse width + this
  Nanoseconds min_exposure{0};      ///< shortest exposure (not pulse)
  Nanoseconds trigger_pulse{0};     ///< timed: width of the pulse
  Nanoseconds trigger_delay{0};     ///< from the trigger to the exposure; its end is late by as much
  Nanoseconds readout{0};           ///< from the end of an exposure until the frame is read out
  bool overlap = false;             ///< it can expose while it reads out the last frame
  Nanoseconds overlap_time_max{0};  ///< with overlap: earliest trigger, as time before the end of a readout
  std::vector<std::string> notes;   ///< hints for the wiring
  std::vector<std::string> assumptions;  ///< keys whose numbers have no source
};

/// What tells the board that a pattern is on the screen.
enum class PatternSync : std::uint8_t {
  vsync = 0,    ///< the next rising edge of its vsync line
  trigger = 1,  ///< a stated time after the trigger
  plane =
      2  ///< the next rising edge of its plane line: a picture's bit planes follow each other by themselves
};

/// The shortest time for which a projector can show a pattern of this bit depth.
struct BitDepthLimit {
  int bits = 1;
  Nanoseconds time{0};
};

/// A projector's timing, from a file in host/profiles or a file of the user.
struct ProjectorProfile {
  std::string name;
  PatternSync sync = PatternSync::vsync;
  bool active_low = false;
  Nanoseconds advance_pulse{100'000};  ///< width of the pulse that requests the next pattern
  Nanoseconds refresh{0};              ///< period of its pictures; 0 = it has no period of its own
  Nanoseconds light_period{0};     ///< period of a lamp or wheel that makes white by pulses; 0 = steady light
  Nanoseconds vsync_timeout{0};    ///< the run ends after this long without a vsync
  Nanoseconds trigger_delay{0};    ///< sync = trigger: from the pulse to the pattern
  Nanoseconds black_insertion{0};  ///< black at the end of a pattern if the next one waits for a trigger
  Nanoseconds settle{0};           ///< from the pattern to the first exposure, at least
  int whole_refresh_from_bits = 0;  ///< patterns of this bit depth or more are made by pulses; 0 = none
  int planes = 0;                   ///< sync = plane: bit planes of a picture, shown again in every refresh
  Nanoseconds plane_period{0};      ///< from plane to plane
  Nanoseconds frame_lead{0};        ///< from the edge of the vsync line to plane 0
  std::vector<BitDepthLimit> min_exposure;  ///< by bit depth, ascending
  std::vector<std::string> notes;
  std::vector<std::string> assumptions;

  /// The limit for patterns of `bits`: that of the next depth in the list, or none.
  std::optional<BitDepthLimit> limit_for(int bits) const;
};

/// The folders that are searched for a profile's name, in this order: $SYMRIG_PROFILES, share/symrig/profiles
/// beside the program's own folder. After these come the profiles in the library.
std::vector<std::filesystem::path> profile_folders();

/// Names of the profiles in the library.
std::vector<std::string> builtin_profiles();

/// which: a name, or the path of a file (it contains a slash or ends in .toml; relative to `folder`).
/// fails: not_found (the message lists the known profiles), bad_format (file:line, key, legal values), io.
Result<CameraProfile> load_camera_profile(const std::string& which, const std::filesystem::path& folder);
Result<ProjectorProfile> load_projector_profile(const std::string& which,
                                                const std::filesystem::path& folder);

}  // namespace symrig
