// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/evaluation.hpp"

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <memory>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

/// The tensor must be of the rig's grid and channels.
Result<void> check_same(const TransportOperator& tensor, Grid rig, int channels) {
  if (rig == tensor.camera_grid() && rig == tensor.projector_grid() && channels == tensor.channels())
    return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("the rig is {} with {} channels, the scene file {} with {}", to_string(rig),
                           channels, to_string(tensor.camera_grid()), tensor.channels()),
               "give the rig that the scene was captured from"};
}

}  // namespace

Result<Judged> judge_by_truth(const TransportOperator& tensor, const std::string& rig,
                              const Progress& progress) {
  SYMRIG_TRY(const std::shared_ptr<const Scene> truth, open_truth(rig));
  SYMRIG_CHECK(check_same(tensor, truth->grid(), truth->channels()));
  SYMRIG_TRY(ErrorEstimate ideal, measure_errors(tensor, told(truth_of(truth), progress)));
  SYMRIG_TRY(const SceneUri uri, parse_scene_uri(rig));
  SYMRIG_TRY(const auto bench, bench_truth(uri));
  if (!bench) return Judged{std::move(ideal), rig};
  SYMRIG_TRY(ErrorEstimate errors, measure_errors(tensor, told(*bench, progress)));
  return Judged{std::move(errors), rig, std::move(ideal)};
}

TrueTransport true_transport_of(const StoredScene& scene) {
  const std::string rig = captured_scene(scene);
  if (!is_simulated(rig)) return {};
  auto truth = open_truth(rig);
  if (!truth || !check_same(scene.tensor, (*truth)->grid(), (*truth)->channels())) return {};
  return truth_of(*std::move(truth));
}

Result<Judged> judge_by_rig(const TransportOperator& tensor, Probe& rig, const Progress& progress) {
  SYMRIG_CHECK(check_aligned(rig));
  SYMRIG_CHECK(check_same(tensor, rig.grid(), rig.channels()));
  SYMRIG_TRY(ErrorEstimate errors, measure_errors(tensor, rig, {}, progress));
  return Judged{std::move(errors), rig.describe()};
}

Result<std::vector<HeldOutError>> judge_by_photographs(const TransportOperator& tensor,
                                                       std::span<const HeldOut> held_out) {
  std::vector<HeldOutError> errors;
  errors.reserve(held_out.size());
  for (const HeldOut& one : held_out) {
    SYMRIG_TRY(HeldOutError error, held_out_error(tensor, one));
    errors.push_back(std::move(error));
  }
  return errors;
}

Result<std::vector<HeldOutError>> judge_by_photographs(const StoredScene& scene) {
  return judge_by_photographs(scene.tensor, scene.held_out);
}

}  // namespace symrig
