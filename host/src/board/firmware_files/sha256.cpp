// SPDX-License-Identifier: Apache-2.0
#include "board/firmware_files/sha256.hpp"

#include <array>
#include <cstddef>

#include <fmt/format.h>
#include <openssl/evp.h>

namespace symrig::board {

std::string sha256(std::span<const std::uint8_t> bytes) {
  std::array<unsigned char, 32> hash{};
  // Fails only if OpenSSL was built without SHA-256. The empty text then differs from every file's hash.
  if (EVP_Digest(bytes.data(), bytes.size(), hash.data(), nullptr, EVP_sha256(), nullptr) != 1) return {};
  std::string text;
  for (const unsigned char byte : hash) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace symrig::board
