// SPDX-License-Identifier: Apache-2.0
#include "board/firmware_files/sha256.hpp"

#include <array>
#include <cstddef>

#include <fmt/format.h>
#include <openssl/evp.h>

namespace symrig::board {

std::string sha256(std::span<const std::uint8_t> bytes) {
  std::array<unsigned char, 32> hash{};
  // Fails only where OpenSSL was built without SHA-256. An empty text then equals no hash of any file.
  if (EVP_Digest(bytes.data(), bytes.size(), hash.data(), nullptr, EVP_sha256(), nullptr) != 1) return {};
  std::string text;
  for (const unsigned char byte : hash) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace symrig::board
