// SPDX-License-Identifier: Apache-2.0
#include "symrig/device/firmware_file.hpp"

#include "sha256.hpp"
#include "symrig/base/atomic_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>

#include <fmt/format.h>

namespace symrig::device {
namespace {

namespace fs = std::filesystem;
using Bytes = std::span<const std::uint8_t>;

constexpr std::uint64_t kMaxFile = std::uint64_t{32} << 20U;
constexpr std::uint32_t kFamilyRp2040 = 0xE48BFF56;
constexpr std::uint32_t kFlashRp2040 = 0x10000000;
constexpr std::size_t kBoot2 = 252;  // bytes of the second boot stage; its checksum follows

// Our record: "SYMRIGFW", u32 version of the record, u32 bytes of it, 24 bytes each for board and firmware
// version, u64 hash of the sources.
constexpr std::string_view kMagic = "SYMRIGFW";
constexpr std::uint32_t kRecordVersion = 1;
constexpr std::size_t kRecordBytes = 72;
constexpr std::size_t kText = 24;

Error broken(const std::string& file, std::string_view what) {
  return {ErrorCode::bad_format, fmt::format("{}: {}", file, what),
          "take the file from the release again, or build it again"};
}

std::uint64_t number(Bytes bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < size; ++k) value |= std::uint64_t{bytes[at + k]} << (8 * k);
  return value;
}

std::string text(Bytes bytes) {
  const auto end = std::find(bytes.begin(), bytes.end(), 0);
  return {bytes.begin(), end};
}

Result<std::vector<std::uint8_t>> read_bytes(const fs::path& path) {
  SYMRIG_TRY(const auto bytes, read_file(path, kMaxFile));
  std::vector<std::uint8_t> result(bytes.size());
  std::transform(bytes.begin(), bytes.end(), result.begin(),
                 [](std::byte b) { return static_cast<std::uint8_t>(b); });
  return result;
}

/// The digest that FILE.sha256 tells: the first word of the line.
Result<std::string> promised_digest(const fs::path& uf2) {
  const fs::path path = uf2.string() + ".sha256";
  std::error_code error;
  if (!fs::exists(path, error))
    return Error{
        ErrorCode::not_found, fmt::format("{} is not there", path.string()),
        "firmware files come with it; after a build of your own: sha256sum FILE.uf2 > FILE.uf2.sha256"};
  SYMRIG_TRY(const auto bytes, read_bytes(path));
  const auto end =
      std::find_if(bytes.begin(), bytes.end(), [](unsigned char c) { return std::isspace(c) != 0; });
  std::string digest(bytes.begin(), end);
  const bool sound = digest.size() == 64 && std::all_of(digest.begin(), digest.end(), [](unsigned char c) {
                       return std::isxdigit(c) != 0 && std::isupper(c) == 0;
                     });
  if (!sound) return broken(path.string(), "it does not begin with a SHA-256 digest");
  return digest;
}

/// CRC-32 as the RP2040's boot ROM checks it (RP2040 datasheet, 2.8.1.3.1): polynomial 04c11db7, from the
/// highest bit down, start ffffffff, no final inversion.
std::uint32_t boot_crc(Bytes bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= std::uint32_t{byte} << 24U;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1U) ^ ((crc >> 31U) != 0 ? 0x04C11DB7U : 0U);
  }
  return crc;
}

Result<void> check_processor(const std::string& file, const FlashImage& image) {
  if (image.family != kFamilyRp2040)
    return broken(
        file, fmt::format("it is for processors of UF2 family {:#010x}, not for the RP2040", image.family));
  if (image.address != kFlashRp2040)
    return broken(file,
                  fmt::format("it begins at address {:#010x}, not where the flash begins", image.address));
  const Bytes boot(image.bytes);
  if (boot_crc(boot.first(kBoot2)) != number(boot, kBoot2, 4))
    return broken(file, "the checksum of its second boot stage is wrong: a board would not start it");
  return {};
}

Result<FirmwareManifest> find_manifest(const std::string& file, const FlashImage& image) {
  const auto found = std::search(image.bytes.begin(), image.bytes.end(), kMagic.begin(), kMagic.end());
  const auto at = static_cast<std::size_t>(found - image.bytes.begin());
  if (at + kRecordBytes > image.bytes.size())
    return broken(file, "it is no firmware of symrig: our record is not in it");
  const Bytes record(image.bytes.data() + at, kRecordBytes);
  if (const auto version = number(record, 8, 4); version != kRecordVersion)
    return broken(file,
                  fmt::format("its record is of version {}, this host knows {}", version, kRecordVersion));
  return FirmwareManifest{text(record.subspan(16, kText)), text(record.subspan(16 + kText, kText)),
                          number(record, 16 + 2 * kText, 8)};
}

}  // namespace

Result<FirmwareFile> read_firmware(const fs::path& uf2) {
  SYMRIG_TRY(const auto bytes, read_bytes(uf2));
  SYMRIG_TRY(const auto promised, promised_digest(uf2));
  FirmwareFile file;
  file.sha256 = sha256(bytes);
  if (file.sha256 != promised)
    return broken(uf2.string(), fmt::format("its SHA-256 is {}, not {}", file.sha256, promised));
  auto image = parse_uf2(bytes);
  if (!image) return broken(uf2.string(), image.error().what);
  file.image = std::move(image).value();
  SYMRIG_CHECK(check_processor(uf2.string(), file.image));
  SYMRIG_TRY(file.manifest, find_manifest(uf2.string(), file.image));
  return file;
}

Result<void> check_firmware_fits(const FirmwareManifest& manifest, std::string_view board) {
  if (manifest.board == board) return {};
  return Error{ErrorCode::bad_value,
               fmt::format("the firmware is for board '{}', the board is a '{}'", manifest.board, board),
               "take the file that is for this board"};
}

}  // namespace symrig::device
