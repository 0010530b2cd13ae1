// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/internal/table_reader.hpp"
#include "symrig/projector/projector.hpp"

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace symrig::projector {

/// What a rig knows about its projector, with any driver.
struct ScreenFacts {
  Placement placement;
  CodeTable codes;
  Nanoseconds refresh;           ///< refresh period, for drivers that cannot read it from the projector
  std::filesystem::path folder;  ///< of the rig file; relative paths start here
};

/// Selects a projector and its settings: the keys of `[projector]` that belong to one driver. Immutable.
class ProjectorSource {
 public:
  ProjectorSource() = default;
  ProjectorSource(const ProjectorSource&) = delete;
  ProjectorSource& operator=(const ProjectorSource&) = delete;
  virtual ~ProjectorSource() = default;

  /// Opens the projector for patterns of this grid. May be called again after device_lost.
  /// fails: as the driver's projector.
  virtual Result<std::unique_ptr<Projector>> open(const ScreenFacts& screen, Grid grid) const = 0;
  /// Pacing of the projector that open() returns. With Pacing::trigger, the board needs a line to it.
  virtual Pacing pacing() const = 0;
  /// true: the projector that open() returns shows bit planes (Projector::planes()). The board then needs a
  /// line for each of its two trigger outputs.
  virtual bool shows_planes() const { return false; }
  /// All settings that affect photographs, in one line. The photograph log compares this text, so the text of
  /// existing settings must never change.
  virtual std::string identity(const Placement& placement) const = 0;
};

/// A projector driver: `[projector] driver = "NAME"` in a rig file selects one. Its folder has the function
/// NAME_driver(), which returns this.
struct ProjectorDriver {
  std::string_view name;
  std::string_view about;  ///< one line
  std::string_view key;    ///< a key that only this driver has; selects the driver if none is named
  /// Reads the driver's own keys. Adds errors to the reader's context.
  std::unique_ptr<ProjectorSource> (*read)(base::TableReader& table);
};

/// All drivers.
std::span<const ProjectorDriver> projector_drivers();

/// The driver of a table without `driver`: the one whose key the table has, else the first one.
const ProjectorDriver* usual_driver(const base::TableReader& table);

}  // namespace symrig::projector
