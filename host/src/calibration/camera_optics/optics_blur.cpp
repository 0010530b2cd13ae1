// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_optics/combs.hpp"
#include "calibration/photograph_each.hpp"
#include "symrig/calibration/camera_optics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace symrig {

using calibration::CombPair;
using calibration::each_comb_pair;
using calibration::gathered;

namespace {

constexpr int kPeriod = CombPhotographs::period, kTile = 8;
/// σp − σc before anything is measured. Projectors have less depth of field than cameras. So it is anywhere
/// between 0 and what it is if the camera is as sharp as its pixels are, all alike probable.
struct Prior {
  double mean, sigma;  ///< [cells]

  /// both: √((σp² + σc²) / 2). pixel: rms width of a pixel. [cells]
  Prior(double both, double pixel) {
    const double largest = std::max(0.0, std::sqrt(std::max(0.0, 2 * both * both - pixel * pixel)) - pixel);
    mean = 0.5 * largest;
    sigma = largest / std::sqrt(12.0);
  }
};

/// What f − g is off by, as a share of √(a a′), the same way wherever light has a gradient. On smooth scenes
/// f − g follows gradients where both blurs are equal: on vgroove-white, tiles say σp − σc = 0.3 to 0.5
/// cells. Maps of blurred benches are off by up to 0.004 cells (docs/research/registration.md), which would
/// do that. So smooth scenes are left to the prior.
constexpr double kUneven = 0.005;

/// Sums over the pairs of neighbours in a tile: m = √(a a′), d = a − a′, f − g.
struct Tile {
  double mm = 0, md = 0, dd = 0, mf = 0, df = 0;
};

/// Sums over both axes.
struct Sums {
  double crossing = 0, own = 0;  ///< Σ (f + g), Σ (a + a′)
  double slope = 0, spread = 0;  ///< Σ d (f − g), Σ d², without what a shift of each tile explains
  double light = 0;              ///< Σ m²
  double variance = 0;           ///< Σ d² Var(f − g)
  double near = 0, far = 0;      ///< Σ light in the near and far halves of next cells

  void add(const Tile& t) {
    if (!(t.mm > 0)) return;
    slope += t.df - t.md * t.mf / t.mm;
    spread += t.dd - t.md * t.md / t.mm;
    light += t.mm;
  }
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
  const int across = (grid.cols + kTile - 1) / kTile;
  for (int c = 0; c < combs.front().mean.channels(); ++c) {
    std::vector<Tile> tiles(std::size_t{1} * across * ((grid.rows + kTile - 1) / kTile));
    each_comb_pair(combs, seen, rows, c, [&](const CombPair& p) {
      sums.crossing += p.here + p.next;
      sums.own += p.own + p.next_own;
      const double near = p.own * half(p.row, p.col, c, true),
                   other = p.next_own * half(p.next_row, p.next_col, c, false);
      const double m = std::sqrt(p.own * p.next_own), d = near - other, difference = p.here - p.next;
      Tile& tile = tiles[p.row / kTile * across + p.col / kTile];
      tile.mm += m * m, tile.md += m * d, tile.dd += d * d;
      tile.mf += m * difference, tile.df += d * difference;
      sums.variance += d * d * p.variance;
    });
    for (const Tile& tile : tiles) sums.add(tile);
  }
}

/// Adds what the combs of one axis put into the halves of the next cells. combs: on the quarters.
void add_halves(std::span<const Radiance> combs, const Image<std::uint8_t>& seen, bool rows, Sums& sums) {
  const Grid cells = seen.grid(), quarters = combs.front().mean.grid();
  for (int c = 0; c < combs.front().mean.channels(); ++c)
    for (int row = 0; row < quarters.rows; ++row)
      for (int col = 0; col < quarters.cols; ++col) {
        const int half = rows ? row : col, cell = half / 2;
        if (cell < 1 || cell + 1 >= (rows ? cells.rows : cells.cols) || seen.at(row / 2, col / 2) == 0)
          continue;
        if (!std::ranges::all_of(combs,
                                 [&](const Radiance& comb) { return comb.valid.at(row, col, c) != 0; }))
          continue;
        const auto light = [&](int comb) {
          return static_cast<double>(combs[comb % kPeriod].mean.at(row, col, c));
        };
        const double background = light(cell + 2);
        const double before = light(cell - 1) - background, after = light(cell + 1) - background;
        const bool first = half % 2 == 0;  // the half next to the cell before
        sums.near += first ? before : after;
        sums.far += first ? after : before;
      }
}

/// σp and σc from σp² + σc² and σp − σc.
OpticsBlur solve(const Sums& sums, double pixel) {
  OpticsBlur blur;
  if (!(sums.own > 0)) return blur;
  const double root = std::sqrt(2 * std::numbers::pi);
  // A cell's own light is what does not cross its two borders.
  const double ratio = std::max(0.0, sums.crossing / sums.own), stays = 1 / (1 + 2 * ratio);
  const double both = root * ratio * stays;
  const Prior prior(both, pixel / std::sqrt(12.0));
  double difference = prior.mean;
  blur.sigma = prior.sigma;
  if (sums.spread > 0) {
    const double noise =
        2 * std::numbers::pi / sums.spread * (sums.variance / sums.spread + kUneven * kUneven * sums.light);
    const double trust = prior.sigma * prior.sigma / (prior.sigma * prior.sigma + noise);
    const double largest = std::numbers::sqrt2 * both;
    const double measured = stays * root * sums.slope / sums.spread;
    difference = std::clamp(prior.mean + trust * (measured - prior.mean), -largest, largest);
    blur.sigma = std::sqrt(trust * noise);
  }
  const double sum = std::sqrt(std::max(0.0, 2 * both * both - difference * difference));
  blur.projector = std::max(0.0, 0.5 * (sum + difference));
  blur.camera = std::max(0.0, 0.5 * (sum - difference));
  blur.far = sums.near > 0 ? std::max(0.0, sums.far / sums.near) : 0;
  blur.measured = true;
  return blur;
}

}  // namespace

