// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/bench.hpp"

#include <string>

namespace symrig::report {

/// "0.43", "≤ 0.31"; "-" if not reached or if nothing was compared.
std::string ratio_text(const CurveReading& reading);
/// The same for a mean, with the number of ratios that it omits: "0.43 (2 of 27 not reached)".
std::string mean_text(const MeanRatio& mean);
/// The bias of symrig on one scene; nullptr if it was not run.
const FloodBias* flood_of_symrig(const BenchSummary& summary, const std::string& scene);

/// An explanation of the columns of the summary, for table and page.
inline constexpr const char* kRatioNote =
    "The reference is paper at its default tolerance. symrig's patterns at that error, and its "
    "error at that many patterns, are read from the lower envelope of its captures (linear "
    "interpolation in log-log), for each scene and seed. Means are geometric. ≤: the end of the "
    "sweep is already better. Not reached (-): no capture of the sweep reaches it; nothing is "
    "extrapolated.";

}  // namespace symrig::report
