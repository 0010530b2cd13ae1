// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"

namespace symrig::acquisition {

/// The hierarchical acquisition of [Garg06 §5.2]; what separates `paper` from `symrig` is options.rule alone.
Result<CaptureResult> capture_hierarchy(Probe& probe, const CaptureSettings& options);

/// Hierarchical scan of [Sen05 §4] as [Garg06 §6.1] describes it: sparseness only, one side only.
Result<CaptureResult> capture_dual(Probe& probe, const CaptureSettings& options);

/// One pattern a pixel.
Result<CaptureResult> capture_brute(Probe& probe, const CaptureSettings& options);

}  // namespace symrig::acquisition
