// SPDX-License-Identifier: Apache-2.0
#include "capi/guard.hpp"
#include "capi/handles.hpp"
#include "symrig/tensor/adjoint.hpp"

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
using symrig::TransportTensor;
using namespace symrig::capi;

/// Floats in memory of the caller: `pictures` of them, each of this size.
struct Given {
  const char* name;
  const float* values;
  std::size_t count;
};

struct Size {
  Grid grid;
  int channels;
  std::size_t values() const {
    return static_cast<std::size_t>(grid.size()) * static_cast<std::size_t>(channels);
  }
};

Result<void> check_pictures(const Given& given, std::size_t pictures, const Size& size) {
  const bool fits = pictures == 0 ? given.count == 0
                                  : given.count % pictures == 0 && given.count / pictures == size.values();
  if (fits) return {};
  const std::string times = pictures == 1 ? "" : std::to_string(pictures) + " x ";
  return Error{ErrorCode::size_mismatch,
               std::string(given.name) + " has " + std::to_string(given.count) + " values, not " + times +
                   std::to_string(size.values()),
               "use the sizes of symrig_tensor_shape()"};
}

Result<void> check_light(const Given& given) {
  if (std::all_of(given.values, given.values + given.count, [](float value) { return std::isfinite(value); }))
    return {};
  return Error{ErrorCode::bad_value, std::string(given.name) + " contains a NaN or an infinity",
               "give light from 0 to 1"};
}

Image<float> picture_at(const Given& given, std::size_t k, const Size& size) {
  Image<float> picture(size.grid, size.channels);
  std::copy_n(given.values + k * size.values(), size.values(), picture.values().begin());
  return picture;
}

Size pattern_size(const TransportTensor& tensor) {
  return {tensor.projector_grid(), 1};
}

Size photograph_size(const TransportTensor& tensor) {
  return {tensor.camera_grid(), tensor.channels()};
}

/// Pictures of one kind to pictures of another: checks both counts, then maps batch after batch.
template <class Map>
Result<void> map_pictures(const Given& from, const Size& from_size, const Given& to, float* out,
                          const Size& to_size, std::size_t pictures, Map map) {
  SYMRIG_CHECK(check_pictures(from, pictures, from_size));
  SYMRIG_CHECK(check_pictures(to, pictures, to_size));
  SYMRIG_CHECK(check_light(from));
  constexpr std::size_t kTogether = 16;  // T is read once for so many
  for (std::size_t first = 0; first < pictures; first += kTogether) {
    std::vector<Image<float>> batch;
    for (std::size_t k = first; k < std::min(first + kTogether, pictures); ++k)
      batch.push_back(picture_at(from, k, from_size));
    SYMRIG_TRY(const std::vector<Image<float>> mapped, map(batch));
    for (const Image<float>& one : mapped) out = std::copy(one.values().begin(), one.values().end(), out);
  }
  return {};
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

int code_of(const Result<void>& done, symrig_error* error) {
  return done ? 0 : report(done.error(), error);
}

}  // namespace

int symrig_tensor_load(const char* path, symrig_tensor** tensor, symrig_error* error) {
  return guarded(error, [&] {
    if (path == nullptr) return missing("path", error);
    if (tensor == nullptr) return missing("tensor", error);
    *tensor = nullptr;
    auto scene = symrig::load_scene(path);
    if (!scene) return report(scene.error(), error);
    *tensor = new symrig_tensor{*std::move(scene)};
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
  return guarded(error, [&] {
    if (tensor == nullptr) return missing("tensor", error);
    if (pattern == nullptr) return missing("pattern", error);
    if (photograph == nullptr) return missing("photograph", error);
    const TransportTensor& held = tensor->scene.tensor;
    const Given from{"pattern", pattern, pattern_count}, to{"photograph", photograph, photograph_count};
    return code_of(map_pictures(from, pattern_size(held), to, photograph, photograph_size(held), 1,
                                one_by_one([&held](const Image<float>& light) { return held.apply(light); })),
                   error);
  });
}

int symrig_tensor_relight_many(const symrig_tensor* tensor, size_t patterns, const float* pattern,
                               size_t pattern_count, float* photograph, size_t photograph_count,
                               symrig_error* error) {
  return guarded(error, [&] {
    if (tensor == nullptr) return missing("tensor", error);
    if (pattern == nullptr) return missing("pattern", error);
    if (photograph == nullptr) return missing("photograph", error);
    const TransportTensor& held = tensor->scene.tensor;
    const Given from{"pattern", pattern, pattern_count}, to{"photograph", photograph, photograph_count};
    return code_of(map_pictures(from, pattern_size(held), to, photograph, photograph_size(held), patterns,
                                [&held](const Batch& lights) { return held.apply_batch(lights); }),
                   error);
  });
}

int symrig_tensor_adjoint(const symrig_tensor* tensor, size_t pictures, const float* picture,
                          size_t picture_count, float* light, size_t light_count, symrig_error* error) {
  return guarded(error, [&] {
    if (tensor == nullptr) return missing("tensor", error);
    if (picture == nullptr) return missing("picture", error);
    if (light == nullptr) return missing("light", error);
    const TransportTensor& held = tensor->scene.tensor;
    const Given from{"picture", picture, picture_count}, to{"light", light, light_count};
    return code_of(
        map_pictures(from, photograph_size(held), to, light, pattern_size(held), pictures,
                     one_by_one([&held](const Image<float>& one) { return apply_adjoint(held, one); })),
        error);
  });
}

int symrig_tensor_dual(const symrig_tensor* tensor, const float* light, size_t light_count, float* picture,
                       size_t picture_count, symrig_error* error) {
  return guarded(error, [&] {
    if (tensor == nullptr) return missing("tensor", error);
    if (light == nullptr) return missing("light", error);
    if (picture == nullptr) return missing("picture", error);
    const TransportTensor& held = tensor->scene.tensor;
    const Given from{"light", light, light_count}, to{"picture", picture, picture_count};
    const Size camera{held.camera_grid(), 1}, projector{held.projector_grid(), held.channels()};
    return code_of(
        map_pictures(from, camera, to, picture, projector, 1,
                     one_by_one([&held](const Image<float>& one) { return held.apply_transposed(one); })),
        error);
  });
}
