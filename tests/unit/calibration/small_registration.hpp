// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/registration.hpp"

#include <gtest/gtest.h>

namespace symrig::tests {

/// A registration that no rig measured: two channels with a map each, and a pixel that is not valid.
inline Registration small_registration() {
  Registration r;
  r.cells = {5, 6};
  r.rig = "a bench";
  r.photographs = 16;
  const Grid camera{15, 18};
  r.flood = {Image<float>(camera, 2, 0.75F), Image<float>(camera, 2, 1e-4F),
             Image<std::uint8_t>(camera, 2, std::uint8_t{1})};
  r.flood.mean.at(3, 4, 1) = 0;
  r.flood.variance.at(3, 4, 1) = 0;
  r.flood.valid.at(3, 4, 1) = 0;
  r.shares = Image<float>(camera, 4, 0.5F);
  r.shares.at(1, 2, 3) = kUnknownShare;
  r.stripes = Image<float>(camera, 4, 0.25F);
  r.gain = {.shape = {0.1, -0.2, 0.3, -0.05},
            .sigma = 0.001,
            .veil = 1e-4,
            .veil_sigma = 1e-5,
            .pairs = 70,
            .known = true};
  r.blur = {.projector = 0.3, .camera = 0.2, .sigma = 0.01, .measured = true};
  for (const double shift : {0.0, 0.25}) {
    // 4 intervals along 18 columns, so 4 along 15 rows, and 7 × 7 coefficients.
    CameraMapNumbers n{.camera = camera, .intervals = 4, .row = {}, .col = {}};
    for (int i = 0; i < 7; ++i)
      for (int j = 0; j < 7; ++j) {
        n.row.push_back(1.5 * (i - 1) + shift);
        n.col.push_back(1.5 * (j - 1) - shift);
      }
    n.error = 0.001 + shift;
    n.edge_width = 0.34;
    n.outlier_share = 0.125;
    n.edges = 1234;
    auto map = CameraMap::make(n);
    EXPECT_TRUE(map.ok()) << map.error().line();
    r.maps.push_back(*std::move(map));
  }
  return r;
}

}  // namespace symrig::tests
