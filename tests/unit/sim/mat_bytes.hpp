// SPDX-License-Identifier: Apache-2.0
// MAT files byte by byte, as MATLAB writes them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <zlib.h>

namespace symrig::test {

template <class T>
std::string raw_bytes(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

inline std::string word_bytes(std::vector<std::uint32_t> words) {
  return raw_bytes(std::span<const std::uint32_t>(words));
}

/// A data element: tag, data, padding to 8 bytes.
inline std::string mat_element(std::uint32_t type, const std::string& data) {
  std::string bytes = word_bytes({type, static_cast<std::uint32_t>(data.size())}) + data;
  bytes.append((8 - bytes.size() % 8) % 8, '\0');
  return bytes;
}

/// A matrix element of class double. stored: the type of its numbers, such as 9 (double) or 2 (uint8, in
/// which MATLAB stores small integers).
inline std::string mat_variable(std::string_view name, std::uint32_t rows, std::uint32_t cols,
                                std::uint32_t stored, const std::string& numbers, std::uint32_t flags = 6) {
  return mat_element(14, mat_element(6, word_bytes({flags, 0})) + mat_element(5, word_bytes({rows, cols})) +
                             mat_element(1, std::string(name)) + mat_element(stored, numbers));
}

inline std::string mat_file(const std::string& elements) {
  std::string head = "MATLAB 5.0 MAT-file";
  head.append(124 - head.size(), ' ');
  return head + std::string("\x00\x01IM", 4) + elements;
}

inline std::string mat_compressed(const std::string& element) {
  uLongf size = compressBound(static_cast<uLong>(element.size()));
  std::string out(size, '\0');
  compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(element.data()),
           static_cast<uLong>(element.size()));
  out.resize(size);
  return word_bytes({15, static_cast<std::uint32_t>(size)}) + out;  // not padded
}

/// A variable of level 4. type: MOPT, such as 0 (double) or 10 (single).
inline std::string level4_variable(std::string_view name, std::uint32_t rows, std::uint32_t cols,
                                   std::uint32_t type, const std::string& numbers) {
  return word_bytes({type, rows, cols, 0, static_cast<std::uint32_t>(name.size() + 1)}) + std::string(name) +
         '\0' + numbers;
}

}  // namespace symrig::test
