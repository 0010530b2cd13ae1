// SPDX-License-Identifier: Apache-2.0
#include "find_lines.hpp"

#include "libgpiod/chip_lines.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/stat.h>

namespace symrig::board_linux {
namespace {

namespace fs = std::filesystem;

/// Where a named line was found.
struct Place {
  std::string chip;  ///< path
  std::uint32_t offset = 0;
};

std::vector<fs::path> chip_paths() {
  std::vector<fs::path> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/dev", ignored))
    if (entry.path().filename().string().starts_with("gpiochip")) found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

std::string group_of(const fs::path& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0) return "?";
  std::array<char, 4096> room{};
  group entry{};
  group* found = nullptr;
  ::getgrgid_r(about.st_gid, &entry, room.data(), room.size(), &found);
  return found != nullptr ? found->gr_name : std::to_string(about.st_gid);
}

Error no_right(const fs::path& chip) {
  const std::string group = group_of(chip);
  return {ErrorCode::device_refused, fmt::format("no permission to open {}", chip.string()),
          group == "root" ? "install symrig's udev rules, which give the chips to group 'gpio'"
                          : fmt::format("run as a member of group '{}'", group)};
}

/// All named lines of the chips that can be opened.
class Directory {
 public:
  Result<void> read() {
    const auto paths = chip_paths();
    if (paths.empty())
      return Error{ErrorCode::not_found, "this computer has no GPIO chip",
                   "load its driver; gpiodetect lists the chips"};
    for (const fs::path& path : paths) SYMRIG_CHECK(read_chip(path));
    return {};
  }

  Result<Place> find(const BoardLine& wanted) const {
    const auto [first, last] = lines_.equal_range(wanted.gpio);
    if (first == last) return missing(wanted);
    if (std::next(first) != last)
      return Error{ErrorCode::unknown_name,
                   fmt::format("several GPIO lines are called '{}' ({} and {})", wanted.gpio,
                               first->second.chip, std::next(first)->second.chip),
                   "rename one in the device tree (gpio-line-names)"};
    return first->second;
  }

 private:
  Result<void> read_chip(const fs::path& path) {
    const auto lines = chip_lines(path.string());
    if (!lines && (errno == EACCES || errno == EPERM)) {
      shut_ = path;
      return {};
    }
    if (!lines) return Error{ErrorCode::io, fmt::format("{}: {}", path.string(), std::strerror(errno)), ""};
    std::uint32_t offset = 0;
    for (const LineInfo& line : *lines) {
      if (!line.name.empty()) lines_.emplace(line.name, Place{path.string(), offset});
      ++offset;
    }
    return {};
  }

  /// The line may be on a chip that this user may not open.
  Error missing(const BoardLine& wanted) const {
    if (!shut_.empty()) return no_right(shut_);
    return {ErrorCode::unknown_name,
            fmt::format("no GPIO line is called '{}' (the board's '{}')", wanted.gpio, wanted.name),
            "gpioinfo lists them; correct the name in board.toml"};
  }

  std::multimap<std::string, Place> lines_;
  fs::path shut_;
};

/// The reason why the kernel refused these lines.
Error refused(const std::string& path, const std::vector<ChipLine>& lines,
              const std::vector<BoardLine>& names, const Error& cause) {
  const auto known = chip_lines(path).value_or(std::vector<LineInfo>());
  for (const ChipLine& one : lines) {
    if (one.offset >= known.size() || !known[one.offset].used) continue;
    const std::string& consumer = known[one.offset].consumer;
    return {ErrorCode::device_refused,
            fmt::format("GPIO line '{}' is in use by {}", names[one.line].gpio,
                        consumer.empty() ? "the kernel" : fmt::format("'{}'", consumer)),
            "end that program, or choose another line in board.toml"};
  }
  return {ErrorCode::io, fmt::format("cannot get lines of {}: {}", path, cause.what),
          "the chip may lack edge interrupts, or the kernel may be older than 5.10"};
}

using ByChip = std::map<std::string, std::vector<ChipLine>>;

Result<std::vector<LineRequest>> take(const ByChip& chips, const std::vector<BoardLine>& names, bool output,
                                      std::uint32_t levels) {
  std::vector<LineRequest> requests;
  for (const auto& [path, lines] : chips) {
    const Fd chip(::open(path.c_str(), O_RDWR | O_CLOEXEC));
    if (!chip) return no_right(path);
    auto made = output ? request_outputs(chip.get(), lines, levels) : request_inputs(chip.get(), lines);
    if (!made) return refused(path, lines, names, made.error());
    requests.push_back(std::move(made).value());
  }
  return requests;
}

}  // namespace

Result<std::unique_ptr<KernelGpio>> take_lines(const std::vector<BoardLine>& lines, std::uint32_t levels) {
  Directory directory;
  SYMRIG_CHECK(directory.read());
  ByChip outputs;
  ByChip inputs;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    SYMRIG_TRY(const Place place, directory.find(lines[k]));
    (lines[k].output ? outputs : inputs)[place.chip].push_back(
        {place.offset, static_cast<std::uint8_t>(k), lines[k].bias});
  }
  SYMRIG_TRY(auto taken_outputs, take(outputs, lines, true, levels));
  SYMRIG_TRY(auto taken_inputs, take(inputs, lines, false, levels));
  return std::make_unique<KernelGpio>(std::move(taken_outputs), std::move(taken_inputs));
}

}  // namespace symrig::board_linux
