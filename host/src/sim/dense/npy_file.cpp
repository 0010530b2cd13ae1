// SPDX-License-Identifier: Apache-2.0
#include "sim/dense/raw_matrix.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {
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

}  // namespace

Result<RawMatrix> read_npy(std::vector<std::byte> bytes, const std::string& file) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  constexpr std::string_view kMagic = "\x93NUMPY";
  if (!text.starts_with(kMagic) || text.size() < 12)
    return no_matrix(file, "neither a .npy, a .mat nor an HDF5 file");
  const auto byte = [&](std::size_t k) { return std::size_t{static_cast<unsigned char>(text[k])}; };
  const bool first = byte(6) == 1;
  const std::size_t begin = first ? 10 : 12;
  const std::size_t size =
      first ? byte(8) | byte(9) << 8 : byte(8) | byte(9) << 8 | byte(10) << 16 | byte(11) << 24;
  if (byte(6) < 1 || byte(6) > 2 || size > text.size() - begin) return no_matrix(file, "its head is damaged");
  const std::string_view dictionary = text.substr(begin, size);
  const std::string_view kind = value_at(dictionary, "descr");
  const bool single = kind.starts_with("'<f4'");
  if (!single && !kind.starts_with("'<f8'"))
    return no_matrix(file, fmt::format("its numbers are {}", kind.substr(0, kind.find(','))));
  auto shape = npy_shape(value_at(dictionary, "shape"));
  if (!shape) return no_matrix(file, "its shape cannot be read, or is too large");
  const bool fortran = value_at(dictionary, "fortran_order").starts_with("True");
  return RawMatrix{.bytes = std::move(bytes),
                   .data = begin + size,
                   .type = single ? NumberType::f32 : NumberType::f64,
                   .shape = *std::move(shape),
                   .columns_first = fortran};
}

}  // namespace symrig::sim
