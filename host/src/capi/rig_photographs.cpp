// SPDX-License-Identifier: Apache-2.0
// What a rig photographs without a capture: given patterns, and the errors of a tensor.

#include "capi/guard.hpp"
#include "capi/handles.hpp"
#include "symrig/job/evaluation.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/report/summary.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace symrig::capi {

namespace {

/// The callback may be C++. What it throws stops the call.
bool goes_on(symrig_on_capture told, void* user, const ProgressEvent& event) {
  const std::string stage(event.stage);
  const symrig_capture_progress at{stage.c_str(), event.done, event.expected};
  try {
    return told(&at, user) == 0;
  } catch (...) {
    return false;
  }
}

}  // namespace

Result<void> RigTurn::check() const {
  if (taken_) return {};
  return Error{ErrorCode::bad_argument, "another call uses the rig", "wait until it is done"};
}

Progress RigTurn::progress(symrig_on_capture on_progress, void* user) const {
  return [&rig = rig_, on_progress, user](const ProgressEvent& event) {
    return !rig.stop && (on_progress == nullptr || goes_on(on_progress, user, event));
  };
}

}  // namespace symrig::capi

namespace {

using namespace symrig;
using namespace symrig::capi;

/// Where photographs go; variance and valid may be null.
struct Photographs {
  float* mean;
  float* variance;
  std::uint8_t* valid;
};

/// What a caller has room for.
struct Room {
  const char* name;
  std::size_t values;
};

/// Room for `count` pictures of `each` values.
/// fails: size_mismatch.
Result<void> check_room(const Room& room, std::size_t count, std::size_t each) {
  if (count == 0 ? room.values == 0 : room.values % count == 0 && room.values / count == each) return {};
  return Error{ErrorCode::size_mismatch,
               std::string(room.name) + " has " + std::to_string(room.values) + " values, not " +
                   std::to_string(count) + " x " + std::to_string(each),
               "use the sizes of symrig_rig_shape()"};
}

/// As many patterns at a time as the rig likes, so that symrig_rig_stop() soon ends it.
Result<void> photograph(const symrig_rig& rig, const float* pattern, std::size_t count, Photographs out) {
  Probe& probe = *rig.opened.probe;
  const auto pixels = static_cast<std::size_t>(probe.grid().size());
  for (std::size_t first = 0; first < count;) {
    if (rig.stop) return Error{ErrorCode::interrupted, "stopped", "call symrig_rig_measure() again"};
    std::vector<Pattern> patterns;
    for (; patterns.size() < probe.together() && first + patterns.size() < count;) {
      Pattern& one = patterns.emplace_back(probe.grid());
      std::copy_n(pattern + (first + patterns.size() - 1) * pixels, pixels, one.values().begin());
    }
    SYMRIG_TRY(const std::vector<Radiance> seen, probe.measure(patterns));
    for (const Radiance& one : seen) {
      out.mean = std::copy(one.mean.values().begin(), one.mean.values().end(), out.mean);
      if (out.variance != nullptr)
        out.variance = std::copy(one.variance.values().begin(), one.variance.values().end(), out.variance);
      if (out.valid != nullptr)
        out.valid = std::copy(one.valid.values().begin(), one.valid.values().end(), out.valid);
    }
    first += patterns.size();
  }
  return {};
}

Result<std::string> errors_text(const symrig_rig& rig, const TransportTensor& tensor,
                                const Progress& progress) {
  const bool knows_truth = is_simulated(rig.name);
  SYMRIG_TRY(const Judged judged, knows_truth ? judge_by_truth(tensor, rig.name, progress)
                                              : judge_by_rig(tensor, *rig.opened.probe, progress));
  return rig_errors_json(judged.rig, judged.errors.value, judged.errors.half_width,
                         judged.ideal ? &judged.ideal->value : nullptr);
}

}  // namespace

int symrig_rig_measure(symrig_rig* rig, size_t patterns, const float* pattern, size_t pattern_count,
                       float* mean, float* variance, uint8_t* valid, size_t photograph_count,
                       symrig_error* error) {
  return guarded(error, [&] {
    if (rig == nullptr) return missing("rig", error);
    if (pattern == nullptr) return missing("pattern", error);
    if (mean == nullptr) return missing("mean", error);
    const RigTurn turn(*rig);
    if (const auto free = turn.check(); !free) return report(free.error(), error);
    const Probe& probe = *rig->opened.probe;
    const auto channels = static_cast<std::size_t>(probe.channels());
    auto done =
        check_room({"pattern", pattern_count}, patterns, static_cast<std::size_t>(probe.grid().size()));
    if (done)
      done = check_room({"photograph", photograph_count}, patterns,
                        static_cast<std::size_t>(probe.camera_grid().size()) * channels);
    if (done) done = photograph(*rig, pattern, patterns, {mean, variance, valid});
    return done ? 0 : report(done.error(), error);
  });
}

int symrig_rig_errors(symrig_rig* rig, const symrig_tensor* tensor, symrig_on_capture on_progress, void* user,
                      char** json, symrig_error* error) {
  return guarded(error, [&] {
    if (rig == nullptr) return missing("rig", error);
    if (tensor == nullptr) return missing("tensor", error);
    if (json == nullptr) return missing("json", error);
    *json = nullptr;
    const RigTurn turn(*rig);
    if (const auto free = turn.check(); !free) return report(free.error(), error);
    const auto text = errors_text(*rig, tensor->scene.tensor, turn.progress(on_progress, user));
    return text ? give_text(*text, json, error) : report(text.error(), error);
  });
}
