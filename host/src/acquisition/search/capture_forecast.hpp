// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/scene_facts.hpp"
#include "symrig/acquisition/capture.hpp"

#include <cstdint>

namespace symrig::acquisition {

/// What a search has spent when it begins.
struct SpentBefore {
  std::int64_t photographs = 0;
  double rig_seconds = 0;
  double seconds_each = 0;  ///< of a check photograph
};

/// What a whole capture will take, by the light between pixels that the check photographs show. checks: none
/// of their light is known yet. Scenes with more such light have more leaves:
///   photographs = 3.7 N^(1/4) (I / τ)^(1/3)
/// N: pixels; I: RMS over the pixels of the light from all other pixels, as a share of F; τ: tolerance.
/// Found on 28 scenes (`random` 1 to 20 and eight named ones), 32x32 to 128x128, τ from 1.5e-4 to 3e-3
/// (docs/research/error-per-second.md has how often it is right). The search's photographs take as long as
/// the checks: they too have some pixels lit.
CaptureForecast forecast_capture(const SceneFacts& facts, Checks& checks, const KnownTransport& nothing,
                                 const SpentBefore& spent);

}  // namespace symrig::acquisition
