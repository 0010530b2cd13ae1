// SPDX-License-Identifier: Apache-2.0
// Gray codes to pixel maps, and registrations of cameras with pixels of their own.
#include "arrays.hpp"
#include "bindings.hpp"
#include "caller.hpp"
#include "rig.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/image/file.hpp"
#include "symrig/report/calibration_summary.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>

namespace symrig::python {
namespace {

/// A decoded map with the JSON of `symrig calibrate`.
struct DecodedMap {
  PixelMap map;
  std::string json;
};

Result<DecodedMap> decoded(const std::string& source, const CodePhotographs& photographs,
                           const DecodeOptions& options) {
  SYMRIG_TRY(PixelMap map, decode(photographs, options));
  const CalibrationSummary summary = summarize(source, photographs, map);
  std::string json = calibration_json(summary, map);
  return DecodedMap{std::move(map), std::move(json)};
}

std::shared_ptr<DecodedMap> decode_folder(const std::string& folder, const py::object& projector,
                                          bool check_sequence, bool mirrored, py::object progress) {
  Caller caller(std::move(progress));
  ReadCodeOptions reading;
  if (!projector.is_none()) reading.projector = grid_of(projector, "projector");
  reading.progress = caller.progress();
  const DecodeOptions options{.check_sequence = check_sequence, .mirrored = mirrored};
  return std::make_shared<DecodedMap>(caller.run([&]() -> Result<DecodedMap> {
    SYMRIG_TRY(const CodePhotographs photographs, read_gray_code_folder(folder, reading));
    return decoded(folder, photographs, options);
  }));
}

std::shared_ptr<DecodedMap> decode_arrays(const FloatArray& stack, const py::object& projector,
                                          bool check_sequence, bool mirrored) {
  std::vector<Image<float>> images = images_of(stack, "the photographs");
  const Grid grid = grid_of(projector, "projector");
  std::vector<std::string> names;
  for (std::size_t k = 0; k < images.size(); ++k) names.push_back(fmt::format("photograph {}", k));
  const DecodeOptions options{.check_sequence = check_sequence, .mirrored = mirrored};
  Caller caller;
  return std::make_shared<DecodedMap>(caller.run([&]() -> Result<DecodedMap> {
    SYMRIG_TRY(const CodePhotographs photographs,
               arrange_code_photographs(grid, std::move(images), std::move(names)));
    SYMRIG_CHECK(check_gray_code(photographs));
    return decoded("photographs", photographs, options);
  }));
}

void save_map(const DecodedMap& decoded, const std::string& path) {
  check(JobFiles().writes("path", path, FileFormat::map).check());
  check(write_image(path, map_picture(decoded.map)));
}

/// Measures a registration, and saves it if a path is given. Gives its facts as JSON.
std::string calibrate(const std::string& name, const std::string& output, py::object progress) {
  check(rig_files(name).writes("output", output, FileFormat::registration).check());
  Caller caller(std::move(progress));
  std::vector<std::string> warnings;
  std::string json = caller.run([&]() -> Result<std::string> {
    SYMRIG_TRY(const OpenedRig opened, open_rig_to_calibrate(name, caller.keep_waiting()));
    Probe& rig = *opened.probe;
    RegistrationOptions options;
    options.progress = caller.progress();
    SYMRIG_TRY(const Registration found, register_camera(rig, options));
    SYMRIG_TRY(const CellWeights weights, found.weights());
    if (!output.empty()) SYMRIG_CHECK(save_registration(output, found));
    const RegistrationSummary summary{found, weights, rig.cost().rig_seconds, {}, rig.views()};
    warnings = registration_warnings(summary);
    return registration_json(summary);
  });
  for (const std::string& text : warnings) warn(text);
  return json;
}

template <class T, Image<T> PixelMap::*Member>
py::array_t<T> member(const py::object& self) {
  return constant_view_of(self.cast<const DecodedMap&>().map.*Member, self);
}

}  // namespace

void bind_calibration(py::module_& module) {
  py::class_<DecodedMap, std::shared_ptr<DecodedMap>>(module, "DecodedMap")
      .def_property_readonly("camera", [](const DecodedMap& m) { return to_python(m.map.camera); })
      .def_property_readonly("projector", [](const DecodedMap& m) { return to_python(m.map.projector); })
      .def_property_readonly("axes",
                             [](const DecodedMap& m) {
                               return m.map.axes == CodeAxes::both      ? "both"
                                      : m.map.axes == CodeAxes::columns ? "columns"
                                                                        : "rows";
                             })
      .def_property_readonly("row", member<float, &PixelMap::row>)
      .def_property_readonly("col", member<float, &PixelMap::col>)
      .def_property_readonly("row_sigma", member<float, &PixelMap::row_sigma>)
      .def_property_readonly("col_sigma", member<float, &PixelMap::col_sigma>)
      .def_property_readonly("contrast", member<float, &PixelMap::contrast>)
      .def_property_readonly("mask", member<std::uint8_t, &PixelMap::mask>)
      .def_property_readonly("decoded_share", [](const DecodedMap& m) { return m.map.decoded_share(); })
      .def_property_readonly("json", [](const DecodedMap& m) { return m.json; })
      .def("save", save_map);
  module.def("decode_folder", decode_folder);
  module.def("decode_arrays", decode_arrays);
  module.def("gray_code", [](const py::object& projector) {
    return array_of(gray_code_patterns(grid_of(projector, "projector")));
  });
  module.def("calibrate", calibrate);
}

}  // namespace symrig::python
