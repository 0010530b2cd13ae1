// SPDX-License-Identifier: Apache-2.0
// How wrong pictures on the camera's own pixels are: for tests and benchmarks.
#pragma once

#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

namespace symrig::tests {

/// Keeps the camera's own photographs.
class Keeping final : public ForwardingProbe {
 public:
  Keeping(Probe& rig, PhotographLog& log) : ForwardingProbe(rig), log_(log) {}

 private:
  Result<std::vector<Radiance>> seen(std::span<const Pattern> patterns,
                                     Result<std::vector<Radiance>> photographs) override {
    if (photographs) SYMRIG_CHECK(log_.append_run(patterns, *photographs, cost()));
    return photographs;
  }
  PhotographLog& log_;
};

/// Squares of an error and of the light, of everything and of what is not lit directly.
struct LightErrors {
  double error = 0, light = 0, error_aside = 0, light_aside = 0;

  void add(double found, double truth, bool is_lit) {
    const double e = (found - truth) * (found - truth), l = truth * truth;
    error += e, light += l;
    if (!is_lit) error_aside += e, light_aside += l;
  }
  double all() const { return std::sqrt(error / light); }
  double aside() const { return std::sqrt(error_aside / light_aside); }
};

/// A pixel whose outline, with a margin [cells], is on the cells: whether it sees a lit one. Nothing: it is
/// not.
inline std::optional<bool> lit(const Outline& outline, const Pattern& pattern, double margin = 0.04) {
  double top = 1e9, left = 1e9, bottom = -1e9, right = -1e9;
  for (const Point& p : outline) {
    top = std::min(top, p.row - margin), bottom = std::max(bottom, p.row + margin);
    left = std::min(left, p.col - margin), right = std::max(right, p.col + margin);
  }
  const Grid grid = pattern.grid();
  if (top < 0 || left < 0 || bottom >= grid.rows || right >= grid.cols) return {};
  for (int y = static_cast<int>(top); y <= static_cast<int>(bottom); ++y)
    for (int x = static_cast<int>(left); x <= static_cast<int>(right); ++x)
      if (pattern.at(y, x) > 0) return true;
  return false;
}

}  // namespace symrig::tests
