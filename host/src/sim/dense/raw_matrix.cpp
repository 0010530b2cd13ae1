// SPDX-License-Identifier: Apache-2.0

#include "sim/dense/raw_matrix.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {

namespace {

template <class T>
double number_at(const std::byte* from) {
  T value{};
  std::memcpy(&value, from, sizeof value);
  return static_cast<double>(value);
}

}  // namespace

std::size_t size_of(NumberType type) {
  switch (type) {
    case NumberType::f64:
      return 8;
    case NumberType::f32:
    case NumberType::i32:
    case NumberType::u32:
      return 4;
    case NumberType::i16:
    case NumberType::u16:
      return 2;
    case NumberType::i8:
    case NumberType::u8:
      return 1;
  }
  return 1;
}

double RawMatrix::at(std::size_t k) const {
  const std::byte* const from = bytes.data() + data + k * size_of(type);
  switch (type) {
    case NumberType::f32:
      return number_at<float>(from);
    case NumberType::f64:
      return number_at<double>(from);
    case NumberType::i8:
      return number_at<std::int8_t>(from);
    case NumberType::u8:
      return number_at<std::uint8_t>(from);
    case NumberType::i16:
      return number_at<std::int16_t>(from);
    case NumberType::u16:
      return number_at<std::uint16_t>(from);
    case NumberType::i32:
      return number_at<std::int32_t>(from);
    case NumberType::u32:
      return number_at<std::uint32_t>(from);
  }
  return 0;
}

bool is_matrix_shape(const std::vector<std::int64_t>& shape) {
  if (!std::all_of(shape.begin(), shape.end(),
                   [](std::int64_t size) { return size >= 1 && size <= kMostDensePixels; }))
    return false;
  if (shape.size() == 2) return shape[0] == shape[1];
  return shape.size() == 4 && shape[0] == shape[2] && shape[1] == shape[3] &&
         shape[0] * shape[1] <= kMostDensePixels;
}

Result<Grid> stated_size(double rows, double cols, const std::string& name) {
  const auto good = [](double v) {
    return v >= 1 && v <= static_cast<double>(kMostDensePixels) && v == std::floor(v);
  };
  if (!good(rows) || !good(cols)) return Error{ErrorCode::bad_format, name + " is no size of a picture"};
  return Grid{static_cast<int>(rows), static_cast<int>(cols)};
}

Error no_matrix(const std::string& file, const std::string& why) {
  return {ErrorCode::bad_format, fmt::format("{}: {}", file, why),
          "give T as real floats: .npy of numpy.save(), .mat of MATLAB or Octave, or HDF5"};
}

namespace {

std::optional<std::int64_t> whole(std::string_view text) {
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

/// The text after 'key': in the head's dictionary.
std::string_view value_at(std::string_view dictionary, std::string_view key) {
  const std::size_t at = dictionary.find(fmt::format("'{}':", key));
  if (at == std::string_view::npos) return {};
  std::string_view rest = dictionary.substr(at + key.size() + 3);
  rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
  return rest;
}

std::optional<std::vector<std::int64_t>> npy_shape(std::string_view text) {
  if (!text.starts_with('(')) return std::nullopt;
  text = text.substr(1, text.find(')') == std::string_view::npos ? 0 : text.find(')') - 1);
  std::vector<std::int64_t> shape;
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    std::string_view item = text.substr(0, comma);
    item.remove_prefix(std::min(item.find_first_not_of(' '), item.size()));
    if (!item.empty()) {
      const auto size = whole(item);
      if (!size || *size < 1 || *size > kMostDensePixels) return std::nullopt;
      shape.push_back(*size);
    }
    text = comma == std::string_view::npos ? std::string_view{} : text.substr(comma + 1);
  }
  return shape;
}

/// What a head says of the numbers.
struct NpyNumbers {
  NumberType type;
  bool swapped;  ///< the first byte is the most significant one
};

/// '<f4', '>f8'; the byte order of NumPy's "=" is that of the machine that reads.
std::optional<NpyNumbers> npy_numbers(std::string_view kind) {
  if (kind.size() < 5 || kind[0] != '\'' || kind[4] != '\'') return std::nullopt;
  if (kind[1] != '<' && kind[1] != '>' && kind[1] != '=') return std::nullopt;
  const std::string_view type = kind.substr(2, 2);
  if (type != "f4" && type != "f8") return std::nullopt;
  return NpyNumbers{type == "f4" ? NumberType::f32 : NumberType::f64, kind[1] == '>'};
}

void swap_bytes(std::span<std::byte> bytes, std::size_t width) {
  for (std::size_t at = 0; at + width <= bytes.size(); at += width)
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                 bytes.begin() + static_cast<std::ptrdiff_t>(at + width));
}

/// What a file is that is no .npy file.
Error foreign(std::string_view text, const std::string& file) {
  if (text.starts_with("PK\x03\x04")) return no_matrix(file, "is a ZIP archive (.npz?), not one matrix");
  if (text.starts_with("# Created by Octave")) return no_matrix(file, "is Octave's text format");
  if (text.starts_with("MATLAB 5.0") && text.size() > 127 && text.substr(126, 2) == "MI")
    return no_matrix(file, "is a MAT file of a big-endian machine");
  return no_matrix(file, "neither a .npy, a .mat nor an HDF5 file");
}

}  // namespace

Result<RawMatrix> read_npy(std::vector<std::byte> bytes, const std::string& file) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  constexpr std::string_view kMagic = "\x93NUMPY";
  if (!text.starts_with(kMagic) || text.size() < 12) return foreign(text, file);
  const auto byte = [&](std::size_t k) { return std::size_t{static_cast<unsigned char>(text[k])}; };
  const bool first = byte(6) == 1;
  const std::size_t begin = first ? 10 : 12;
  const std::size_t size =
      first ? byte(8) | byte(9) << 8 : byte(8) | byte(9) << 8 | byte(10) << 16 | byte(11) << 24;
  if (byte(6) < 1 || byte(6) > 3)
    return no_matrix(file, fmt::format("is of version {}.{} of .npy; 1.0 to 3.0 are read", byte(6), byte(7)));
  if (size > text.size() - begin) return no_matrix(file, "its head is damaged");
  const std::string_view dictionary = text.substr(begin, size);
  const std::string_view kind = value_at(dictionary, "descr");
  const auto numbers = npy_numbers(kind);
  if (!numbers) return no_matrix(file, fmt::format("its numbers are {}", kind.substr(0, kind.find(','))));
  auto shape = npy_shape(value_at(dictionary, "shape"));
  if (!shape) return no_matrix(file, "its shape cannot be read, or is too large");
  const bool fortran = value_at(dictionary, "fortran_order").starts_with("True");
  if (numbers->swapped) swap_bytes(std::span(bytes).subspan(begin + size), size_of(numbers->type));
  return RawMatrix{.bytes = std::move(bytes),
                   .data = begin + size,
                   .type = numbers->type,
                   .shape = *std::move(shape),
                   .columns_first = fortran};
}

}  // namespace symrig::sim
