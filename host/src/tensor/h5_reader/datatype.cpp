// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/datatype.hpp"

#include "symrig/tensor/internal/half.hpp"
#include "tensor/h5_reader/file_bytes.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace symrig::tensor::h5 {
namespace {

constexpr unsigned kMostRank = 32;

/// The bits of a value of up to 16 bytes, lowest first.
struct Bits {
  std::array<std::uint64_t, 2> words{};

  Bits(const Datatype& type, const std::uint8_t* from) {
    for (std::uint32_t k = 0; k < type.size; ++k) {
      const std::uint64_t byte = from[type.big_endian ? type.size - 1 - k : k];
      words[k / 8] |= byte << (k % 8 * 8);
    }
  }
  /// count: 1 to 64; at + count: at most 128.
  std::uint64_t field(unsigned at, unsigned count) const {
    const unsigned word = at / 64, shift = at % 64;
    std::uint64_t value = words[word] >> shift;
    if (shift > 0 && word == 0) value |= words[1] << (64 - shift);
    return count == 64 ? value : value & ((std::uint64_t{1} << count) - 1);
  }
};

double real_at(const Datatype& type, const std::uint8_t* from) {
  const Bits bits(type, from);
  const Datatype::Real& real = type.real;
  const std::uint64_t mantissa = bits.field(real.mantissa_at, real.mantissa_bits);
  const auto exponent = static_cast<int>(bits.field(real.exponent_at, real.exponent_bits));
  const int bias = static_cast<int>(real.bias), digits = static_cast<int>(real.mantissa_bits);
  double value = 0;
  if (exponent == (1 << real.exponent_bits) - 1) {
    const std::uint64_t fraction = real.implied ? mantissa : mantissa << 1U << (64 - real.mantissa_bits);
    value =
        fraction == 0 ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
  } else if (real.implied) {
    value = std::ldexp(static_cast<double>(mantissa), std::max(exponent, 1) - bias - digits);
    if (exponent > 0) value += std::ldexp(1.0, exponent - bias);
  } else {
    value = std::ldexp(static_cast<double>(mantissa), std::max(exponent, 1) - bias - digits + 1);
  }
  return bits.field(real.sign, 1) != 0 ? -value : value;
}

std::int64_t integer_at(const Datatype& type, const std::uint8_t* from) {
  const std::uint64_t value = Bits(type, from).field(type.at, type.bits);
  const bool negative = type.is_signed && (value >> (type.bits - 1) & 1U) != 0;
  if (negative && type.bits < 64) return static_cast<std::int64_t>(value | ~std::uint64_t{0} << type.bits);
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  return static_cast<std::int64_t>(type.is_signed ? value : std::min(value, kMost));
}

template <class T>
constexpr bool kReal = std::is_floating_point_v<T> || std::is_same_v<T, Half>;

/// The layout of T in this machine's memory.
template <class T>
bool same_as_stored(const Datatype& type) {
  if (type.size != sizeof(T) || type.big_endian != (std::endian::native == std::endian::big)) return false;
  if constexpr (std::is_same_v<T, double>) return type.real == Datatype::Real{63, 52, 11, 0, 52, 1023, true};
  if constexpr (std::is_same_v<T, float>) return type.real == Datatype::Real{31, 23, 8, 0, 23, 127, true};
  if constexpr (std::is_same_v<T, Half>) return type.real == Datatype::Real{15, 10, 5, 0, 10, 15, true};
  return type.is_signed == std::is_signed_v<T> && type.at == 0 && type.bits == 8 * sizeof(T);
}

template <class T>
T converted(const Datatype& type, const std::uint8_t* from) {
  if constexpr (kReal<T>) {
    const double value =
        type.kind == TypeKind::real ? real_at(type, from) : static_cast<double>(integer_at(type, from));
    if constexpr (std::is_same_v<T, Half>) return to_half(static_cast<float>(value));
    return static_cast<T>(value);
  } else {
    using Limits = std::numeric_limits<T>;
    return static_cast<T>(std::clamp<std::int64_t>(integer_at(type, from), Limits::min(), Limits::max()));
  }
}

template <class T>
void convert(const Datatype& type, const std::uint8_t* from, std::size_t count, void* to) {
  const bool same_kind = (type.kind == TypeKind::real) == kReal<T>;
  if (same_kind && same_as_stored<T>(type)) {
    std::memcpy(to, from, count * sizeof(T));
    return;
  }
  T* const values = static_cast<T*>(to);
  for (std::size_t k = 0; k < count; ++k) values[k] = converted<T>(type, from + k * type.size);
}

bool inside(unsigned at, unsigned bits, unsigned most_bits, std::uint32_t bytes) {
  return bits >= 1 && bits <= most_bits && at + bits <= 8 * bytes;
}

/// Of integers: bit 0 of the flags is the byte order, bit 3 the sign.
Result<Datatype> parse_integer(Datatype type, unsigned flags, Bytes bytes) {
  type.big_endian = (flags & 1U) != 0;
  type.is_signed = (flags & 8U) != 0;
  type.at = static_cast<unsigned>(bytes.number(2));
  type.bits = static_cast<unsigned>(bytes.number(2));
  if (type.size > 8) return type;
  if (!bytes.ok() || !inside(type.at, type.bits, 64, type.size))
    return Error{ErrorCode::bad_format, "has a damaged type"};
  type.kind = TypeKind::integer;
  return type;
}

Result<Datatype> parse_real(Datatype type, unsigned flags, Bytes bytes) {
  type.big_endian = (flags & 1U) != 0;
  const unsigned first_bit = flags >> 4U & 3U;  // 0 and 1: stored, 2: implied
  bytes.skip(4);
  type.real.sign = flags >> 8U & 0xFFU;
  type.real.exponent_at = bytes.byte();
  type.real.exponent_bits = bytes.byte();
  type.real.mantissa_at = bytes.byte();
  type.real.mantissa_bits = bytes.byte();
  type.real.bias = static_cast<std::uint32_t>(bytes.number(4));
  type.real.implied = first_bit == 2;
  const bool is_vax = (flags & 0x40U) != 0;
  if (type.size > 16 || is_vax || first_bit == 3) return type;
  const Datatype::Real& real = type.real;
  if (!bytes.ok() || !inside(real.exponent_at, real.exponent_bits, 16, type.size) ||
      !inside(real.mantissa_at, real.mantissa_bits, 64, type.size) || !inside(real.sign, 1, 1, type.size) ||
      real.bias >= 1U << 16U)
    return Error{ErrorCode::bad_format, "has a damaged type"};
  type.kind = TypeKind::real;
  return type;
}

}  // namespace

