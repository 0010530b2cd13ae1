// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/file_hash.hpp"

#include "board/firmware_files/sha256.hpp"
#include "symrig/base/files.hpp"

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

namespace symrig {

Result<std::string> file_hash(const std::filesystem::path& path) {
  SYMRIG_CHECK(check_readable(path));
  const auto failed = [&] {
    return Error{ErrorCode::io, path.string() + ": cannot be read (" + std::strerror(errno) + ")",
                 "check the file and its disk"};
  };
  const Fd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file) return failed();
  board::Sha256 hash;
  std::vector<std::byte> block(std::size_t{1} << 20);  // a scene may be larger than the memory
  for (;;) {
    const ::ssize_t count = ::read(file.get(), block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return failed();
    if (count == 0) return hash.text();
    hash.add(std::span(block).first(static_cast<std::size_t>(count)));
  }
}

}  // namespace symrig
