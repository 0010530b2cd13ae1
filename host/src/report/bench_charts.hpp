// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/bench.hpp"

#include <string>

namespace symrig::report {

/// What a capture costs.
struct CostAxis {
  const char* label;
  double (*of)(const BenchCapture& capture);
};
inline constexpr CostAxis kPatternAxis{"patterns",
                                       [](const BenchCapture& c) { return static_cast<double>(c.patterns); }};
inline constexpr CostAxis kSecondAxis{"seconds", [](const BenchCapture& c) { return c.capture_seconds(); }};

struct ErrorAxis {
  const char* label;
  double TransportErrors::*of;
};

/// One chart a scene, side by side: every capture a marker, one line an algorithm (geometric mean over the
/// seeds).
std::string bench_charts(const BenchRun& run, Grid size, const CostAxis& cost, const ErrorAxis& error);

/// Which marker is which algorithm, for those of the plan.
std::string bench_legend(const BenchPlan& plan);

}  // namespace symrig::report
