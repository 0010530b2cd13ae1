// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/firmware_file.hpp"

#include "symrig/base/files.hpp"
#include "symrig/base/internal/json_reader.hpp"
#include "symrig/board/internal/sha256.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
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

// The UF2 format: github.com/microsoft/uf2, README. All numbers are little endian.

namespace symrig {
namespace {

constexpr std::size_t kBlock = 512;
constexpr std::size_t kPayload = 256;  // bytes in a block that the RP2040's boot loader accepts
constexpr std::size_t kMaxImage = std::size_t{16} << 20U;
constexpr std::uint32_t kMagic0 = 0x0A324655;
constexpr std::uint32_t kMagic1 = 0x9E5D5157;
constexpr std::uint32_t kMagicEnd = 0x0AB16F30;
constexpr std::uint32_t kNotMainFlash = 0x00000001;
constexpr std::uint32_t kFamilyPresent = 0x00002000;

using Bytes = std::span<const std::uint8_t>;

std::uint32_t word(Bytes bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} | std::uint32_t{bytes[at + 1]} << 8U | std::uint32_t{bytes[at + 2]} << 16U |
         std::uint32_t{bytes[at + 3]} << 24U;
}

Error broken(std::string what) {
  return {ErrorCode::bad_format, std::move(what), "take the file from the release again, or build it again"};
}

struct Block {
  std::uint32_t flags, address, payload, number, count, family;
  Bytes data;
};

Result<Block> parse_block(Bytes bytes, std::size_t index) {
  if (word(bytes, 0) != kMagic0 || word(bytes, 4) != kMagic1 || word(bytes, kBlock - 4) != kMagicEnd)
    return broken(fmt::format("block {} does not begin and end like a UF2 block", index));
  const Block block{word(bytes, 8),
                    word(bytes, 12),
                    word(bytes, 16),
                    word(bytes, 20),
                    word(bytes, 24),
                    word(bytes, 28),
                    bytes.subspan(32, kPayload)};
  if ((block.flags & kNotMainFlash) != 0) return broken(fmt::format("block {} is not for the flash", index));
  if ((block.flags & kFamilyPresent) == 0)
    return broken(fmt::format("block {} does not name its processor", index));
  if (block.payload != kPayload || block.address % kPayload != 0)
    return broken(
        fmt::format("block {} holds {} bytes for address {:#010x}, not 256 bytes at a multiple of 256", index,
                    block.payload, block.address));
  return block;
}

Result<std::vector<Block>> parse_blocks(Bytes file) {
  if (file.empty() || file.size() % kBlock != 0)
    return broken(fmt::format("its {} bytes are not whole UF2 blocks of 512", file.size()));
  const std::size_t count = file.size() / kBlock;
  std::vector<Block> blocks;
  for (std::size_t k = 0; k < count; ++k) {
    SYMRIG_TRY(const Block block, parse_block(file.subspan(k * kBlock, kBlock), k));
    if (block.number != k || block.count != count)
      return broken(
          fmt::format("block {} of {} calls itself block {} of {}", k, count, block.number, block.count));
    if (block.family != (blocks.empty() ? block.family : blocks.front().family))
      return broken(fmt::format("block {} is for another processor than the first", k));
    blocks.push_back(block);
  }
  return blocks;
}

Result<void> check_places(std::vector<Block> blocks) {
  std::sort(blocks.begin(), blocks.end(),
            [](const Block& a, const Block& b) { return a.address < b.address; });
  for (std::size_t k = 1; k < blocks.size(); ++k)
    if (blocks[k].address == blocks[k - 1].address)
      return broken(fmt::format("blocks {} and {} are for the same address {:#010x}", blocks[k - 1].number,
                                blocks[k].number, blocks[k].address));
  const std::uint64_t span = blocks.back().address - blocks.front().address + kPayload;
  if (span > kMaxImage) return broken(fmt::format("its blocks are spread over {} bytes", span));
  return {};
}

}  // namespace

Result<FlashImage> parse_uf2(Bytes file) {
  SYMRIG_TRY(const auto blocks, parse_blocks(file));
  SYMRIG_CHECK(check_places(blocks));
  const auto [first, last] = std::minmax_element(
      blocks.begin(), blocks.end(), [](const Block& a, const Block& b) { return a.address < b.address; });
  FlashImage image{blocks.front().family, first->address, {}};
  image.bytes.assign(last->address - first->address + kPayload, 0xFF);
  for (const Block& block : blocks)
    std::copy(block.data.begin(), block.data.end(), image.bytes.begin() + (block.address - image.address));
  return image;
}

