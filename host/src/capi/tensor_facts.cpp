// SPDX-License-Identifier: Apache-2.0
#include "capi/guard.hpp"
#include "capi/handles.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/job/evaluation.hpp"
#include "symrig/report/summary.hpp"

#include <string>

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
