// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/projector.hpp"

#include <vector>

#include <gtest/gtest.h>

/// The laws that every Projector keeps. Whoever writes a driver runs expect_projector_laws on its projector.
namespace symrig {

/// A projector that the host paces shows each pattern on demand and says when.
inline void expect_shown_on_demand(Projector& projector, std::size_t patterns) {
  std::uint64_t refresh = 0;
  SteadyTime since{};
  for (std::size_t k = 0; k < patterns; ++k) {
    const auto shown = projector.show(k);
    ASSERT_TRUE(shown.ok()) << shown.error().line();
    if (k > 0) {
      EXPECT_GT(shown->refresh, refresh) << "a pattern appears at a refresh of its own";
      EXPECT_GE(shown->since, since);
    }
    refresh = shown->refresh;
    since = shown->since;
  }
  EXPECT_EQ(projector.show(patterns).error().code, ErrorCode::bad_argument) << "there is no such pattern";
}

inline void expect_projector_laws(Projector& projector) {
  EXPECT_TRUE(projector.grid().valid());
  EXPECT_GT(projector.refresh_period().count(), 0);
  EXPECT_FALSE(projector.describe().empty());
  EXPECT_EQ(projector.describe().find('\n'), std::string::npos) << "one line for reports";

  const Grid grid = projector.grid();
  std::vector<Pattern> patterns;
  patterns.reserve(3);
  for (int k = 0; k < 3; ++k) patterns.emplace_back(grid, 1, static_cast<float>(k) / 2.F);
  ASSERT_TRUE(projector.load(patterns).ok());
  if (projector.pacing() == Pacing::host) {
    expect_shown_on_demand(projector, patterns.size());
  } else {
    EXPECT_EQ(projector.show(0).error().code, ErrorCode::bad_argument) << "its trigger line paces it";
  }

  // What it cannot show is refused, and what it holds stays.
  const std::vector<Pattern> other(1, Pattern({grid.rows + 1, grid.cols}, 1, 0.F));
  EXPECT_EQ(projector.load(other).error().code, ErrorCode::size_mismatch);
  if (projector.pacing() == Pacing::host) {
    EXPECT_TRUE(projector.show(1).ok());
  }
}

}  // namespace symrig
