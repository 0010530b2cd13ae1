// SPDX-License-Identifier: Apache-2.0
#include "bench_case.hpp"

#include "rig.hpp"
#include "symrig/base/time.hpp"

#include <memory>
#include <utility>

namespace symrig::apps {
namespace {

/// The true scene of an open rig. It keeps the rig alive.
std::shared_ptr<const Scene> scene_of(const std::shared_ptr<VirtualRig>& rig) {
  return {rig, &rig->truth()};
}

}  // namespace

Result<BenchedTensor> run_case(const BenchPlan& plan, const BenchCase& what, const Progress& progress) {
  const Stopwatch watch;
  SYMRIG_TRY(std::unique_ptr<VirtualRig> opened, open_simulated_rig(bench_rig(plan, what)));
  const std::shared_ptr<VirtualRig> rig = std::move(opened);
  SYMRIG_TRY(CaptureResult result,
             capture(*rig, {.algorithm = what.algorithm, .tolerance = what.tolerance, .progress = progress}));
  const double wall_seconds = watch.seconds();
  const ProbeCost cost = rig->cost();
  SYMRIG_TRY(const TransportErrors error, evaluate(result.tensor, told(truth_of(scene_of(rig)), progress)));
  BenchCapture capture{.what = what,
                       .patterns = result.patterns,
                       .frames = cost.frames,
                       .tensor_bytes = result.tensor.bytes(),
                       .rig_seconds = cost.rig_seconds,
                       .rig_time = rig->rig().time(),
                       .process_seconds = result.process_seconds,
                       .merge_seconds = cost.merge_seconds,
                       .simulate_seconds = cost.simulate_seconds,
                       .wall_seconds = wall_seconds,
                       .error = error,
                       .failure = {}};
  return BenchedTensor{std::move(capture), std::move(result.tensor)};
}

}  // namespace symrig::apps
