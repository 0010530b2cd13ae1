// SPDX-License-Identifier: Apache-2.0
#include "sim/dense/mat_level4.hpp"

#include <array>
#include <optional>

namespace symrig::sim {
namespace {

constexpr std::size_t kHeadBytes = 20;  // type, rows, columns, imaginary part, length of the name
constexpr std::uint32_t kLongestName = 256;

/// P of the type MOPT (M: byte order, O: 0, P: numbers, T: full, text or sparse).
std::optional<NumberType> level4_type(std::uint32_t type) {
  constexpr std::array kTypes{NumberType::f64, NumberType::f32, NumberType::i32,
                              NumberType::i16, NumberType::u16, NumberType::u8};
  const std::uint32_t p = type / 10 % 10;
  if (type >= 60 || p >= kTypes.size()) return std::nullopt;
  return kTypes[p];
}

}  // namespace

bool is_level4(std::string_view bytes) {
  return bytes.size() > kHeadBytes && level4_type(mat_word(bytes, 0)) && mat_word(bytes, 0) % 10 <= 2 &&
         mat_word(bytes, 12) <= 1 && mat_word(bytes, 16) >= 1 && mat_word(bytes, 16) <= kLongestName;
}

Result<std::vector<MatVariable>> level4_variables(std::string_view bytes, const std::string& file) {
  std::vector<MatVariable> all;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::string_view rest = bytes.substr(at);
    if (!is_level4(rest)) return no_matrix(file, "the head of a variable is damaged");
    const std::uint64_t rows = mat_word(rest, 4), cols = mat_word(rest, 8), name = mat_word(rest, 16);
    const NumberType type = *level4_type(mat_word(rest, 0));
    const std::uint64_t parts = 1 + mat_word(rest, 12), left = rest.size() - kHeadBytes;
    if (name > left || (rows > 0 && cols > (left - name) / rows / parts / size_of(type)))
      return no_matrix(file, "a variable is cut off");
    MatVariable variable{.name = std::string(rest.substr(kHeadBytes, name - 1)),
                         .shape = {static_cast<std::int64_t>(rows), static_cast<std::int64_t>(cols)},
                         .type = type,
                         .data = at + kHeadBytes + name};
    if (parts > 1) variable.fault = "is complex";
    if (mat_word(rest, 0) % 10 != 0) variable.fault = "is text or sparse";
    at = variable.data + rows * cols * parts * size_of(type);
    all.push_back(std::move(variable));
  }
  return all;
}

}  // namespace symrig::sim
