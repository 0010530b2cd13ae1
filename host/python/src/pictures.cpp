// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"
#include "bindings.hpp"
#include "failure.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/resample.hpp"
#include "symrig/job/light.hpp"

#include <string>
#include <utility>

namespace symrig::python {
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
