// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"
#include "symrig/program/profile.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// What is connected to a line of the board.
enum class RigRole : std::uint8_t { projector, camera, lamp, vsync, strobe, interlock, general, plane };
std::string_view name(RigRole role);

/// A line of the board in a program file.
struct RigLine {
  LineConfig config;  ///< safe_level: the level that means "off", unless the file sets another
  RigRole role = RigRole::general;
  bool active_low = false;
  bool hazard_given = false;  ///< the file states the hazard
  bool capture_given =
      false;             ///< the file sets `capture`; else the board captures lines that the program uses
  Nanoseconds delay{0};  ///< its edges come this much later than in the program
  int place = 0;         ///< line of the file; 0: not in the file, a default
};

struct RigSetup {
  std::vector<RigLine> lines;
  CameraProfile camera;
  ProjectorProfile projector;
  Nanoseconds keep_alive{1'000'000'000};  ///< 0 = none
  int place = 0;
  int camera_place = 0;
  int projector_place = 0;

  /// The first line of that role, or nullptr.
  const RigLine* with_role(RigRole role) const;
  const RigLine* find(std::string_view line) const;
  /// The name of the line of that role; none: "".
  std::string line_name(RigRole role) const;
  /// Is the line of that role on when it is low?
  bool is_active_low(RigRole role) const;
  /// The same rig with the role taken from its lines: they have none.
  RigSetup without(RigRole role) const;
};

/// The lines of a board that calls them as boards usually do, a projector of 60 Hz and a camera that reads
/// out in 4 ms: what a rig is without a file.
RigSetup default_rig_setup();

/// The wiring that a simulated rig needs.
struct RigWiring {
  std::string projector, vsync, camera, strobe;  ///< lines; empty: none
  std::vector<std::string> active_low;           ///< lines that are on when low
  Nanoseconds refresh{0};                        ///< of the projector; 0 = it has no refresh of its own
  Nanoseconds readout{3'000'000};  ///< of the camera: from the end of an exposure to the next trigger

  bool is_active_low(std::string_view line) const;
};
RigWiring wiring_of(const RigSetup& rig);

/// Patterns with the same properties.
struct PatternGroup {
  std::string name = {};
  std::uint64_t count = 1;
  int bits = 1;
  std::vector<Nanoseconds> bracket = {};  ///< its own exposures; empty: the scan's
  int place = 0;
};

enum class ScanOrder : std::uint8_t { pattern_outer, bracket_outer };
enum class Advance : std::uint8_t { each_pattern, each_exposure };

/// The first pulse of each sequence on a line is longer by `stretch`. So one wire shows where the sequence
/// begins.
struct StartMarker {
  std::string line;
  Nanoseconds stretch{0};
  int place = 0;
};

/// Exposures before the first pattern: many cameras drop their first frames, or send additional ones.
struct StartupPulses {
  std::uint64_t pulses = 0;
  Nanoseconds exposure{0};
  int place = 0;
};

/// An exposure in the bit planes of one or more pictures.
struct PlaneExposure {
  std::int64_t refresh = 0;  ///< counted from the first refresh of the run
  int plane = 0;             ///< it begins in this plane
  int planes = 1;            ///< planes with its pattern, from `plane` on, also those of the next refreshes
  Nanoseconds exposure{0};   ///< of the shutter, with the dark time between refreshes
};

/// Patterns and a bracket: pattern → settle → (expose → readout) x k.
struct Scan {
  std::vector<PatternGroup> patterns;
  std::vector<Nanoseconds> bracket;
  ScanOrder order = ScanOrder::pattern_outer;
  Advance advance = Advance::each_pattern;
  std::optional<Nanoseconds> settle;  ///< none: the projector's
  std::optional<Nanoseconds> gap;     ///< from an exposure to the next trigger; none: the shortest legal one
  std::optional<Nanoseconds>
      on_time;  ///< how long a triggered projector shows a pattern; none: the linter reports it
  std::uint64_t repeat = 1;
  OnTimeout on_timeout = OnTimeout::abort;
  std::string lamp;  ///< line that is on from each pattern to the end of its last exposure; empty: none
  std::optional<StartMarker> start_marker;
  std::optional<StartupPulses> startup;
  /// Made by a capture, which knows what is wired: without a projector line no pattern is asked for, without
  /// a vsync line nothing is waited for. A scan of a file needs both.
  bool lines_as_wired = false;
  /// Also made by a capture: exposures in bit planes, in order of time. Each stands for a pattern with a
  /// bracket of its own.
  std::vector<PlaneExposure> plane_exposures = {};
  int place = 0;
  int bracket_place = 0;
  int settle_place = 0;
  int gap_place = 0;
  int on_time_place = 0;
  int lamp_place = 0;

  std::uint64_t pattern_count() const;
  /// The exposures of each pattern of a group of this scan.
  const std::vector<Nanoseconds>& bracket_of(const PatternGroup& group) const {
    return group.bracket.empty() ? bracket : group.bracket;
  }
};

/// A step of a program with steps.
struct FileStep {
  enum class Kind : std::uint8_t { set, hold, pulse, wait, mark, loop, pattern, expose };

  Kind kind = Kind::hold;
  std::string line;     ///< set, pulse, wait
  bool on = false;      ///< set: to the line's active level
  Nanoseconds time{0};  ///< hold, pulse (width), wait (time-out), expose (exposure)
  EdgeKind edge = EdgeKind::rising;
  OnTimeout on_timeout = OnTimeout::abort;
  std::uint64_t count = 0;      ///< loop (rounds), mark (id)
  std::vector<FileStep> steps;  ///< loop
  int place = 0;
};

/// True if such a step exists, inside or outside of loops.
bool has_step(const std::vector<FileStep>& steps, FileStep::Kind kind);

/// A program file of the user: docs/howto-programs.md.
struct ProgramFile {
  std::string path;  ///< for messages
  RigSetup rig;
  std::optional<Scan> scan;     ///< either a scan
  std::vector<FileStep> steps;  ///< or steps
};

inline constexpr std::uint64_t kMaxRounds = std::uint64_t{1} << 32U;

/// fails: not_found, io; bad_format: "scan.toml:12: key: the problem; the legal values".
Result<ProgramFile> read_program_file(const std::filesystem::path& path);

/// The same from text. Paths of profiles are relative to `folder`.
Result<ProgramFile> parse_program_file(std::string_view text, const std::string& name,
                                       const std::filesystem::path& folder);

}  // namespace symrig
