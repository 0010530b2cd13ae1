// SPDX-License-Identifier: Apache-2.0
// What host and pair say: the greeting with its proofs, what a pair of devices states of itself, and the
// sizes that its protocol allows.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/projector/projector.hpp"
#include "symrig/rig/pair_link.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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

inline constexpr std::size_t kMostLoaded = 4096;                          // patterns of one load
inline constexpr std::int64_t kLargestPairImage = std::int64_t{1} << 28;  // values of a pattern or a frame
inline constexpr std::size_t kMostTaken = 4096;                           // frames of one answer
inline constexpr std::int64_t kLongestPatience = 3'600'000'000'000;       // ns

/// The facts of a camera and a projector.
struct DeviceFacts {
  Grid cells, camera;
  int channels = 1;
  Mosaic mosaic = Mosaic::none;
  Pacing pacing = Pacing::host;
  Nanoseconds refresh{0};
  CameraTiming timing;
  std::optional<NoiseModel> noise;
};

/// "cells=48x64 camera=48x64 channels=1 ...".
std::string facts_of(const Camera& camera, const Projector& projector);
/// fails: protocol (a fact is missing or out of range).
Result<DeviceFacts> read_facts(const PairLink& link);

/// The whole numbers of a line, which begins with `word`. none: another line.
std::optional<std::vector<std::int64_t>> numbers_after(std::string_view word, std::string_view line,
                                                       std::size_t count);

}  // namespace symrig::rig
