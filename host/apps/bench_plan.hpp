// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/report/bench.hpp"

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

}  // namespace symrig::apps
