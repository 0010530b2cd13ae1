// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/firmware_file.hpp"

#include <algorithm>

#include <fmt/format.h>

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

}  // namespace symrig
