// SPDX-License-Identifier: Apache-2.0
#include "capi/guard.hpp"
#include "capi/handles.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>

namespace {

using symrig::Error;
using symrig::ErrorCode;
using symrig::Image;
using symrig::TransportTensor;
using namespace symrig::capi;

Error wrong_count(const char* what, std::size_t given, std::size_t needed) {
  return {ErrorCode::size_mismatch,
          std::string(what) + " has " + std::to_string(given) + " values, not " + std::to_string(needed),
          "use the sizes of symrig_tensor_shape()"};
}

std::size_t photograph_size(const TransportTensor& tensor) {
  return static_cast<std::size_t>(tensor.camera_grid().size()) * static_cast<std::size_t>(tensor.channels());
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
    const std::size_t needed = held.projector_grid().size();
    if (pattern_count != needed) return report(wrong_count("pattern", pattern_count, needed), error);
    if (photograph_count != photograph_size(held))
      return report(wrong_count("photograph", photograph_count, photograph_size(held)), error);
    if (!std::all_of(pattern, pattern + pattern_count, [](float value) { return std::isfinite(value); }))
      return report({ErrorCode::bad_value, "pattern contains a NaN or an infinity", "give light from 0 to 1"},
                    error);
    Image<float> light(held.projector_grid());
    std::copy_n(pattern, pattern_count, light.values().begin());
    const auto relit = held.apply(light);
    if (!relit) return report(relit.error(), error);
    std::copy(relit->values().begin(), relit->values().end(), photograph);
    return 0;
  });
}
