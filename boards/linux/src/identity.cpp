// SPDX-License-Identifier: Apache-2.0
#include "identity.hpp"

#include "symrig/base/atomic_file.hpp"
#include "symrig/protocol/crc32c.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::board_linux {
namespace {

void append_crc(std::vector<std::uint8_t>& out, const std::vector<std::uint8_t>& bytes) {
  const std::uint32_t crc = protocol::crc32c({bytes.data(), bytes.size()});
  for (unsigned shift = 0; shift < 32; shift += 8) out.push_back(static_cast<std::uint8_t>(crc >> shift));
}

}  // namespace

Result<std::vector<std::uint8_t>> unique_id(const BoardFile& file) {
  std::vector<std::uint8_t> id;
  for (std::size_t k = 0; k + 1 < file.id.size(); k += 2)
    id.push_back(static_cast<std::uint8_t>(std::stoul(file.id.substr(k, 2), nullptr, 16)));
  if (!id.empty()) return id;
  const auto machine = read_file("/etc/machine-id", 4096);
  if (!machine || machine->size() < 16)
    return Error{ErrorCode::not_found, "this machine has no /etc/machine-id", "set [board] id in board.toml"};
  std::vector<std::uint8_t> seed(file.name.begin(), file.name.end());
  std::transform(machine->begin(), machine->end(), std::back_inserter(seed),
                 [](std::byte one) { return static_cast<std::uint8_t>(one); });
  append_crc(id, seed);
  seed.push_back(1);  // for the second four bytes
  std::reverse(seed.begin(), seed.end());
  append_crc(id, seed);
  return id;
}

std::string hexadecimal(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace symrig::board_linux