std::uint64_t count(const Shape& shape) {
  std::uint64_t all = 1;
  for (const std::uint64_t size : shape)
    if (__builtin_mul_overflow(all, size, &all)) return ~std::uint64_t{0};
  return all;
}

Result<Space> parse_space(const FileBytes& file, std::span<const std::uint8_t> message) {
  Bytes bytes(message);
  const unsigned version = bytes.byte(), rank = bytes.byte(), flags = bytes.byte();
  Space space;
  if (version == 1) bytes.skip(5);
  if (version == 2) space.empty = bytes.byte() == 2;
  if (version < 1 || version > 2 || rank > kMostRank)
    return Error{ErrorCode::bad_format, "has a damaged shape"};
  for (unsigned k = 0; k < rank; ++k) space.size.push_back(file.length(bytes));
  space.most = space.size;
  for (unsigned k = 0; k < rank && (flags & 1U) != 0; ++k) space.most[k] = file.length(bytes);
  if (!bytes.ok()) return Error{ErrorCode::bad_format, "has a damaged shape"};
  return space;
}

Result<Datatype> parse_type(std::span<const std::uint8_t> message) {
  Bytes bytes(message);
  const unsigned kind = bytes.byte() & 0xFU;
  const auto flags = static_cast<unsigned>(bytes.number(3));
  Datatype type;
  type.size = static_cast<std::uint32_t>(bytes.number(4));
  if (!bytes.ok() || type.size == 0) return Error{ErrorCode::bad_format, "has a damaged type"};
  if (kind == 0) return parse_integer(type, flags, bytes);
  if (kind == 1) return parse_real(type, flags, bytes);
  const bool is_variable = kind == 9 && (flags & 0xFU) == 1;
  if (kind == 3) type.kind = TypeKind::text;
  if (is_variable) type.kind = TypeKind::variable_text;
  const unsigned pad = is_variable ? flags >> 4U & 0xFU : flags & 0xFU;
  type.pad = pad == 0   ? Datatype::Pad::ended_by_zero
             : pad == 2 ? Datatype::Pad::spaces
                        : Datatype::Pad::zeros;
  return type;
}

template <class T>
const Conversion& conversion() {
  static constexpr Conversion kConversion{sizeof(T), kReal<T>, convert<T>};
  return kConversion;
}
template const Conversion& conversion<std::int8_t>();
template const Conversion& conversion<std::uint8_t>();
template const Conversion& conversion<std::uint16_t>();
template const Conversion& conversion<std::int32_t>();
template const Conversion& conversion<std::int64_t>();
template const Conversion& conversion<float>();
template const Conversion& conversion<double>();

std::string_view problem_of(const Datatype& stored, const Conversion& conversion) {
  if (stored.kind == TypeKind::integer || (stored.kind == TypeKind::real && conversion.to_real)) return {};
  return conversion.to_real ? "has the wrong type: not numbers" : "has the wrong type: not integers";
}

}  // namespace symrig::tensor::h5
