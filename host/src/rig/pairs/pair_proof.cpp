// SPDX-License-Identifier: Apache-2.0
#include "rig/pairs/pair_proof.hpp"

#include <array>
#include <span>

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>

namespace symrig::rig {
namespace {

constexpr std::size_t kProofBytes = kProofDigits / 2;

std::string hexadecimal(std::span<const unsigned char> bytes) {
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace

Result<std::string> random_challenge() {
  std::array<unsigned char, kProofBytes> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) == 1) return hexadecimal(bytes);
  return Error{ErrorCode::io, "the system gives no random bytes for a challenge", "try again"};
}

std::string proof_of(std::string_view secret, Prover prover, std::string_view of_pair,
                     std::string_view of_host) {
  const std::string text =
      fmt::format("{} {} {} {}", kPairGreeting, prover == Prover::host ? "host" : "pair", of_pair, of_host);
  std::array<unsigned char, kProofBytes> proof{};
  unsigned int size = 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): how OpenSSL takes bytes
  const auto* bytes = reinterpret_cast<const unsigned char*>(text.data());
  const bool made = HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()), bytes, text.size(),
                         proof.data(), &size) != nullptr;
  return made && size == proof.size() ? hexadecimal(proof) : std::string();
}

bool same_proof(std::string_view one, std::string_view other) {
  return one.size() >= kProofDigits && one.size() == other.size() &&
         CRYPTO_memcmp(one.data(), other.data(), one.size()) == 0;
}

bool is_challenge(std::string_view text) {
  return text.size() == kProofDigits && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

}  // namespace symrig::rig