namespace {

namespace fs = std::filesystem;
using Bytes = std::span<const std::uint8_t>;

constexpr std::uint64_t kMaxFile = std::uint64_t{32} << 20U;
constexpr std::string_view kUf2Start = "UF2\n";
constexpr std::uint32_t kFamilyRp2040 = 0xE48BFF56;
constexpr std::uint32_t kFlashRp2040 = 0x10000000;
constexpr std::size_t kBoot2 = 252;  // bytes of the second boot stage, before its checksum

// The record in the image (docs/board-pico-debug.md, "Image"): "SYMRIGFW", u32 layout, u32 reserved, u64 hash
// of the sources, 16 bytes each for board and version.
constexpr std::string_view kMagic = "SYMRIGFW";
constexpr std::uint32_t kLayout = 1;
constexpr std::size_t kRecordBytes = 56;
constexpr std::size_t kText = 16;

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

/// The content of the manifest, FILE.json beside FILE.uf2.
struct Promise {
  std::string sha256, board, version, firmware_hash;
};

Result<Promise> read_promise(const fs::path& uf2) {
  const fs::path path = fs::path(uf2).replace_extension(".json");
  const auto read = read_bytes(path);
  if (!read && read.error().code == ErrorCode::not_found)
    return Error{ErrorCode::not_found, fmt::format("{} does not exist", path.string()),
                 "every firmware file comes with its manifest: keep the two together"};
  SYMRIG_TRY(const auto bytes, read);
  SYMRIG_CHECK(check_json_nesting({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  const auto json = nlohmann::json::parse(bytes, nullptr, false);
  const auto word = [&](const char* key) -> std::string {
    return json.is_object() && json.contains(key) && json[key].is_string() ? json[key].get<std::string>()
                                                                           : "";
  };
  Promise promise{word("sha256"), word("board"), word("version"), word("firmware_hash")};
  if (promise.sha256.empty() || promise.board.empty())
    return broken(path.string(), "it is not a firmware manifest");
  return promise;
}

/// The CRC-32 of the RP2040's boot ROM (RP2040 datasheet, 2.8.1.3.1): polynomial 04c11db7, highest bit first,
/// start ffffffff, no final inversion.
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
    return broken(file, "the checksum of its second boot stage is wrong, so a board would not start it");
  return {};
}

Result<FirmwareManifest> find_manifest(const std::string& file, const FlashImage& image) {
  const auto found = std::search(image.bytes.begin(), image.bytes.end(), kMagic.begin(), kMagic.end());
  const std::size_t at = found - image.bytes.begin();
  if (at + kRecordBytes > image.bytes.size())
    return broken(file, "it is not firmware of symrig: it does not contain symrig's record");
  const Bytes record(image.bytes.data() + at, kRecordBytes);
  if (const auto layout = number(record, 8, 4); layout != kLayout)
    return broken(file, fmt::format("its record has layout {}, this host knows layout {}", layout, kLayout));
  return FirmwareManifest{text(record.subspan(24, kText)), text(record.subspan(24 + kText, kText)),
                          number(record, 16, 8)};
}

Result<void> compare(const std::string& file, const Promise& promise, const FirmwareManifest& manifest) {
  if (promise.board == manifest.board && promise.version == manifest.version &&
      promise.firmware_hash == fmt::format("{:016x}", manifest.firmware_hash))
    return {};
  return broken(file, fmt::format("it is firmware {} for board '{}', its manifest says {} for '{}'",
                                  manifest.version, manifest.board, promise.version, promise.board));
}

}  // namespace

Result<FirmwareFile> read_firmware(const fs::path& uf2) {
  SYMRIG_TRY(const auto bytes, read_bytes(uf2));
  // Reports a file of another kind before a missing manifest.
  if (bytes.size() < kUf2Start.size() || !std::equal(kUf2Start.begin(), kUf2Start.end(), bytes.begin()))
    return broken(uf2.string(), "it is not a UF2 file");
  SYMRIG_TRY(const auto promise, read_promise(uf2));
  FirmwareFile file;
  file.sha256 = board::sha256(bytes);
  if (file.sha256 != promise.sha256)
    return broken(uf2.string(), fmt::format("its SHA-256 is {}, not {}", file.sha256, promise.sha256));
  auto image = parse_uf2(bytes);
  if (!image) return broken(uf2.string(), image.error().what);
  file.image = std::move(image).value();
  SYMRIG_CHECK(check_processor(uf2.string(), file.image));
  SYMRIG_TRY(file.manifest, find_manifest(uf2.string(), file.image));
  SYMRIG_CHECK(compare(uf2.string(), promise, file.manifest));
  return file;
}

Result<void> check_firmware_fits(const FirmwareManifest& manifest, std::string_view board) {
  if (manifest.board == board) return {};
  return Error{ErrorCode::bad_value,
               fmt::format("the firmware is for board '{}', the board is a '{}'", manifest.board, board),
               "use the file for this board"};
}

}  // namespace symrig