double OpticsBlur::missing(double pixel) const {
  return measured ? std::max(0.0, projector * projector - camera * camera - pixel * pixel / 12) : 0;
}

/// A cell [−1, 0] of light 1, blurred: ∫ Q(t / σ) dt from 0 to ½ is in the near half of the next cell, and
/// from ½ to 1 in the far half. Q is the tail of the normal distribution.
double OpticsBlur::far_light(double width) {
  if (!(width > 0)) return 0;
  const auto until = [&](double x) {
    const double u = x / width;
    const double tail = 0.5 * std::erfc(u / std::numbers::sqrt2);
    const double density = std::exp(-0.5 * u * u) / std::sqrt(2 * std::numbers::pi);
    return u * tail + 1 / std::sqrt(2 * std::numbers::pi) - density;
  };
  return until(1) / until(0.5) - 1;
}

Result<CombPhotographs> photograph_combs(Probe& rig, const Progress& progress) {
  const Grid cells = rig.grid();
  CombPhotographs combs;
  if (std::min(cells.rows, cells.cols) < kPeriod) return combs;
  for (const bool rows : {false, true}) {
    std::vector<Pattern> patterns(kPeriod, Pattern(cells, 1));
    for (int row = 0; row < cells.rows; ++row)
      for (int col = 0; col < cells.cols; ++col) patterns[(rows ? row : col) % kPeriod].at(row, col) = 1;
    std::vector<Radiance>& photographs = rows ? combs.rows : combs.columns;
    SYMRIG_TRY(photographs, calibration::photograph_each(rig, patterns, "combs", progress));
  }
  return combs;
}

Result<OpticsBlur> measure_blur(const CombPhotographs& combs, const BlurWeights& weights) {
  const Grid cells = weights.seen.grid(), quarters{2 * cells.rows, 2 * cells.cols};
  if (weights.cells.cells() != cells || weights.quarters.cells() != quarters ||
      weights.flood.grid() != quarters || weights.flood.channels() != weights.cells.channels())
    return Error{ErrorCode::size_mismatch, "the weights of the blur do not fit the rig's cells",
                 "calibrate the rig again"};
  Sums sums;
  for (const bool rows : {false, true}) {
    const std::vector<Radiance>& photographs = rows ? combs.rows : combs.columns;
    if (photographs.empty()) return OpticsBlur{};
    SYMRIG_TRY(const auto on_cells, gathered(weights.cells, photographs));
    SYMRIG_TRY(const auto on_quarters, gathered(weights.quarters, photographs));
    add_axis(on_cells, weights.flood, weights.seen, rows, sums);
    add_halves(on_quarters, weights.seen, rows, sums);
  }
  return solve(sums, weights.cells.pixel_side());
}

}  // namespace symrig
