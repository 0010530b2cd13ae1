// SPDX-License-Identifier: Apache-2.0

#include "capi/guard.hpp"
#include "capi/handles.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/job/evaluation.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace {

using symrig::apply_adjoint;
using symrig::Error;
using symrig::ErrorCode;
using symrig::Grid;
using symrig::Image;
using symrig::Result;
using symrig::TransportOperator;
using symrig::TransportTensor;
using namespace symrig::capi;

/// Floats in memory of the caller. T: const where they are read.
template <class T>
struct Given {
  const char* name;
  T* values;
  std::size_t count;
};

struct Size {
  Grid grid;
  int channels;
  std::size_t values() const {
    return static_cast<std::size_t>(grid.size()) * static_cast<std::size_t>(channels);
  }
};

template <class T>
Result<void> check_pictures(const Given<T>& given, std::size_t pictures, const Size& size) {
  const bool fits = pictures == 0 ? given.count == 0
                                  : given.count % pictures == 0 && given.count / pictures == size.values();
  if (fits) return {};
  const std::string times = pictures == 1 ? "" : std::to_string(pictures) + " x ";
  return Error{ErrorCode::size_mismatch,
               std::string(given.name) + " has " + std::to_string(given.count) + " values, not " + times +
                   std::to_string(size.values()),
               "use the sizes of symrig_tensor_shape(), or of symrig_camera_shape()"};
}

Result<void> check_light(const Given<const float>& given) {
  if (std::all_of(given.values, given.values + given.count, [](float value) { return std::isfinite(value); }))
    return {};
  return Error{ErrorCode::bad_value, std::string(given.name) + " contains a NaN or an infinity",
               "give light from 0 to 1"};
}

Image<float> picture_at(const Given<const float>& given, std::size_t k, const Size& size) {
  Image<float> picture(size.grid, size.channels);
  std::copy_n(given.values + k * size.values(), size.values(), picture.values().begin());
  return picture;
}

Size pattern_size(const TransportOperator& tensor) {
  return {tensor.projector_grid(), 1};
}

Size photograph_size(const TransportOperator& tensor) {
  return {tensor.camera_grid(), tensor.channels()};
}

using Batch = std::vector<Image<float>>;

/// A map of one picture as a map of many.
template <class One>
auto one_by_one(One one) {
  return [one](const Batch& batch) -> Result<Batch> {
    Batch mapped;
    for (const Image<float>& picture : batch) {
      SYMRIG_TRY(Image<float> next, one(picture));
      mapped.push_back(std::move(next));
    }
    return mapped;
  };
}

/// Pictures of one kind and pictures of another, each of this size.
struct Pictures {
  std::size_t count;
  Size from_size, to_size;
};

/// Checks both counts, then maps batch after batch.
template <class Map>
Result<void> map_pictures(const Given<const float>& from, const Given<float>& to, const Pictures& pictures,
                          Map map) {
  SYMRIG_CHECK(check_pictures(from, pictures.count, pictures.from_size));
  SYMRIG_CHECK(check_pictures(to, pictures.count, pictures.to_size));
  SYMRIG_CHECK(check_light(from));
  constexpr std::size_t kTogether = 16;  // T is read once for so many
  float* out = to.values;
  for (std::size_t first = 0; first < pictures.count; first += kTogether) {
    Batch batch;
    for (std::size_t k = first; k < std::min(first + kTogether, pictures.count); ++k)
      batch.push_back(picture_at(from, k, pictures.from_size));
    SYMRIG_TRY(const Batch mapped, map(batch));
    for (const Image<float>& one : mapped) out = std::copy(one.values().begin(), one.values().end(), out);
  }
  return {};
}

/// What the calls have in common. make: the sizes and the map, of the tensor; or an error.
template <class Make>
int mapped(const symrig_tensor* tensor, const Given<const float>& from, const Given<float>& to,
           symrig_error* error, Make make) {
  return guarded(error, [&] {
    if (tensor == nullptr) return missing("tensor", error);
    if (from.values == nullptr) return missing(from.name, error);
    if (to.values == nullptr) return missing(to.name, error);
    const auto [pictures, map] = make(tensor->scene.tensor);
    const Result<void> done = map_pictures(from, to, pictures, map);
    return done ? 0 : report(done.error(), error);
  });
}

/// The same on the camera's own pixels. make: of the whole handle.
template <class Make>
int mapped_by_camera(const symrig_tensor* tensor, const Given<const float>& from, const Given<float>& to,
                     symrig_error* error, Make make) {
  if (tensor != nullptr && !tensor->camera)
    return report({ErrorCode::bad_argument, "the scene has no pixels of the camera's own",
                   "use symrig_tensor_relight(), or capture with a registered camera that has more pixels "
                   "than the projector has cells"},
                  error);
  return mapped(tensor, from, to, error, [&](const TransportTensor&) { return make(*tensor); });
}

}  // namespace

int symrig_tensor_load(const char* path, symrig_tensor** tensor, symrig_error* error) {
  return guarded(error, [&] {
    if (path == nullptr) return missing("path", error);
    if (tensor == nullptr) return missing("tensor", error);
    *tensor = nullptr;
    auto scene = symrig::load_scene(path);
    if (!scene) return report(scene.error(), error);
    const auto made = symrig_tensor::make(*std::move(scene));
    if (!made) return report(made.error(), error);
    *tensor = *made;
    return 0;
  });
}

void symrig_tensor_free(symrig_tensor* tensor) {
  delete tensor;
}

symrig_shape symrig_tensor_shape(const symrig_tensor* tensor) {
  if (tensor == nullptr) return {};
  const TransportTensor& held = tensor->scene.tensor;
  return {held.projector_grid().rows, held.projector_grid().cols, held.camera_grid().rows,
          held.camera_grid().cols, held.channels()};
}

