// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace symrig::acquisition {

/// CRC-32C of the bytes, the number that protocol::crc32c gives: polynomial 0x1EDC6F41, reflected, start and
/// final xor all ones. For files: it takes eight bytes at a time, because a photograph has megabytes. For
/// what goes over the wire, and where the protocol's own code must agree with a board, use protocol::crc32c.
/// source: [Kounavis05], slicing by 8; on x86-64 processors with SSE4.2 their own instruction.
std::uint32_t fast_crc32c(std::span<const std::byte> bytes);

/// The same on any processor, for tests and where the instruction is missing.
std::uint32_t portable_crc32c(std::span<const std::byte> bytes);

}  // namespace symrig::acquisition
