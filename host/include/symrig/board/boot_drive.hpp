// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <filesystem>
#include <vector>

namespace symrig {

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
