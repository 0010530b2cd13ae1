// SPDX-License-Identifier: Apache-2.0
// The sensor's noise model, and frames of a bracket to one photograph.

#include "arrays.hpp"
#include "bindings.hpp"
#include "caller.hpp"
#include "symrig/hdr/merge.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/image.hpp"
#include "symrig/job/relight.hpp"

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>

namespace symrig::python {

namespace {

using CodeArray = py::array_t<std::uint16_t, py::array::c_style>;
using DeadArray = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>;

constexpr double kLongestExposure = 1e6;  // [s] far from the limit of nanoseconds in 64 bits

NoiseModel usable(const NoiseModel& model) {
  if (model.valid()) return model;
  throw Failure{{ErrorCode::bad_argument, "the noise model is not usable: " + model.to_string(),
                 "give 1 to 16 bits, a positive gain and full well, and a pedestal below saturation"}};
}

Nanoseconds exposure_of(double seconds) {
  if (seconds > 0 && seconds < kLongestExposure) return Nanoseconds{std::llround(seconds * 1e9)};
  throw Failure{{ErrorCode::bad_argument, fmt::format("exposure {} is not a time in seconds", seconds),
                 "give seconds above 0"}};
}

/// Channel planes of frame k, from [count, rows, cols] or [count, rows, cols, channels].
std::vector<std::uint16_t> planes_of_frame(const CodeArray& frames, py::ssize_t k, std::size_t pixels,
                                           int channels) {
  const std::uint16_t* const from = frames.data() + k * static_cast<py::ssize_t>(pixels) * channels;
  std::vector<std::uint16_t> planes(pixels * channels);
  for (int channel = 0; channel < channels; ++channel)
    for (std::size_t i = 0; i < pixels; ++i) planes[channel * pixels + i] = from[i * channels + channel];
  return planes;
}

struct FrameShape {
  Grid grid;
  int channels = 1;
};

FrameShape shape_of(const CodeArray& frames, std::size_t exposures) {
  if ((frames.ndim() != 3 && frames.ndim() != 4) || frames.shape(0) != static_cast<py::ssize_t>(exposures) ||
      frames.size() == 0)
    throw Failure{
        {ErrorCode::size_mismatch,
         fmt::format("frames have {} dimensions, and there are {} exposures", frames.ndim(), exposures),
         "give frames of shape (exposures, rows, cols) or (exposures, rows, cols, channels)"}};
  return {{static_cast<int>(frames.shape(1)), static_cast<int>(frames.shape(2))},
          frames.ndim() == 4 ? static_cast<int>(frames.shape(3)) : 1};
}

py::object merge_frames(const CodeArray& codes, const std::vector<double>& exposures, const NoiseModel& noise,
                        double scale, const py::object& black, const py::object& dead) {
  const FrameShape shape = shape_of(codes, exposures.size());
  std::vector<std::vector<std::uint16_t>> planes;
  std::vector<Frame> frames;
  for (std::size_t k = 0; k < exposures.size(); ++k)
    planes.push_back(planes_of_frame(codes, static_cast<py::ssize_t>(k), shape.grid.size(), shape.channels));
  for (std::size_t k = 0; k < exposures.size(); ++k) frames.push_back({planes[k], exposure_of(exposures[k])});
  std::optional<Radiance> dark;
  if (!black.is_none()) dark = radiance_of(black, shape.grid, shape.channels, "black");
  Image<std::uint8_t> unusable;
  if (!dead.is_none()) {
    const DeadArray flags = DeadArray::ensure(dead);
    if (!flags) throw py::error_already_set();
    if (flags.ndim() != 2 || flags.shape(0) != shape.grid.rows || flags.shape(1) != shape.grid.cols)
      throw Failure{{ErrorCode::size_mismatch, "the mask of dead pixels has another shape than the frames",
                     "give an array of shape (rows, cols)"}};
    unusable = Image<std::uint8_t>(shape.grid);
    for (py::ssize_t i = 0; i < flags.size(); ++i) unusable.values()[i] = flags.data()[i] != 0 ? 1 : 0;
  }
  const MergeOptions options{scale, dark ? &*dark : nullptr, dead.is_none() ? nullptr : &unusable};
  Result<Radiance> merged = [&] {
    const py::gil_scoped_release unlocked;
    return merge(frames, shape.grid, shape.channels, noise, options);
  }();
  return to_python(value_of(std::move(merged)));
}

}  // namespace

void bind_photometry(py::module_& module) {
  py::class_<NoiseModel>(module, "NoiseModel",
                         "The relation between light and one raw sample of a linear sensor, with its noise.")
      .def_static(
          "from_electrons",
          [](double full_well, double read_noise, int bits, double pedestal) {
            return usable(NoiseModel::from_electrons({full_well, read_noise, bits, pedestal}));
          },
          py::arg("full_well") = 20'000.0, py::arg("read_noise") = 6.0, py::arg("bits") = 12,
          py::arg("pedestal") = 64.0,
          "A sensor described in electrons: full well and read noise [e-], pedestal [DN].")
      .def_static(
          "from_variance_line",
          [](double offset, double slope, int bits, double pedestal) {
            return usable(NoiseModel::from_variance_line({offset, slope, bits, pedestal}));
          },
          py::arg("offset") = 1.0, py::arg("slope") = 1.0, py::arg("bits") = 12, py::arg("pedestal") = 64.0,
          "A photon transfer curve: Var[code] = offset + slope (code - pedestal) [DN^2].")
      .def_property_readonly("full_well", &NoiseModel::full_well, "[e-]")
      .def_property_readonly("read_noise", &NoiseModel::read_noise, "[e- rms]")
      .def_property_readonly("gain", &NoiseModel::gain, "[DN/e-]")
      .def_property_readonly("pedestal", &NoiseModel::pedestal, "[DN]")
      .def_property_readonly("bits", &NoiseModel::bits, "significant bits of a code")
      .def("__repr__", [](const NoiseModel& model) { return "<NoiseModel: " + model.to_string() + ">"; });
  module.def("merge", merge_frames);
}

namespace {

py::bytes display_png(const FloatArray& picture, double exposure) {
  const std::vector<std::uint8_t> png = encode_png(to_display(image_of(picture, "the picture"), exposure));
  return {reinterpret_cast<const char*>(png.data()), png.size()};
}

py::array_t<float> light(const std::string& name, const py::handle& shape) {
  std::string warning;
  Image<float> picture = value_of(read_light(name, grid_of(shape, "the grid"), "the grid", &warning));
  if (!warning.empty()) warn(warning);
  return array_of(std::move(picture));
}

py::dict light_names() {
  py::dict names;
  for (const BuiltInLight& one : built_in_lights()) names[py::str(one.name)] = std::string(one.meaning);
  return names;
}

}  // namespace

void bind_pictures(py::module_& module) {
  module.def("read_image", [](const std::string& path) { return array_of(value_of(read_image(path))); });
  module.def("write_image", [](const std::string& path, const FloatArray& picture) {
    check(write_image(path, image_of(picture, "the picture")));
  });
  module.def("gray",
             [](const FloatArray& picture) { return array_of(to_gray(image_of(picture, "the picture"))); });
  module.def("display_png", display_png);
  module.def("light", light);
  module.def("light_names", light_names);
}

}  // namespace symrig::python
