// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/sim/scene.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::sim {

/// T of a scene formed column by column: entry(row, col).
struct DenseTransport {
  std::size_t n = 0;
  std::vector<float> columns;
  float entry(std::size_t row, std::size_t col) const { return columns[col * n + row]; }
};

inline std::unique_ptr<Scene> scene_of(const std::string& text) {
  auto uri = parse_scene_uri(text);
  EXPECT_TRUE(uri.ok()) << uri.error().line();
  auto scene = make_scene(*uri);
  EXPECT_TRUE(scene.ok()) << scene.error().line();
  return *std::move(scene);
}

inline DenseTransport form(const Scene& scene, int channel = 0) {
  DenseTransport dense;
  dense.n = static_cast<std::size_t>(scene.grid().size());
  dense.columns.assign(dense.n * dense.n, -1.F);
  std::vector<float> unit(dense.n, 0.F);
  for (std::size_t col = 0; col < dense.n; ++col) {
    unit[col] = 1;
    scene.apply(unit, std::span(dense.columns).subspan(col * dense.n, dense.n), channel);
    unit[col] = 0;
  }
  return dense;
}

inline DenseTransport form(const std::string& uri) {
  return form(*scene_of(uri));
}

}  // namespace symrig::sim
