// SPDX-License-Identifier: Apache-2.0
#include "sim/dense/raw_matrix.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

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

}  // namespace symrig::sim
