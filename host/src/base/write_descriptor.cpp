// SPDX-License-Identifier: Apache-2.0
#include "base/write_descriptor.hpp"

#include <cerrno>
#include <string>
#include <system_error>

#include <poll.h>
#include <unistd.h>

namespace symrig::base {
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
