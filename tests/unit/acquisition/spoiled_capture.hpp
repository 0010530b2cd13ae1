// SPDX-License-Identifier: Apache-2.0
// Captures whose photographs are spoiled before the search sees them.
#pragma once

#include "dense_scene.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <functional>
#include <string>

#include <gtest/gtest.h>

namespace symrig::tests {

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
