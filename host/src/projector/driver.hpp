// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/table_reader.hpp"
#include "symrig/projector/placement.hpp"
#include "symrig/projector/projector.hpp"

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace symrig::projector {

/// What a rig knows of its projector, whatever the driver.
struct ScreenFacts {
  Placement placement;
  CodeTable codes;
  Nanoseconds refresh;           ///< period of its pictures, where it cannot tell by itself
  std::filesystem::path folder;  ///< of the rig file: paths count from here
};

/// Which projector, and how it is set up: the keys of `[projector]` that a driver has for itself. Immutable.
class ProjectorSource {
 public:
  ProjectorSource() = default;
  ProjectorSource(const ProjectorSource&) = delete;
  ProjectorSource& operator=(const ProjectorSource&) = delete;
  virtual ~ProjectorSource() = default;

  /// Opens the projector for patterns of that grid; may be called again after it was lost.
  /// fails: as the driver's projector.
  virtual Result<std::unique_ptr<Projector>> open(const ScreenFacts& screen, Grid grid) const = 0;
  /// Of the projector that open() gives: by trigger, the board needs a line to it.
  virtual Pacing pacing() const = 0;
  /// What photographs depend on, in one line. The photograph log compares it: never change an old one's text.
  virtual std::string identity(const Placement& placement) const = 0;
};

/// A kind of projector: what `[projector] driver = "NAME"` of a rig file chooses.
struct ProjectorDriver {
  std::string_view name;
  std::string_view about;  ///< one line
  std::string_view key;    ///< a key that only this driver has: it chooses the driver where none is named
  /// Takes its own keys. What is wrong goes to the reader's context.
  std::unique_ptr<ProjectorSource> (*read)(base::TableReader& table);
};

/// All drivers.
std::span<const ProjectorDriver> projector_drivers();

/// The driver of a table that names none: by the keys that it has, else the first.
const ProjectorDriver* usual_driver(const base::TableReader& table);

}  // namespace symrig::projector
