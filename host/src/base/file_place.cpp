// SPDX-License-Identifier: Apache-2.0
#include "base/file_place.hpp"

#include <array>
#include <charconv>
#include <string_view>
#include <system_error>

#include <sys/stat.h>
#include <unistd.h>

namespace symrig::base {
namespace {

namespace fs = std::filesystem;

FilePlace place_of(const struct stat& status) {
  return {status.st_dev, status.st_ino, status.st_mode, ""};
}

std::optional<int> number(std::string_view text) {
  int value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

}  // namespace

fs::path link_target(const fs::path& path) {
  constexpr int kMostLinks = 40;  // the same limit as the system's
  fs::path target = path;
  std::error_code error;
  for (int links = 0; links < kMostLinks && fs::is_symlink(target, error); ++links) {
    const fs::path next = fs::read_symlink(target, error);
    if (error) return target;
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target;
}

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

std::optional<int> descriptor_of(const fs::path& path) {
  const std::string text = path.lexically_normal().string();
  if (path == "-" || text == "/dev/stdout") return STDOUT_FILENO;  // "./-" is a file
  if (text == "/dev/stderr") return STDERR_FILENO;
  for (const std::string& folder : {std::string("/dev/fd/"), std::string("/proc/self/fd/"),
                                    "/proc/" + std::to_string(::getpid()) + "/fd/"})
    if (text.starts_with(folder)) return number(std::string_view(text).substr(folder.size()));
  return std::nullopt;
}

bool FilePlace::regular() const {
  return S_ISREG(mode);
}

std::optional<FilePlace> place_of(int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return std::nullopt;
  return place_of(status);
}

std::optional<FilePlace> place_of(const fs::path& path) {
  if (const auto descriptor = descriptor_of(path)) return place_of(*descriptor);
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) return place_of(status);
  const fs::path target = link_target(path);
  if (::stat(folder_of(target).c_str(), &status) != 0) return std::nullopt;
  return FilePlace{status.st_dev, status.st_ino, 0, target.filename().string()};
}

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a named pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return S_ISREG(mode) ? "a file" : "a device";
}

}  // namespace symrig::base
