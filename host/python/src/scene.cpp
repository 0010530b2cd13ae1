// SPDX-License-Identifier: Apache-2.0
// StoredScene: a loaded or captured scene. symrig/_scene.py makes a LinearOperator of it.
#include "arrays.hpp"
#include "bindings.hpp"
#include "caller.hpp"
#include "rig.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/file.hpp"
#include "symrig/job/evaluation.hpp"
#include "symrig/job/relight.hpp"
#include "symrig/report/html_report.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/camera_transport.hpp"
#include "symrig/tensor/transport_operator.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>

namespace symrig::python {
namespace {

using Shared = std::shared_ptr<const StoredScene>;
using ViewIndex = std::optional<std::pair<int, int>>;

/// Applies without the interpreter's lock.
template <class Work>
auto unlocked(Work&& work) {
  auto result = [&] {
    const py::gil_scoped_release free;
    return std::forward<Work>(work)();
  }();
  return value_of(std::move(result));
}

/// The library reads the array's memory and numpy owns the photograph's: no copy on the way.
py::array_t<float> apply(const StoredScene& scene, const FloatArray& light) {
  const TransportTensor& tensor = scene.tensor;
  const std::span<const float> pattern(light.data(), static_cast<std::size_t>(light.size()));
  check(check_finite(pattern, tensor.projector_grid(), "the light"));
  return array_of(unlocked([&] { return tensor.apply_values(pattern); }));
}

/// Seconds of the fastest of several applications, without Python: what benchmarks compare with.
double seconds_of_apply(const StoredScene& scene, const FloatArray& light, int times) {
  const Image<float> pattern = image_of(light, "the light");
  double fastest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < times; ++k) {
    const Stopwatch watch;
    value_of(scene.tensor.apply(pattern));
    fastest = std::min(fastest, watch.seconds());
  }
  return fastest;
}

py::array apply_batch(const StoredScene& scene, const FloatArray& lights) {
  const std::vector<Image<float>> patterns = images_of(lights, "the lights");
  return array_of(unlocked([&] { return scene.tensor.apply_batch(patterns); }));
}

py::array_t<float> dual(const StoredScene& scene, const FloatArray& light) {
  const Image<float> shining = image_of(light, "the light");
  return array_of(unlocked([&] { return scene.tensor.apply_transposed(shining); }));
}

py::array_t<float> adjoint(const StoredScene& scene, const FloatArray& picture) {
  const Image<float> seen = image_of(picture, "the picture");
  return array_of(unlocked([&] { return apply_adjoint(scene.tensor, seen); }));
}

std::optional<View> view_at(const ViewIndex& index) {
  return index ? std::optional(View{index->first, index->second}) : std::nullopt;
}

py::array_t<float> relight_views(const StoredScene& scene, const FloatArray& light, const py::handle& layout,
                                 const ViewIndex& from, const ViewIndex& to) {
  ViewLayout views = scene.tensor.camera_tree().views();
  if (!layout.is_none()) {
    const Grid given = grid_of(layout, "views");
    views = {given.rows, given.cols};
  }
  if ((from || to) && views.single())
    throw Failure{{ErrorCode::bad_argument, "the scene file has only one view",
                   "give views=(rows, cols): the views that tile its pictures"}};
  const Image<float> shining = image_of(light, "the light");
  const ViewRelight what{views, view_at(from), view_at(to)};
  return array_of(unlocked([&] { return relight(scene.tensor, shining, what); }));
}

/// T as a matrix: [channels, camera pixels, projector pixels].
py::array dense(const StoredScene& scene, double most_bytes) {
  const TransportTensor& tensor = scene.tensor;
  if (tensor.dense_bytes() > most_bytes)
    throw Failure{
        {ErrorCode::limit,
         fmt::format("T as a matrix has {:.3g} bytes, the limit is {:.3g}", tensor.dense_bytes(), most_bytes),
         "use the scene as an operator, or give a larger limit"}};
  const py::ssize_t rows = tensor.camera_grid().size(), cols = tensor.projector_grid().size();
  const py::ssize_t channels = tensor.channels();
  FloatArray matrix(std::vector<py::ssize_t>{channels, rows, cols});
  float* const to = matrix.mutable_data();
  constexpr py::ssize_t kTogether = 64;
  for (py::ssize_t first = 0; first < cols; first += kTogether) {
    const py::ssize_t count = std::min(kTogether, cols - first);
    std::vector<Image<float>> units(static_cast<std::size_t>(count), Image<float>(tensor.projector_grid()));
    for (py::ssize_t k = 0; k < count; ++k) units[k].values()[first + k] = 1;
    const auto columns = unlocked([&] { return tensor.apply_batch(units); });
    for (py::ssize_t k = 0; k < count; ++k)
      for (py::ssize_t i = 0; i < channels * rows; ++i) to[i * cols + first + k] = columns[k].values()[i];
  }
  return matrix;
}

/// Copied from the scene's pointer: Python keeps the rows as long as it uses them.
std::shared_ptr<CameraTransport> camera_of(const StoredScene& scene) {
  return std::const_pointer_cast<CameraTransport>(scene.camera);
}

py::array_t<float> apply_camera(const CameraTransport& camera, const FloatArray& light) {
  const Image<float> pattern = image_of(light, "the light");
  return array_of(unlocked([&] { return camera.apply(pattern); }));
}

py::array apply_camera_batch(const CameraTransport& camera, const FloatArray& lights) {
  const std::vector<Image<float>> patterns = images_of(lights, "the lights");
  return array_of(unlocked([&] { return camera.apply_batch(patterns); }));
}

py::array_t<float> adjoint_camera(const CameraTransport& camera, const FloatArray& picture) {
  const Image<float> seen = image_of(picture, "the picture");
  return array_of(unlocked([&] { return camera.adjoint(seen); }));
}

/// With colours, where the camera has a mosaic.
py::array relight_camera(const std::shared_ptr<CameraTransport>& camera, const FloatArray& lights) {
  const std::vector<Image<float>> patterns = images_of(lights, "the lights");
  return array_of(unlocked([&]() -> Result<std::vector<Image<float>>> {
    SYMRIG_TRY(const Relighter relighter, Relighter::begin(camera));
    return relighter.relight_batch(patterns);
  }));
}

py::list levels(const StoredScene& scene) {
  py::list all;
  for (const NodeCounts& level : node_counts(scene.tensor))
    all.append(py::make_tuple(level.leaves.rank1, level.leaves.low_rank, level.leaves.empty,
                              level.leaves.scalar, level.subdivided));
  return all;
}

py::list held_out(const py::object& self) {
  const auto& scene = self.cast<const StoredScene&>();
  py::list all;
  for (const HeldOut& one : scene.held_out)
    all.append(py::make_tuple(one.name, constant_view_of(one.pattern, self),
                              constant_view_of(one.photograph, self)));
  return all;
}

py::list held_out_errors(const StoredScene& scene) {
  py::list all;
  for (const HeldOutError& one : value_of(judge_by_photographs(scene)))
    all.append(py::make_tuple(one.name, one.rms, one.relative()));
  return all;
}

py::dict errors_of(const TransportErrors& errors) {
  py::dict all;
  all["frobenius"] = errors.frobenius;
  all["indirect"] = errors.indirect;
  all["flood"] = errors.flood;
  all["relight bar"] = errors.relight_bar;
  all["relight random"] = errors.relight_random;
  all["relight natural"] = errors.relight_natural;
  all["bar_indirect"] = errors.bar_indirect;
  return all;
}

void warn_of_other_scene(const StoredScene& scene, const Judged& judged) {
  const std::string text =
      other_scene_warning("the scene", differences_of_scene(captured_scene(scene), judged.rig));
  if (!text.empty()) warn(text);
}

py::tuple errors_by_truth(const StoredScene& scene, const std::string& rig, py::object progress) {
  Caller caller(std::move(progress));
  const Judged judged = caller.run([&] { return judge_by_truth(scene.tensor, rig, caller.progress()); });
  warn_of_other_scene(scene, judged);
  return py::make_tuple(errors_of(judged.errors.value), errors_of(judged.errors.half_width));
}

py::tuple camera_errors_by_truth(const CameraTransport& camera, const std::string& rig, py::object progress) {
  Caller caller(std::move(progress));
  const ErrorEstimate errors =
      caller.run([&] { return judge_camera_by_truth(camera, rig, caller.progress()); });
  return py::make_tuple(errors_of(errors.value), errors_of(errors.half_width));
}

std::string report_page(const StoredScene& scene, const std::string& title, py::object progress) {
  Caller caller(std::move(progress));
  ReportOptions options;
  options.title = title;
  options.progress = caller.progress();
  return caller.run([&]() -> Result<std::string> {
    SYMRIG_CHECK(add_truths(scene, options));
    return html_report(scene, options);
  });
}

Shared stopped(const StoredScene& scene, int level) {
  if (!scene.tensor.symmetric())
    throw Failure{{ErrorCode::bad_argument, "the scene is not symmetric: it was not captured level by level",
                   "use a scene of symrig capture"}};
  if (level < 0 || level >= scene.tensor.levels())
    throw Failure{{ErrorCode::bad_argument, fmt::format("there is no level {}", level),
                   fmt::format("levels are 0 to {}", scene.tensor.levels() - 1)}};
  return unlocked([&]() -> Result<Shared> {
    SYMRIG_TRY(TransportTensor tensor, scene.tensor.stopped_at(level));
    return Shared(std::make_shared<StoredScene>(StoredScene{std::move(tensor), scene.capture_json, {}}));
  });
}

Shared load(const std::string& path, std::int64_t memory) {
  return unlocked([&]() -> Result<Shared> {
    SYMRIG_TRY(StoredScene scene, load_scene(path, {.memory = memory}));
    return Shared(std::make_shared<StoredScene>(std::move(scene)));
  });
}

void save(const StoredScene& scene, const std::string& path) {
  check(JobFiles().writes("path", path, FileFormat::scene).check());
  const Result<void> saved = [&] {
    const py::gil_scoped_release free;
    return save_scene(path, scene);
  }();
  check(saved);
}

}  // namespace

