// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/standard_streams.hpp"

#include "base/write_descriptor.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <string>

#include <fcntl.h>
#include <unistd.h>

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
