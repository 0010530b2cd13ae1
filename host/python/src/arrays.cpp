// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include "caller.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

#include <fmt/format.h>
#include <pybind11/stl.h>

namespace symrig::python {
namespace {

constexpr py::ssize_t kMostRows = 1 << 30;

std::string shape_text(const py::array& array) {
  std::string text;
  for (py::ssize_t k = 0; k < array.ndim(); ++k)
    text += fmt::format("{}{}", k == 0 ? "" : ", ", array.shape(k));
  return "(" + text + ")";
}

/// The picture in an array whose dimensions from `first` on are rows, cols and perhaps channels.
Grid checked_grid(const py::array& array, py::ssize_t first, const std::string& name) {
  const py::ssize_t rows = array.shape(first), cols = array.shape(first + 1);
  if (rows > 0 && cols > 0 && rows < kMostRows && cols < kMostRows) {
    const Grid grid{static_cast<int>(rows), static_cast<int>(cols)};
    if (grid.valid()) return grid;
  }
  throw Failure{{ErrorCode::size_mismatch, fmt::format("{} has the shape {}", name, shape_text(array)),
                 "give a picture with at least one pixel"}};
}

Failure wrong_dimensions(const py::array& array, const std::string& name, const char* wanted) {
  return {{ErrorCode::size_mismatch, fmt::format("{} has the shape {}", name, shape_text(array)),
           fmt::format("give an array of shape {}", wanted)}};
}

template <class T>
Image<T> planes_of(const T* values, Grid grid, int channels) {
  Image<T> image(grid, channels);
  if (channels == 1) {
    std::copy(values, values + grid.size(), image.values().begin());
    return image;
  }
  for (int channel = 0; channel < channels; ++channel) {
    const std::span<T> plane = image.plane(channel);
    for (std::size_t i = 0; i < plane.size(); ++i) plane[i] = values[i * channels + channel];
  }
  return image;
}

/// The picture, whose values may be NaN.
Image<float> unchecked_image_of(const FloatArray& array, const std::string& name) {
  if (array.ndim() != 2 && array.ndim() != 3)
    throw wrong_dimensions(array, name, "(rows, cols) or (rows, cols, channels)");
  const Grid grid = checked_grid(array, 0, name);
  const auto channels = static_cast<int>(array.ndim() == 3 ? array.shape(2) : 1);
  if (channels < 1) throw wrong_dimensions(array, name, "(rows, cols, channels) with a channel");
  return planes_of(array.data(), grid, channels);
}

/// Real numbers. Others would lose a part on the way to floats.
FloatArray floats_of(const py::handle& value, const std::string& name) {
  const py::array given = py::array::ensure(value);
  const bool real = given && std::string_view("biufO").find(given.dtype().kind()) != std::string_view::npos;
  if (FloatArray array = real ? FloatArray::ensure(given) : FloatArray(); real && array) return array;
  throw Failure{
      {ErrorCode::bad_value,
       fmt::format("{} is no array of numbers: {}", name, std::string(py::str(py::type::of(value)))),
       "give an array of real numbers"}};
}

/// A picture, or one number for all pixels.
Image<float> filled_or_image(const py::object& value, const Image<float>& like, const std::string& name) {
  const FloatArray array = floats_of(value, name);
  if (array.ndim() != 0) return unchecked_image_of(array, name);
  return Image<float>(like.grid(), like.channels(), *array.data());
}

using MaskArray = py::array_t<bool, py::array::c_style | py::array::forcecast>;

Image<std::uint8_t> mask_of(const py::object& value, const Image<float>& like, const std::string& name) {
  const MaskArray array = MaskArray::ensure(value);
  if (!array)
    throw Failure{{ErrorCode::bad_value, name + " is no array", "give True or False for each value"}};
  if (array.size() != static_cast<py::ssize_t>(like.values().size()))
    throw Failure{{ErrorCode::size_mismatch,
                   fmt::format("{} has the shape {}, the photograph another", name, shape_text(array)),
                   "give one value for each value of the photograph"}};
  std::vector<std::uint8_t> bytes(array.size());
  std::copy(array.data(), array.data() + array.size(), bytes.begin());
  return planes_of(bytes.data(), like.grid(), like.channels());
}

void check_size(const Image<float>& image, Grid grid, int channels, const std::string& name) {
  if (image.grid() == grid && image.channels() == channels) return;
  throw Failure{{ErrorCode::size_mismatch,
                 fmt::format("{} is {} with {} channels, the rig states {} with {}", name,
                             to_string(image.grid()), image.channels(), to_string(grid), channels),
                 "answer one photograph of the rig's grid for each pattern"}};
}

/// Invalid values are 0 in all three pictures (Radiance).
void clear_invalid(Radiance& photograph) {
  for (std::size_t i = 0; i < photograph.valid.values().size(); ++i)
    if (photograph.valid.values()[i] == 0) photograph.mean.values()[i] = photograph.variance.values()[i] = 0;
}

}  // namespace

Image<float> image_of(const FloatArray& array, const std::string& name) {
  Image<float> image = unchecked_image_of(array, name);
  check(check_finite(image, name));
  return image;
}

std::vector<Image<float>> images_of(const FloatArray& arrays, const std::string& name) {
  if (arrays.ndim() != 3) throw wrong_dimensions(arrays, name, "(count, rows, cols)");
  std::vector<Image<float>> images;
  if (arrays.shape(0) == 0) return images;
  const Grid grid = checked_grid(arrays, 1, name);
  for (py::ssize_t k = 0; k < arrays.shape(0); ++k) {
    images.push_back(planes_of(arrays.data() + k * grid.size(), grid, 1));
    check(check_finite(images.back(), fmt::format("{} ({} of {})", name, k + 1, arrays.shape(0))));
  }
  return images;
}

py::array array_of(const std::vector<Image<float>>& images) {
  if (images.empty()) return FloatArray(std::vector<py::ssize_t>{0, 0, 0});
  const Grid grid = images.front().grid();
  const py::ssize_t channels = images.front().channels();
  const auto count = static_cast<py::ssize_t>(images.size());
  FloatArray all(std::vector<py::ssize_t>{count, channels, grid.rows, grid.cols});
  float* to = all.mutable_data();
  for (const Image<float>& image : images) to = std::copy(image.values().begin(), image.values().end(), to);
  if (channels == 1) return all.reshape({count, py::ssize_t{grid.rows}, py::ssize_t{grid.cols}});
  return all.attr("transpose")(0, 2, 3, 1).cast<py::array>();
}

Radiance radiance_of(const py::handle& answer, Grid grid, int channels, const std::string& name) {
  const bool stated = py::hasattr(answer, "mean") && py::hasattr(answer, "variance");
  if (!stated || py::isinstance<py::array>(answer)) {
    Image<float> mean = image_of(floats_of(answer, name), name);
    check_size(mean, grid, channels, name);
    return {std::move(mean), Image<float>(grid, channels), Image<std::uint8_t>(grid, channels, 1)};
  }
  Radiance photograph{unchecked_image_of(floats_of(answer.attr("mean"), name), name), {}, {}};
  check_size(photograph.mean, grid, channels, name);
  photograph.variance = filled_or_image(answer.attr("variance"), photograph.mean, "the variance of " + name);
  check_size(photograph.variance, grid, channels, "the variance of " + name);
  const py::object valid = py::getattr(answer, "valid", py::none());
  photograph.valid = valid.is_none() ? Image<std::uint8_t>(grid, channels, 1)
                                     : mask_of(valid, photograph.mean, "the valid mask of " + name);
  clear_invalid(photograph);
  check(check_finite(photograph.mean, name));
  check(check_finite(photograph.variance, "the variance of " + name));
  for (const float v : photograph.variance.values())
    if (v < 0)
      throw Failure{{ErrorCode::bad_value, "the variance of " + name + " is negative", "give 0 or more"}};
  return photograph;
}

py::object to_python(Radiance&& radiance) {
  py::object valid = array_of(std::move(radiance.valid)).attr("view")("bool");
  return py::module_::import("symrig._probe")
      .attr("Radiance")(array_of(std::move(radiance.mean)), array_of(std::move(radiance.variance)),
                        std::move(valid));
}

Grid grid_of(const py::handle& pair, const std::string& name) {
  try {
    const auto [rows, cols] = pair.cast<std::pair<int, int>>();
    if (const Grid grid{rows, cols}; rows > 0 && cols > 0 && grid.valid()) return grid;
  } catch (const py::cast_error&) {  // told below
  }
  throw Failure{{ErrorCode::bad_argument, fmt::format("{} is {}", name, py::repr(pair).cast<std::string>()),
                 "give (rows, cols), two whole numbers above 0"}};
}

}  // namespace symrig::python
