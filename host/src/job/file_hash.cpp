// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/file_hash.hpp"

#include "board/firmware_files/sha256.hpp"
#include "symrig/base/atomic_file.hpp"

#include <cstdint>

namespace symrig {

Result<std::string> file_hash(const std::filesystem::path& path) {
  SYMRIG_TRY(const auto bytes, read_file(path));
  return board::sha256({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

}  // namespace symrig
