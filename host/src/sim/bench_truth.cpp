// SPDX-License-Identifier: Apache-2.0
#include "symrig/sim/bench_truth.hpp"

#include "sim/view.hpp"
#include "symrig/calibration/cell_weights.hpp"

#include <memory>
#include <utility>

namespace symrig {
namespace {

/// A photograph without noise.
Radiance exact(Image<float> mean) {
  const Grid grid = mean.grid();
  const int channels = mean.channels();
  return {std::move(mean), Image<float>(grid, channels),
          Image<std::uint8_t>(grid, channels, std::uint8_t{1})};
}

}  // namespace

Result<std::optional<TrueTransport>> bench_truth(const SceneUri& uri) {
  if (!uri.own_camera()) return std::optional<TrueTransport>();
  SYMRIG_TRY(sim::Bench made, sim::make_bench(uri));
  const auto bench = std::make_shared<sim::Bench>(std::move(made));
  const Grid cells = bench->truth->grid();
  const std::vector<CornerMap> corners = bench->view->corners();
  const Radiance flood = exact(bench->view->see(Image<float>(cells, 1, 1.F), 0));
  const Image<float> shares = bench->view->flood_shares();
  SYMRIG_TRY(CellWeights exact_weights, CellWeights::make(cells, corners, flood, {.margin = 0}, &shares));
  const auto weights = std::make_shared<const CellWeights>(std::move(exact_weights));
  return std::optional<TrueTransport>([bench, weights](const Image<float>& pattern) -> Result<Image<float>> {
    SYMRIG_TRY(Radiance seen, weights->gather(exact(bench->view->see(pattern, 0))));
    return std::move(seen.mean);
  });
}

}  // namespace symrig
