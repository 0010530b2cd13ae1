// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// What a UF2 file would write to a board's flash.
struct FlashImage {
  std::uint32_t family = 0;         ///< UF2 family id: the kind of processor
  std::uint32_t address = 0;        ///< of the first byte
  std::vector<std::uint8_t> bytes;  ///< gaps are 0xFF, as erased flash
};

/// Reads a UF2 file: whole blocks, all there and in order, of one family, 256 bytes each, none twice, within
/// 16 MiB. fails: bad_format (naming the block and what is wrong with it).
Result<FlashImage> parse_uf2(std::span<const std::uint8_t> file);

/// The record that our firmware carries in its image, so that a file says what it is (boards/pico/README.md).
struct FirmwareManifest {
  std::string board;                ///< "pico", as BoardInfo::board
  std::string version;              ///< "0.1.0", as BoardInfo::firmware_version
  std::uint64_t firmware_hash = 0;  ///< as BoardInfo::firmware_hash
};

/// A firmware file that may be put on a board.
struct FirmwareFile {
  FlashImage image;
  FirmwareManifest manifest;
  std::string sha256;  ///< of the UF2 file
};

/// Reads FILE.uf2 and its manifest FILE.json beside it and checks all that can be checked without a board:
/// the SHA-256, the UF2 blocks, the processor, the second boot stage's checksum, our record and that the
/// manifest says the same. fails: not_found, io, bad_format (naming the check that failed).
Result<FirmwareFile> read_firmware(const std::filesystem::path& uf2);

/// Is this file for that board? fails: bad_value (naming both).
Result<void> check_firmware_fits(const FirmwareManifest& manifest, std::string_view board);

}  // namespace symrig
