// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/optics_blur.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr int kPeriod = 4, kTile = 8;
/// [cells] A priori standard deviation of σp − σc.
constexpr double kPrior = 0.2;

/// What f − g is off by, as a share of √(a a′): shift and light are not even over a tile. It matters where
/// albedo is.
constexpr double kUneven = 0.001;

/// Sums over the pairs of neighbours in a tile: m = √(a a′), d = a − a′, f − g.
struct Tile {
  double mm = 0, md = 0, dd = 0, mf = 0, df = 0;
};

struct Sums {
  double crossing = 0, own = 0;  ///< Σ (f + g), Σ (a + a′)
  std::map<std::pair<int, int>, Tile> tiles;
  double variance = 0;  ///< Σ d² Var(f − g)
};

/// Adds what the four combs of one axis tell.
void add_axis(std::span<const Radiance> combs, const Image<float>& quarters, const Image<std::uint8_t>& seen,
              bool rows, Sums& sums) {
  const Grid grid = seen.grid();
  // Radiance of the half of a cell that lies towards the next cell (or the last one), as a share of the
  // cell's.
  const auto half = [&](int row, int col, int channel, bool next) {
    const auto at = [&](int r, int c) {
      return static_cast<double>(quarters.at(2 * row + r, 2 * col + c, channel));
    };
    const int k = next ? 1 : 0;
    const double one = rows ? at(k, 0) + at(k, 1) : at(0, k) + at(1, k);
    const double all = at(0, 0) + at(0, 1) + at(1, 0) + at(1, 1);
    return all > 0 ? 2 * one / all : 1;
  };
  const int down = rows ? 1 : 0, right = rows ? 0 : 1;
  for (int c = 0; c < combs.front().mean.channels(); ++c) {
    const auto light = [&](int row, int col, int ahead) {
      const int at = (rows ? row : col) + ahead;
      return static_cast<double>(combs[at % kPeriod].mean.at(row, col, c));
    };
    const auto variance = [&](int row, int col, int ahead) {
      const int at = (rows ? row : col) + ahead;
      return static_cast<double>(combs[at % kPeriod].variance.at(row, col, c));
    };
    for (int row = 0; row + down < grid.rows; ++row)
      for (int col = 0; col + right < grid.cols; ++col) {
        const int r = row + down, q = col + right;
        bool good = seen.at(row, col) != 0 && seen.at(r, q) != 0;
        for (const Radiance& comb : combs)
          good = good && comb.valid.at(row, col, c) != 0 && comb.valid.at(r, q, c) != 0;
        if (!good) continue;
        const double far = light(row, col, 2), far_next = light(r, q, 2);
        const double a = light(row, col, 0) - far, next = light(r, q, 0) - far_next;
        if (!(a > 0 && next > 0)) continue;
        // The cell before a cell is three ahead, because combs repeat after four.
        const double f = light(row, col, 1) - far, g = light(r, q, 3) - far_next;
        sums.crossing += f + g;
        sums.own += a + next;
        Tile& tile = sums.tiles[{row / kTile + (rows ? 1 << 20 : 0), col / kTile}];
        const double near = a * half(row, col, c, true), other = next * half(r, q, c, false);
        const double m = std::sqrt(a * next), d = near - other, difference = f - g;
        tile.mm += m * m, tile.md += m * d, tile.dd += d * d;
        tile.mf += m * difference, tile.df += d * difference;
        sums.variance +=
            d * d * (variance(row, col, 1) + variance(r, q, 3) + variance(row, col, 2) + variance(r, q, 2));
      }
  }
}

/// σp and σc from σp² + σc² and σp − σc.
OpticsBlur solve(const Sums& sums) {
  OpticsBlur blur;
  if (!(sums.own > 0)) return blur;
  const double root = std::sqrt(2 * std::numbers::pi);
  // A cell's own light is what does not cross its two borders.
  const double ratio = std::max(0.0, sums.crossing / sums.own), stays = 1 / (1 + 2 * ratio);
  const double both = root * ratio * stays;
  double slope = 0, spread = 0, light = 0;
  for (const auto& [place, t] : sums.tiles) {
    if (!(t.mm > 0)) continue;
    slope += t.df - t.md * t.mf / t.mm;
    spread += t.dd - t.md * t.md / t.mm;
    light += t.mm;
  }
  // Regression with a prior of no difference.
  const double noise =
      spread > 0
          ? 2 * std::numbers::pi * (sums.variance / (spread * spread) + kUneven * kUneven * light / spread)
          : 1e30;
  const double trust = kPrior * kPrior / (kPrior * kPrior + noise);
  const double largest = std::sqrt(2.0) * both;
  const double difference =
      spread > 0 ? std::clamp(trust * stays * root * slope / spread, -largest, largest) : 0.0;
  const double sum = std::sqrt(std::max(0.0, 2 * both * both - difference * difference));
  blur.projector = std::max(0.0, 0.5 * (sum + difference));
  blur.camera = std::max(0.0, 0.5 * (sum - difference));
  blur.sigma = std::sqrt(trust * noise);
  blur.measured = true;
  return blur;
}

}  // namespace

double OpticsBlur::missing() const {
  return measured ? std::max(0.0, projector * projector - camera * camera) : 0;
}

Result<OpticsBlur> measure_blur(Probe& probe, const Image<float>& quarters, const Image<std::uint8_t>& seen,
                                const Progress& progress) {
  const Grid cells = probe.grid();
  if (quarters.grid() != Grid{2 * cells.rows, 2 * cells.cols} || quarters.channels() != probe.channels() ||
      seen.grid() != cells || probe.camera_grid() != cells)
    return Error{ErrorCode::size_mismatch, "blur is measured on the projector's cells",
                 "wrap the rig in a RegisteredProbe"};
  if (std::min(cells.rows, cells.cols) < kPeriod) return OpticsBlur{};
  Sums sums;
  for (const bool rows : {false, true}) {
    std::vector<Radiance> combs;
    for (int phase = 0; phase < kPeriod; ++phase) {
      const int done = phase + (rows ? kPeriod : 0);
      if (progress && !progress({"blur", done, std::int64_t{2} * kPeriod, kNoneToCome}))
        return Error{ErrorCode::interrupted, fmt::format("calibration stopped after {} combs", done),
                     "run it again"};
      Pattern pattern(cells, 1);
      for (int row = 0; row < cells.rows; ++row)
        for (int col = 0; col < cells.cols; ++col)
          pattern.at(row, col) = (rows ? row : col) % kPeriod == phase ? 1.F : 0.F;
      SYMRIG_TRY(auto one, probe.measure({&pattern, 1}));
      combs.push_back(std::move(one.front()));
    }
    add_axis(combs, quarters, seen, rows, sums);
  }
  return solve(sums);
}

}  // namespace symrig
