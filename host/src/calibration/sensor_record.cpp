// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/sensor_record.hpp"

#include "base/duration.hpp"
#include "symrig/base/atomic_file.hpp"

#include <cstddef>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;

/// Two bytes a code, the low one first: V4L2's Y16 on every machine.
std::vector<std::byte> bytes_of(std::span<const std::uint16_t> codes) {
  std::vector<std::byte> bytes;
  bytes.reserve(2 * codes.size());
  for (const std::uint16_t code : codes) {
    bytes.push_back(static_cast<std::byte>(code & 0xFFU));
    bytes.push_back(static_cast<std::byte>(code >> 8U));
  }
  return bytes;
}

}  // namespace

Result<SensorRecord> SensorRecord::make(fs::path folder, Grid grid, int bits) {
  std::error_code error;
  if (fs::exists(folder / "capture.toml", error))
    return Error{ErrorCode::bad_argument, fmt::format("{} has a capture.toml already", folder.string()),
                 "give a new folder: it may describe other photographs"};
  return SensorRecord(std::move(folder), fmt::format("# Frames of a sensor's measurement: docs/sensor.md\n"
                                                     "symrig = 1\n\n"
                                                     "[raw]\nformat = \"Y16\"\nsize = \"{}x{}\"\nbits = {}\n"
                                                     "justified = \"low\"\n\n[sensor]\nlight = \"scene\"\n",
                                                     grid.cols, grid.rows, bits));
}

void SensorRecord::end_level() {
  if (frames_ > 0) text_ += fmt::format("files = [{}]\n", files_);
  files_.clear();
  frames_ = 0;
}

Result<void> SensorRecord::begin(const SceneLevel& level) {
  std::error_code error;
  if (!fs::is_directory(folder_, error) && !fs::create_directory(folder_, error))
    return Error{ErrorCode::io, fmt::format("{}: {}", folder_.string(), error.message()),
                 "give a folder that can be made"};
  end_level();
  name_ = fmt::format("{}{:02}", level.lit ? "lit" : "dark", levels_++);
  text_ += fmt::format("\n[[sensor.{}]]\nexposure = \"{}\"\n", level.lit ? "flat" : "dark",
                       base::duration_text(level.exposure));
  return {};
}

Result<void> SensorRecord::add(std::span<const std::uint16_t> first, std::span<const std::uint16_t> second) {
  SYMRIG_CHECK(add(first));
  return add(second);
}

Result<void> SensorRecord::add(std::span<const std::uint16_t> codes) {
  const std::string file = fmt::format("{}-{:03}.raw", name_, frames_);
  files_ += fmt::format("{}\"{}\"", frames_ == 0 ? "" : ", ", file);
  ++frames_;
  return write_file_atomically(folder_ / file, bytes_of(codes));
}

Result<void> SensorRecord::finish() {
  end_level();
  return write_file_atomically(folder_ / "capture.toml", text_);
}

}  // namespace symrig
