// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/rank_test.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Sums of the check photographs over ranges of pixels, where they are dark. There no direct light and little
/// noise is in the way.
class DarkExcess {
 public:
  DarkExcess(std::span<const Checks::Residual> residuals, std::span<const double> flood_squared);

  /// Σ residual² of pixels [begin, end) in units of F², and what noise explains of it, as the rank test
  /// counts.
  Comparison of(std::int32_t begin, std::int32_t end) const;
  /// Σ of the light that check k puts into pixels [begin, end): Σ pattern.
  double lit(std::size_t check, std::int32_t begin, std::int32_t end) const;

 private:
  std::vector<Comparison> before_;               // running sums over pixels
  std::vector<std::vector<double>> lit_before_;  // [check], running sums
};

}  // namespace symrig::acquisition
