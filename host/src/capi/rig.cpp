// SPDX-License-Identifier: Apache-2.0
#include "capi/callback_probe.hpp"
#include "capi/guard.hpp"
#include "capi/handles.hpp"

#include <memory>
#include <string>

namespace {

using namespace symrig;
using namespace symrig::capi;

std::string text_or_empty(const char* text) {
  return text == nullptr ? std::string() : std::string(text);
}

/// The handle first: what waits for a device asks its member `stop`.
Result<std::unique_ptr<symrig_rig>> open_named(const char* name, const char* registration) {
  auto handle = std::make_unique<symrig_rig>();
  handle->name = name;
  handle->registration = text_or_empty(registration);
  SYMRIG_TRY(handle->opened, symrig::open_rig(handle->name, handle->registration,
                                              [rig = handle.get()] { return !rig->stop; }));
  return handle;
}

}  // namespace

int symrig_rig_open(const char* name, const char* registration, symrig_rig** rig, symrig_error* error) {
  return guarded(error, [&] {
    if (name == nullptr) return missing("name", error);
    if (rig == nullptr) return missing("rig", error);
    *rig = nullptr;
    auto opened = open_named(name, registration);
    if (!opened) return report(opened.error(), error);
    *rig = (*std::move(opened)).release();
    return 0;
  });
}

int symrig_rig_of_callback(const symrig_own_rig* own, symrig_rig** rig, symrig_error* error) {
  return guarded(error, [&] {
    if (own == nullptr) return missing("own", error);
    if (rig == nullptr) return missing("rig", error);
    *rig = nullptr;
    auto probe = CallbackProbe::make(*own);
    if (!probe) return report(probe.error(), error);
    auto handle = std::make_unique<symrig_rig>();
    handle->opened.probe = *std::move(probe);
    handle->opened.noise = "camera";
    *rig = handle.release();
    return 0;
  });
}

void symrig_rig_close(symrig_rig* rig) {
  guarded(nullptr, [&] {
    delete rig;
    return 0;
  });
}

symrig_shape symrig_rig_shape(const symrig_rig* rig) {
  symrig_shape shape{};
  guarded(nullptr, [&] {
    if (rig == nullptr) return 0;
    const Probe& probe = *rig->opened.probe;
    const Grid patterns = probe.grid(), photographs = probe.camera_grid();
    shape = {patterns.rows, patterns.cols, photographs.rows, photographs.cols, probe.channels()};
    return 0;
  });
  return shape;
}

void symrig_rig_stop(symrig_rig* rig) {
  if (rig != nullptr) rig->stop = true;
}
