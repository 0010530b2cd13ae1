// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/bench_summary.hpp"

#include <string>

namespace symrig::report {

/// "0.43", "≤ 0.31"; "-" where not reached or nothing was compared.
std::string ratio_text(const Reading& reading);
/// The same for a mean, and what it leaves out: "0.43 (2 of 27 not reached)".
std::string mean_text(const MeanRatio& mean);
/// The bias of symrig on one scene; nullptr if it was not run.
const FloodBias* flood_of_symrig(const BenchSummary& summary, const std::string& scene);

/// What the columns of the summary are, in the words of both table and page.
inline constexpr const char* kRatioNote =
    "The reference is paper at its default tolerance. Patterns of symrig at that error, and its error at "
    "that "
    "many patterns, are read off the lower envelope of its captures (straight between two in log-log), scene "
    "by scene and seed by seed; means are geometric. ≤: the end of the sweep is better than asked for. "
    "Not reached (-): no capture of the sweep gets there; nothing is extrapolated.";

}  // namespace symrig::report
