// SPDX-License-Identifier: Apache-2.0
// Types and shapes of stored values, and their conversion.
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace symrig::tensor::h5 {

class FileBytes;

/// Sizes of a dataset, slowest first.
using Shape = std::vector<std::uint64_t>;
/// A number that no memory holds, if the product is too large.
std::uint64_t count(const Shape& shape);

struct Space {
  Shape size, most;    ///< most: as far as it may grow
  bool empty = false;  ///< it has no value, not even one
};
Result<Space> parse_space(const FileBytes& file, std::span<const std::uint8_t> message);

enum class TypeKind : std::uint8_t { integer, real, text, variable_text, other };

/// The type of one stored value.
struct Datatype {
  TypeKind kind = TypeKind::other;
  std::uint32_t size = 0;  ///< bytes
  bool big_endian = false;
  bool is_signed = false;     ///< integers
  unsigned at = 0, bits = 0;  ///< integers: lowest bit, and how many
  struct Real {               ///< of floats: places and numbers of bits
    unsigned sign = 0, exponent_at = 0, exponent_bits = 0, mantissa_at = 0, mantissa_bits = 0;
    std::uint32_t bias = 0;
    bool implied = true;  ///< the first bit of the mantissa is not stored
    bool operator==(const Real&) const = default;
  } real;
  enum class Pad : std::uint8_t { ended_by_zero, zeros, spaces } pad = Pad::zeros;  ///< texts
};

/// fails: bad_format (damaged). A type that is no number and no text is `other`.
Result<Datatype> parse_type(std::span<const std::uint8_t> message);

/// Converts stored values to those of the caller.
struct Conversion {
  std::size_t size;  ///< bytes of a value of the caller
  bool to_real;
  void (*run)(const Datatype& stored, const std::uint8_t* from, std::size_t count, void* to);
};
/// T: an integer, float, double; std::uint16_t stands for a float of 16 bits. Integers that do not fit become
/// the nearest that does.
template <class T>
const Conversion& conversion();

/// "float32", "a compound", …
std::string_view problem_of(const Datatype& stored, const Conversion& conversion);

}  // namespace symrig::tensor::h5