int symrig_tensor_relight(const symrig_tensor* tensor, const float* pattern, size_t pattern_count,
                          float* photograph, size_t photograph_count, symrig_error* error) {
  return mapped(tensor, {"pattern", pattern, pattern_count}, {"photograph", photograph, photograph_count},
                error, [](const TransportTensor& held) {
                  return std::pair(
                      Pictures{1, pattern_size(held), photograph_size(held)},
                      one_by_one([&held](const Image<float>& light) { return held.apply(light); }));
                });
}

int symrig_tensor_relight_many(const symrig_tensor* tensor, size_t patterns, const float* pattern,
                               size_t pattern_count, float* photograph, size_t photograph_count,
                               symrig_error* error) {
  return mapped(tensor, {"pattern", pattern, pattern_count}, {"photograph", photograph, photograph_count},
                error, [patterns](const TransportTensor& held) {
                  return std::pair(Pictures{patterns, pattern_size(held), photograph_size(held)},
                                   [&held](const Batch& lights) { return held.apply_batch(lights); });
                });
}

int symrig_tensor_adjoint(const symrig_tensor* tensor, size_t pictures, const float* picture,
                          size_t picture_count, float* light, size_t light_count, symrig_error* error) {
  return mapped(tensor, {"picture", picture, picture_count}, {"light", light, light_count}, error,
                [pictures](const TransportTensor& held) {
                  return std::pair(
                      Pictures{pictures, photograph_size(held), pattern_size(held)},
                      one_by_one([&held](const Image<float>& one) { return apply_adjoint(held, one); }));
                });
}

int symrig_tensor_dual(const symrig_tensor* tensor, const float* light, size_t light_count, float* picture,
                       size_t picture_count, symrig_error* error) {
  return mapped(tensor, {"light", light, light_count}, {"picture", picture, picture_count}, error,
                [](const TransportTensor& held) {
                  const Size camera{held.camera_grid(), 1}, projector{held.projector_grid(), held.channels()};
                  return std::pair(
                      Pictures{1, camera, projector},
                      one_by_one([&held](const Image<float>& one) { return held.apply_transposed(one); }));
                });
}

Result<symrig_tensor*> symrig_tensor::make(symrig::StoredScene scene) {
  auto tensor = std::make_unique<symrig_tensor>(symrig_tensor{std::move(scene)});
  if (tensor->scene.camera != nullptr) {
    SYMRIG_TRY(tensor->camera, symrig::Relighter::begin(tensor->scene.camera));
  }
  return tensor.release();
}

symrig_shape symrig_camera_shape(const symrig_tensor* tensor) {
  if (tensor == nullptr || !tensor->camera) return {};
  const symrig::CameraTransport& held = *tensor->scene.camera;
  return {held.projector_grid().rows, held.projector_grid().cols, held.camera_grid().rows,
          held.camera_grid().cols, held.channels()};
}

int symrig_camera_relight(const symrig_tensor* tensor, size_t patterns, const float* pattern,
                          size_t pattern_count, float* photograph, size_t photograph_count,
                          symrig_error* error) {
  return mapped_by_camera(
      tensor, {"pattern", pattern, pattern_count}, {"photograph", photograph, photograph_count}, error,
      [patterns](const symrig_tensor& held) {
        const symrig::CameraTransport& camera = *held.scene.camera;
        return std::pair(Pictures{patterns, pattern_size(camera), photograph_size(camera)},
                         [&held](const Batch& lights) { return held.camera->relight_batch(lights); });
      });
}

int symrig_camera_adjoint(const symrig_tensor* tensor, size_t pictures, const float* picture,
                          size_t picture_count, float* light, size_t light_count, symrig_error* error) {
  return mapped_by_camera(
      tensor, {"picture", picture, picture_count}, {"light", light, light_count}, error,
      [pictures](const symrig_tensor& held) {
        const symrig::CameraTransport& camera = *held.scene.camera;
        return std::pair(Pictures{pictures, photograph_size(camera), pattern_size(camera)},
                         one_by_one([&camera](const Image<float>& one) { return camera.adjoint(one); }));
      });
}

namespace {

using namespace symrig;
using namespace symrig::capi;

Result<std::string> errors_text(const StoredScene& scene) {
  SYMRIG_TRY(const auto held_out, judge_by_photographs(scene));
  return stored_errors_json(scene, held_out);
}

Result<void> save_checked(const StoredScene& scene, const char* path) {
  SYMRIG_CHECK(JobFiles().writes("path", path, FileFormat::scene).check());
  return save_scene(path, scene);
}

}  // namespace

int symrig_tensor_inspect(const symrig_tensor* tensor, char** json, symrig_error* error) {
  return guarded(error, [&] {
    if (tensor == nullptr) return missing("tensor", error);
    if (json == nullptr) return missing("json", error);
    *json = nullptr;
    return give_text(inspection_json(tensor->scene), json, error);
  });
}

int symrig_tensor_errors(const symrig_tensor* tensor, char** json, symrig_error* error) {
  return guarded(error, [&] {
    if (tensor == nullptr) return missing("tensor", error);
    if (json == nullptr) return missing("json", error);
    *json = nullptr;
    const auto text = errors_text(tensor->scene);
    return text ? give_text(*text, json, error) : report(text.error(), error);
  });
}

int symrig_tensor_save(const symrig_tensor* tensor, const char* path, symrig_error* error) {
  return guarded(error, [&] {
    if (tensor == nullptr) return missing("tensor", error);
    if (path == nullptr) return missing("path", error);
    const auto saved = save_checked(tensor->scene, path);
    return saved ? 0 : report(saved.error(), error);
  });
}
