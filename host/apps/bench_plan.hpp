// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/report/bench.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// The options of `symrig bench` that choose the captures. Empty values mean the defaults, which --quick
/// makes smaller.
struct BenchChoice {
  std::vector<std::string> scenes, sizes, algorithms, tolerances, profiles;
  std::optional<int> seeds;
  std::string noise = "camera";
  int channels = 1;
  bool quick = false;
};

void add_bench_choice(CLI::App& command, BenchChoice& choice);

/// fails: unknown_name, bad_argument.
Result<BenchPlan> bench_plan(const BenchChoice& choice);

struct BenchedTensor {
  BenchCapture capture;
  TransportTensor tensor;
};

/// Opens a fresh rig for the case, captures, and compares the result with the exact transport. The same case
/// gives the same patterns and errors every time.
/// fails: as open_rig, capture and evaluate; interrupted.
Result<BenchedTensor> run_case(const BenchPlan& plan, const BenchCase& what, const Progress& progress);

}  // namespace symrig::apps
