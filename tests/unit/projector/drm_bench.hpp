// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "fake_kms.hpp"
#include "symrig/projector/drm_projector.hpp"

#include <gtest/gtest.h>

namespace symrig::projector::drm::test {

/// A machine with one card and one display, and patterns for it.
class DrmBench : public ::testing::Test {
 protected:
  Result<std::unique_ptr<DrmProjector>> open() { return DrmProjector::open(cards, options); }

  /// Opens, loads `count` patterns and hands the projector over.
  std::unique_ptr<DrmProjector> opened(std::size_t count = 5) {
    auto projector = open();
    if (!projector) {
      ADD_FAILURE() << projector.error().line();
      return nullptr;
    }
    const auto loaded = (*projector)->load(patterns((*projector)->grid(), count));
    EXPECT_TRUE(loaded.ok()) << loaded.error().line();
    return *std::move(projector);
  }

  /// Pattern k is grey k+1 of 255 everywhere but for one white pixel.
  static std::vector<Pattern> patterns(Grid grid, std::size_t count) {
    std::vector<Pattern> made;
    for (std::size_t k = 0; k < count; ++k) {
      made.emplace_back(grid, 1, static_cast<float>(k + 1) / 255.F);
      made.back().values()[k] = 1;
    }
    return made;
  }

  /// What pattern k must look like on the screen.
  std::vector<std::uint32_t> wanted(const DrmProjector& projector, std::size_t k) const {
    const auto codes = to_codes(patterns(projector.grid(), k + 1)[k], projector.grid(), {}, k);
    const auto picture = draw(*codes, options.placement, projector.screen());
    std::vector<std::uint32_t> pixels;
    for (const std::uint8_t code : picture.values()) pixels.push_back(0x010101U * code);
    return pixels;
  }

  std::shared_ptr<FakeCard> card = std::make_shared<FakeCard>(FakeCard::with_one_display());
  FakeCards cards{card};
  DrmProjectorOptions options;
};

}  // namespace symrig::projector::drm::test
