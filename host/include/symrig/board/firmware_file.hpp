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

/// The bytes that a UF2 file writes to a board's flash.
struct FlashImage {
  std::uint32_t family = 0;         ///< UF2 family id: the kind of processor
  std::uint32_t address = 0;        ///< of the first byte
  std::vector<std::uint8_t> bytes;  ///< gaps are 0xFF, like erased flash
};

/// Reads a UF2 file. It must have whole blocks of 256 bytes, in order, of one family, none missing, none
/// twice, within 16 MiB. fails: bad_format (the message names the block and its error).
Result<FlashImage> parse_uf2(std::span<const std::uint8_t> file);

/// The record inside a firmware image that identifies the firmware (docs/board-pico-debug.md).
struct FirmwareManifest {
  std::string board;                ///< "pico", as BoardInfo::board
  std::string version;              ///< "0.1.0", as BoardInfo::firmware_version
  std::uint64_t firmware_hash = 0;  ///< as BoardInfo::firmware_hash
};

/// A checked firmware file.
struct FirmwareFile {
  FlashImage image;
  FirmwareManifest manifest;
  std::string sha256;  ///< of the UF2 file
};

/// Reads FILE.uf2 and its manifest FILE.json, and makes all checks that need no board: the SHA-256, the UF2
/// blocks, the processor, the checksum of the second boot stage, the record in the image, and that the
/// manifest agrees with the record. fails: not_found, io, bad_format (the message names the check that
/// failed).
Result<FirmwareFile> read_firmware(const std::filesystem::path& uf2);

/// Checks that the firmware is for that board. fails: bad_value (the message names both).
Result<void> check_firmware_fits(const FirmwareManifest& manifest, std::string_view board);

/// Checks that this folder is the drive of an RP2040's boot loader: it contains INFO_UF2.TXT with the board
/// id RPI-RP2. fails: not_found (no such folder, or not mounted), bad_format (another drive, another
/// processor).
Result<void> check_boot_drive(const std::filesystem::path& folder);

/// All mounted drives of boot loaders. mounts: the kernel's list.
std::vector<std::filesystem::path> boot_drives(const std::filesystem::path& mounts = "/proc/mounts");

/// Copies a firmware file to a boot loader's drive and syncs it. The boot loader restarts when it has the
/// last byte, so the drive may disappear before the sync returns. Therefore only a failed write is an error.
/// Connect to the board to learn whether the update worked. fails: io, not_found, as check_boot_drive.
Result<void> copy_to_boot_drive(const std::filesystem::path& uf2, const std::filesystem::path& drive);

}  // namespace symrig
