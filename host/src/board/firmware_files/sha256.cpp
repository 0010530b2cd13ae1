// SPDX-License-Identifier: Apache-2.0
#include "board/firmware_files/sha256.hpp"

#include <array>

#include <fmt/format.h>
#include <openssl/evp.h>

namespace symrig::board {

/// A step fails only if OpenSSL was built without SHA-256. The empty text then differs from every file's
/// hash.
struct Sha256::Context {
  EVP_MD_CTX* evp = EVP_MD_CTX_new();
  bool ok = EVP_DigestInit_ex(evp, EVP_sha256(), nullptr) == 1;

  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ~Context() { EVP_MD_CTX_free(evp); }
};

Sha256::Sha256() : context_(std::make_unique<Context>()) {}
Sha256::~Sha256() = default;

void Sha256::add(std::span<const std::byte> bytes) {
  context_->ok = context_->ok && EVP_DigestUpdate(context_->evp, bytes.data(), bytes.size()) == 1;
}

std::string Sha256::text() {
  std::array<unsigned char, 32> hash{};
  if (!context_->ok || EVP_DigestFinal_ex(context_->evp, hash.data(), nullptr) != 1) return {};
  std::string text;
  for (const unsigned char byte : hash) text += fmt::format("{:02x}", byte);
  return text;
}

std::string sha256(std::span<const std::uint8_t> bytes) {
  Sha256 hash;
  hash.add(std::as_bytes(bytes));
  return hash.text();
}

}  // namespace symrig::board
