// SPDX-License-Identifier: Apache-2.0
// A capture of a simulated rig, and its errors against the truth.
#pragma once

#include "dense_scene.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace symrig::tests {

struct Judged {
  CaptureResult result;
  TransportErrors truth;
};

/// unchecked: also of a rig that the first photographs show to be misaligned.
inline Judged judge(const std::string& uri, std::int64_t most = 0, bool unchecked = false) {
  const auto rig = open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << uri;
  CaptureOptions options = default_options();
  options.max_patterns = most;
  options.unchecked = unchecked;
  auto result = capture(**rig, options);
  EXPECT_TRUE(result.ok()) << uri;
  const Scene& scene = (*rig)->truth();
  const auto truth =
      evaluate(result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return scene.apply(p); });
  return {*std::move(result), *truth};
}

// Captures whose photographs are spoiled before the search sees them.

constexpr Grid kSpoiledGrid{24, 32};
constexpr double kSpoiledSigma = 2e-3;

inline NoiseCheck check_of(const std::function<void(Radiance&, int photograph)>& spoil,
                           double sigma = kSpoiledSigma) {
  const DenseTransport scene = facing_planes(kSpoiledGrid);
  DenseProbe probe(scene, sigma);
  int taken = 0;
  probe.spoil = [&](Radiance& answer) { spoil(answer, taken++); };
  const auto result = capture(probe, default_options());
  EXPECT_TRUE(result.ok());
  return result->noise_check;
}

inline bool tells(const NoiseCheck& check, const std::string& word) {
  return std::ranges::any_of(
      check.findings, [&](const std::string& finding) { return finding.find(word) != std::string::npos; });
}

}  // namespace symrig::tests
