// SPDX-License-Identifier: Apache-2.0

#include "base/descriptors.hpp"

#include "symrig/base/files.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <poll.h>
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

namespace {

std::string name_of(int descriptor) {
  return descriptor == STDOUT_FILENO ? "standard output" : "descriptor " + std::to_string(descriptor);
}

/// Whether to try again after the last error. If another program made a shared terminal non-blocking, this
/// waits until it is writable.
bool passes(int descriptor) {
  if (errno == EINTR) return true;
  if (errno != EAGAIN) return false;
  pollfd writable{descriptor, POLLOUT, 0};
  return ::poll(&writable, 1, -1) >= 0 || errno == EINTR;
}

}  // namespace

Result<void> write_descriptor(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written >= 0) {
      text.remove_prefix(static_cast<std::size_t>(written));
    } else if (!passes(descriptor)) {
      return Error{
          ErrorCode::io,
          name_of(descriptor) + " cannot be written (" + std::generic_category().message(errno) + ")",
          "check what it is connected to"};
    }
  }
  return {};
}

}  // namespace symrig::base

namespace symrig {

void reserve_standard_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // open() returns the lowest free number, which is this one. The wrong access mode makes every use of it
    // fail.
    const int got = ::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    if (got >= 0 && got != descriptor) ::close(got);
  }
}

Result<std::string> read_standard_input(std::uint64_t max_bytes) {
  std::string text;
  std::array<char, 1 << 16> part{};
  for (;;) {
    const ssize_t got = ::read(STDIN_FILENO, part.data(), part.size());
    if (got == 0) return text;
    if (got < 0 && errno == EINTR) continue;
    if (got < 0)
      return Error{ErrorCode::io, std::string("standard input: ") + std::strerror(errno), "give a file"};
    text.append(part.data(), static_cast<std::size_t>(got));
    if (text.size() > max_bytes)
      return Error{ErrorCode::limit, "standard input: has more than " + std::to_string(max_bytes) + " bytes",
                   "give less"};
  }
}

Result<void> write_standard_output(std::string_view text) {
  return base::write_descriptor(STDOUT_FILENO, text);
}

void write_standard_error(std::string_view text) {
  static_cast<void>(base::write_descriptor(STDERR_FILENO, text));
}

}  // namespace symrig
