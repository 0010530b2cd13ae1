// SPDX-License-Identifier: Apache-2.0
// What the table of algorithms runs.
#pragma once

#include "symrig/acquisition/capture.hpp"

namespace symrig::acquisition {

/// The hierarchical acquisition of [Garg06 §5.2]. `paper` and `symrig` differ in the table's entry alone.
Result<CaptureResult> capture_hierarchy(Probe& probe, const CaptureSettings& options);

/// Hierarchical scan of [Sen05 §4] as [Garg06 §6.1] describes it: sparseness only, one side only.
Result<CaptureResult> capture_dual(Probe& probe, const CaptureSettings& options);

/// One pattern a pixel.
Result<CaptureResult> capture_brute(Probe& probe, const CaptureSettings& options);

}  // namespace symrig::acquisition
