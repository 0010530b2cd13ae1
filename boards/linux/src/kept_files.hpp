// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/peripherals.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

namespace symrig::board_linux {

/// The stored configuration and label. The file is always replaced as a whole. Writing to a memory card can
/// take seconds, so `before` is called before and `after` after it.
class SettingsFile final : public hal::Settings {
 public:
  using Call = std::function<void()>;
  explicit SettingsFile(std::filesystem::path path, Call before = {}, Call after = {})
      : path_(std::move(path)), before_(std::move(before)), after_(std::move(after)) {}
  std::size_t load(std::uint8_t* out, std::size_t room) const override;
  bool save(const std::uint8_t* bytes, std::size_t size) override;

 private:
  std::filesystem::path path_;
  Call before_, after_;
};

/// The last fault, in the run folder. It survives the daemon, but not a power cycle.
class FaultFile final : public hal::FaultStore {
 public:
  explicit FaultFile(std::filesystem::path path) : path_(std::move(path)) {}
  hal::FaultRecord load() const override;
  void save(const hal::FaultRecord& record) override;

 private:
  std::filesystem::path path_;
};

/// Finds out how the previous daemon ended.
class RunMark {
 public:
  explicit RunMark(std::filesystem::path path) : path_(std::move(path)) {}
  /// Returns watchdog if the previous daemon was killed or crashed. Returns power if it ended normally or is
  /// the first since boot. Then records that this daemon is running.
  hal::ResetCause begin();
  void end_well();

 private:
  std::filesystem::path path_;
};

/// The present safe levels. `symrigd --safe` reads them after a daemon was killed.
class SafeLevelsFile {
 public:
  explicit SafeLevelsFile(std::filesystem::path path) : path_(std::move(path)) {}
  std::optional<std::uint32_t> load() const;
  bool save(std::uint32_t levels) const;

 private:
  std::filesystem::path path_;
};

}  // namespace symrig::board_linux
