// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/files.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/board/firmware_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;
constexpr std::string_view kBoardId = "Board-ID: RPI-RP2";

/// The kernel writes blanks and backslashes in paths as \ooo, three octal digits.
std::string unescape(const std::string& text) {
  std::string result;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const std::string digits = text[k] == '\\' ? text.substr(k + 1, 3) : "";
    const bool octal = digits.size() == 3 &&
                       std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '7'; });
    if (octal) k += 3;
    result += octal ? static_cast<char>((digits[0] - '0') * 64 + (digits[1] - '0') * 8 + (digits[2] - '0'))
                    : text[k];
  }
  return result;
}

Result<void> write_all(const Fd& file, std::span<const std::byte> bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0)
      return Error{ErrorCode::io,
                   fmt::format("{} cannot be written ({})", path.string(), std::strerror(errno)),
                   "unplug the board, plug it in with its BOOTSEL button held, and try again"};
    bytes = bytes.subspan(written);
  }
  return {};
}

}  // namespace

Result<void> check_boot_drive(const fs::path& folder) {
  std::error_code none;
  std::ifstream info;  // to open a pipe of that name would block until its other end is open
  if (fs::is_regular_file(folder / "INFO_UF2.TXT", none)) info.open(folder / "INFO_UF2.TXT");
  if (!info.is_open())
    return Error{ErrorCode::not_found,
                 fmt::format("{} is not a boot loader's drive: it has no INFO_UF2.TXT", folder.string()),
                 "hold the board's BOOTSEL button while you plug it in, and mount the drive RPI-RP2"};
  std::ostringstream text;
  text << info.rdbuf();
  if (text.str().find(kBoardId) != std::string::npos) return {};
  return Error{ErrorCode::bad_format,
               fmt::format("{} is the drive of another kind of board", folder.string()),
               "give the drive RPI-RP2"};
}

std::vector<fs::path> boot_drives(const fs::path& mounts) {
  std::vector<fs::path> drives;
  std::ifstream list(mounts);
  for (std::string line; std::getline(list, line);) {
    std::istringstream words(line);
    std::string device, folder, kind;
    words >> device >> folder >> kind;
    if (kind == "vfat" && check_boot_drive(unescape(folder))) drives.emplace_back(unescape(folder));
  }
  return drives;
}

Result<void> copy_to_boot_drive(const fs::path& uf2, const fs::path& drive) {
  SYMRIG_CHECK(check_boot_drive(drive));
  SYMRIG_TRY(const auto bytes, read_file(uf2));
  const fs::path path = drive / "symrig.uf2";
  SYMRIG_CHECK(JobFiles().reads("the firmware", uf2).writes("the copy", path, FileFormat::program).check());
  const Fd file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0644));
  if (!file)
    return Error{ErrorCode::io, fmt::format("{} cannot be written ({})", path.string(), std::strerror(errno)),
                 "mount the drive so that you may write to it"};
  SYMRIG_CHECK(write_all(file, bytes, path));
  ::fsync(file.get());
  return {};
}

}  // namespace symrig
