// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/report/bench.hpp"
#include "symrig/tensor/transport_tensor.hpp"

namespace symrig::apps {

struct BenchedTensor {
  BenchCapture capture;
  TransportTensor tensor;
};

/// Opens a fresh rig for the case, captures, and compares the result with the exact transport. The same case
/// gives the same patterns and errors every time.
/// fails: as open_rig, capture and evaluate; interrupted.
Result<BenchedTensor> run_case(const BenchPlan& plan, const BenchCase& what, const Progress& progress);

}  // namespace symrig::apps
