// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/bench.hpp"
#include "symrig/report/bench_summary.hpp"

#include <string>

namespace symrig::report {

/// The cost of a capture.
struct CostAxis {
  const char* label;
  double (*of)(const BenchCapture& capture);
};
inline constexpr CostAxis kPatternAxis{"patterns",
                                       [](const BenchCapture& c) { return static_cast<double>(c.patterns); }};
inline constexpr CostAxis kRigAxis{"rig seconds", [](const BenchCapture& c) { return c.rig_seconds; }};
inline constexpr CostAxis kSecondAxis{"seconds", [](const BenchCapture& c) { return c.capture_seconds(); }};

struct ErrorAxis {
  const char* label;
  double TransportErrors::*of;
};

/// One chart for each scene of a size and profile, side by side. Each capture is a marker; each algorithm has
/// a line (geometric mean over the seeds).
std::string bench_charts(const BenchRun& run, const BenchSummary& of, const CostAxis& cost,
                         const ErrorAxis& error);

/// The legend: the marker of each algorithm of the plan.
std::string bench_legend(const BenchPlan& plan);

}  // namespace symrig::report
