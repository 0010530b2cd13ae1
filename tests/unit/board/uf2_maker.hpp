// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

namespace symrig::test {

inline void put_number(std::vector<std::uint8_t>& bytes, std::size_t at, std::uint64_t value,
                       std::size_t size) {
  for (std::size_t k = 0; k < size; ++k) bytes[at + k] = static_cast<std::uint8_t>(value >> (8 * k));
}

/// An image of `size` bytes (a multiple of 256) with a second boot stage, its checksum and our record at
/// 0x200.
inline std::vector<std::uint8_t> make_image(std::size_t size, const std::string& board,
                                            const std::string& version, std::uint64_t hash) {
  std::vector<std::uint8_t> image(size);
  for (std::size_t k = 0; k < size; ++k) image[k] = static_cast<std::uint8_t>((k * 2654435761U) >> 11U);
  std::uint32_t crc = 0xFFFFFFFF;  // bit by bit, apart from the code under test
  for (std::size_t bit = 0; bit < 252UL * 8; ++bit) {
    const std::uint32_t data = image[bit / 8] >> (7 - bit % 8) & 1U;
    const bool out = (crc >> 31U ^ data) != 0;
    crc = (crc << 1U) ^ (out ? 0x04C11DB7U : 0U);
  }
  put_number(image, 252, crc, 4);
  const std::string magic = "SYMRIGFW";
  std::fill_n(image.begin() + 0x200, 56, std::uint8_t{0});
  std::copy(magic.begin(), magic.end(), image.begin() + 0x200);
  put_number(image, 0x208, 1, 4);
  put_number(image, 0x210, hash, 8);
  std::copy(board.begin(), board.end(), image.begin() + 0x218);
  std::copy(version.begin(), version.end(), image.begin() + 0x228);
  return image;
}

/// The same as UF2 blocks of 256 bytes from 0x10000000 on.
inline std::vector<std::uint8_t> make_uf2(const std::vector<std::uint8_t>& image,
                                          std::uint32_t family = 0xE48BFF56) {
  const std::size_t count = image.size() / 256;
  std::vector<std::uint8_t> file(count * 512);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t at = k * 512;
    put_number(file, at, 0x0A324655, 4);
    put_number(file, at + 4, 0x9E5D5157, 4);
    put_number(file, at + 8, 0x2000, 4);
    put_number(file, at + 12, 0x10000000 + 256 * k, 4);
    put_number(file, at + 16, 256, 4);
    put_number(file, at + 20, k, 4);
    put_number(file, at + 24, count, 4);
    put_number(file, at + 28, family, 4);
    std::copy_n(image.begin() + static_cast<std::ptrdiff_t>(256 * k), 256,
                file.begin() + static_cast<std::ptrdiff_t>(at + 32));
    put_number(file, at + 508, 0x0AB16F30, 4);
  }
  return file;
}

/// The manifest that stands beside it. hash: 16 hexadecimal digits.
inline void write_manifest(const std::string& path, const std::string& sha256, const std::string& board,
                           const std::string& version, const std::string& hash) {
  std::ofstream(path) << R"({"board": ")" << board << R"(", "version": ")" << version
                      << R"(", "firmware_hash": ")" << hash << R"(", "sha256": ")" << sha256 << "\"}\n";
}

inline void write_file(const std::string& path, const std::vector<std::uint8_t>& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace symrig::test