py::tuple errors_by_rig(const StoredScene& scene, Probe& rig, Caller& caller) {
  const Judged judged = caller.run([&] { return judge_by_rig(scene.tensor, rig, caller.progress()); });
  warn_of_other_scene(scene, judged);
  return py::make_tuple(errors_of(judged.errors.value), errors_of(judged.errors.half_width));
}

void bind_scene(py::module_& module) {
  // Scenes do not change, so Python and C++ may share one.
  py::class_<StoredScene, std::shared_ptr<StoredScene>>(module, "StoredScene")
      .def_property_readonly("camera_grid",
                             [](const StoredScene& s) { return to_python(s.tensor.camera_grid()); })
      .def_property_readonly("projector_grid",
                             [](const StoredScene& s) { return to_python(s.tensor.projector_grid()); })
      .def_property_readonly("channels", [](const StoredScene& s) { return s.tensor.channels(); })
      .def_property_readonly("symmetric", [](const StoredScene& s) { return s.tensor.symmetric(); })
      .def_property_readonly("views",
                             [](const StoredScene& s) {
                               const ViewLayout views = s.tensor.camera_tree().views();
                               return py::make_tuple(views.rows, views.cols);
                             })
      .def_property_readonly("bytes", [](const StoredScene& s) { return s.tensor.bytes(); })
      .def_property_readonly("dense_bytes", [](const StoredScene& s) { return s.tensor.dense_bytes(); })
      .def_property_readonly("levels", levels)
      .def_property_readonly("held_out", held_out)
      .def_property_readonly("capture_json", [](const StoredScene& s) { return s.capture_json; })
      .def_property_readonly("captured_from", [](const StoredScene& s) { return captured_scene(s); })
      .def("apply", apply)
      .def("seconds_of_apply", seconds_of_apply)
      .def("apply_batch", apply_batch)
      .def("dual", dual)
      .def("adjoint", adjoint)
      .def("relight", relight_views)
      .def("dense", dense)
      .def("held_out_errors", held_out_errors)
      .def("errors_by_truth", errors_by_truth)
      .def("report", report_page)
      .def("stopped_at", [](const StoredScene& s,
                            int level) { return std::const_pointer_cast<StoredScene>(stopped(s, level)); })
      .def_property_readonly("camera", camera_of)
      .def("save", save);
  py::class_<CameraTransport, std::shared_ptr<CameraTransport>>(module, "CameraTransport")
      .def_property_readonly("camera_grid",
                             [](const CameraTransport& c) { return to_python(c.camera_grid()); })
      .def_property_readonly("projector_grid",
                             [](const CameraTransport& c) { return to_python(c.projector_grid()); })
      .def_property_readonly("channels", [](const CameraTransport& c) { return c.channels(); })
      .def_property_readonly("mosaic", [](const CameraTransport& c) { return c.parts().mosaic; })
      .def_property_readonly("bytes", [](const CameraTransport& c) { return c.bytes(); })
      .def_property_readonly("chi_square",
                             [](const CameraTransport& c) -> py::object {
                               if (c.parts().chi_square.empty()) return py::none();
                               return array_of(c.chi_square());
                             })
      .def("apply", apply_camera)
      .def("apply_batch", apply_camera_batch)
      .def("adjoint", adjoint_camera)
      .def("relight", relight_camera)
      .def("errors_by_truth", camera_errors_by_truth);
  module.def("load", [](const std::string& path, std::int64_t memory) {
    return std::const_pointer_cast<StoredScene>(load(path, memory));
  });
}

}  // namespace symrig::python
