// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <string>
#include <string_view>

namespace symrig::rig {

// The words of the greeting (docs/pair-protocol.md).
inline constexpr std::string_view kPairGreeting = "symrig-pair 1";
inline constexpr std::size_t kLongestPairLine = 1024;
inline constexpr std::size_t kProofDigits = 64;  // 32 bytes in hexadecimal

/// Whose proof it is. So a host's proof is none of a pair's, and cannot be sent back.
enum class Prover : bool { host, pair };

/// 32 random bytes in hexadecimal, never the same again.
/// fails: io (the system gives no random bytes).
Result<std::string> random_challenge();

/// HMAC-SHA-256 over the protocol, the prover, the pair's challenge and the host's, in hexadecimal.
std::string proof_of(std::string_view secret, Prover prover, std::string_view of_pair,
                     std::string_view of_host);

/// Takes as long whichever digit differs.
bool same_proof(std::string_view one, std::string_view other);

/// 64 digits of a hexadecimal number in lower case.
bool is_challenge(std::string_view text);

}  // namespace symrig::rig
