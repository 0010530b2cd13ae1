// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/dense/raw_matrix.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::sim {

/// A variable of a MAT file. Its numbers lie in the file, or are compressed there.
struct MatVariable {
  std::string name;
  std::vector<std::int64_t> shape;
  std::string fault = {};             ///< why its numbers cannot be a T: "is complex"; empty: they can
  NumberType type = NumberType::f64;  ///< of the numbers, if they are not compressed
  std::size_t data = 0;               ///< where they begin in the file, or in the uncompressed element
  std::string_view compressed = {};   ///< its element; empty: it is not compressed
  std::size_t element_bytes = 0;      ///< of the uncompressed element
};

/// The little-endian number at a place that is inside the bytes.
std::uint32_t mat_word(std::string_view bytes, std::size_t at);
std::uint64_t numbers_in(const std::vector<std::int64_t>& shape);

}  // namespace symrig::sim
