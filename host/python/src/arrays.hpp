// SPDX-License-Identifier: Apache-2.0
// Pictures as numpy arrays: [rows, cols] for one channel, [rows, cols, channels] for several.
#pragma once

#include "symrig/image/image.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>

namespace symrig::python {

namespace py = pybind11;

/// Any array of numbers, converted to 32-bit floats in C order if it is not one.
using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;

/// [rows, cols] → 1 channel, [rows, cols, channels] → planes.  name: for messages.
/// fails (Failure): size_mismatch (other dimensions), bad_value (NaN or infinity).
Image<float> image_of(const FloatArray& array, const std::string& name);

/// [count, rows, cols] → pictures of one channel.  fails (Failure): as image_of.
std::vector<Image<float>> images_of(const FloatArray& arrays, const std::string& name);

/// The pictures as one array: [count, rows, cols] or [count, rows, cols, channels].
py::array array_of(const std::vector<Image<float>>& images);

/// A view of the memory of an Image or a StoredImage; `owner` keeps it alive.
template <class Picture>
auto view_of(const Picture& image, const py::object& owner) {
  using T = typename decltype(image.values())::value_type;
  const py::ssize_t size = sizeof(T), rows = image.grid().rows, cols = image.grid().cols;
  std::vector<py::ssize_t> shape{rows, cols}, strides{cols * size, size};
  if (image.channels() != 1) {
    shape.push_back(image.channels());
    strides.push_back(rows * cols * size);
  }
  return py::array_t<T>(shape, strides, image.values().data(), owner);
}

/// Gives the memory of a picture to numpy without a copy.
template <class T>
py::array_t<T> array_of(Image<T>&& image) {
  auto kept = std::make_unique<Image<T>>(std::move(image));
  const Image<T>& picture = *kept;
  const py::capsule owner(kept.release(), [](void* memory) { delete static_cast<Image<T>*>(memory); });
  return view_of(picture, owner);
}

/// A view that Python cannot write to.
template <class Picture>
auto constant_view_of(const Picture& image, const py::object& owner) {
  auto view = view_of(image, owner);
  view.attr("flags").attr("writeable") = false;
  return view;
}

/// A photograph from Python: an array (exact and valid everywhere), or an object with mean, variance and
/// valid. fails (Failure): size_mismatch, bad_value.
Radiance radiance_of(const py::handle& answer, Grid grid, int channels, const std::string& name);

/// A photograph as a symrig.Radiance.
py::object to_python(Radiance&& radiance);

/// (rows, cols), both above 0.  fails (Failure): bad_argument.
Grid grid_of(const py::handle& pair, const std::string& name);
inline py::tuple to_python(Grid grid) {
  return py::make_tuple(grid.rows, grid.cols);
}

}  // namespace symrig::python
