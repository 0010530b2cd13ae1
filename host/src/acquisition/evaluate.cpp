// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/evaluate.hpp"

#include "symrig/base/random.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

namespace symrig {
namespace {

/// Squared norms gathered over pixels, channels and random vectors.
struct Squares {
  double error = 0, truth = 0, everything = 0;

  /// ‖error‖/‖truth‖. Where the truth is exactly dark (a plane has no indirect light) any error is told as a
  /// share of the whole photograph instead: still 0 only for a tensor that is dark there too.
  double relative() const {
    if (truth > 0) return std::sqrt(error / truth);
    return error > 0 ? std::sqrt(error / everything) : 0;
  }
};

using Seen = std::vector<char>;  ///< camera pixels that count; empty = all

class Comparison {
 public:
  Comparison(const TransportTensor& tensor, const TrueTransport& truth) : tensor_(tensor), truth_(truth) {}

  /// Adds ‖T̃p − Tp‖² and ‖Tp‖² over the pixels of each mask.
  Result<void> add(const Image<float>& pattern,
                   std::initializer_list<std::pair<const Seen*, Squares*>> masks) const {
    SYMRIG_TRY(const Image<float> estimate, tensor_.apply(pattern));
    SYMRIG_TRY(const Image<float> exact, truth_(pattern));
    if (exact.grid() != estimate.grid() || exact.channels() != estimate.channels())
      return Error{ErrorCode::size_mismatch,
                   "the truth is " + to_string(exact.grid()) + " with " + std::to_string(exact.channels()) +
                       " channels, the tensor " + to_string(estimate.grid()) + " with " +
                       std::to_string(estimate.channels()),
                   "evaluate against the rig that the scene was captured with"};
    const auto pixels = static_cast<std::size_t>(exact.grid().size());
    for (std::size_t i = 0; i < exact.values().size(); ++i) {
      const double t = exact.values()[i];
      const double e = static_cast<double>(estimate.values()[i]) - t;
      for (const auto& [seen, squares] : masks) {
        squares->everything += t * t;
        if (!seen->empty() && (*seen)[i % pixels] == 0) continue;
        squares->error += e * e;
        squares->truth += t * t;
      }
    }
    return {};
  }

 private:
  const TransportTensor& tensor_;
  const TrueTransport& truth_;
};

}  // namespace

Result<TransportErrors> evaluate(const TransportTensor& tensor, const TrueTransport& truth,
                                 const EvaluateOptions& options) {
  const Grid grid = tensor.projector_grid();
  const auto pixels = static_cast<std::size_t>(grid.size());
  const bool coaxial = grid == tensor.camera_grid();
  const Comparison compare(tensor, truth);
  const Seen all;
  Random random(options.seed);
  Squares frobenius, indirect, flood, bar, bar_outside, random_light, natural;
  for (int k = 0; k < options.probes; ++k) {
    Image<float> z(grid);
    for (float& v : z.values()) v = random.sign();
    SYMRIG_CHECK(compare.add(z, {{&all, &frobenius}}));
    Seen dark(pixels, 1);
    for (std::size_t i = 0; i < pixels; ++i) {
      const bool lit = random.uniform() < 1.0 / 16;
      z.values()[i] = lit ? random.sign() : 0;
      dark[i] = lit ? 0 : 1;
    }
    if (coaxial) SYMRIG_CHECK(compare.add(z, {{&dark, &indirect}}));
  }
  const Image<float> bar_light = bar_pattern(grid);
  Seen outside(pixels);
  for (std::size_t i = 0; i < pixels; ++i) outside[i] = bar_light.values()[i] == 0 ? 1 : 0;
  SYMRIG_CHECK(compare.add(Image<float>(grid, 1, 1.0F), {{&all, &flood}}));
  SYMRIG_CHECK(compare.add(random_pattern(grid, options.seed + 1), {{&all, &random_light}}));
  SYMRIG_CHECK(compare.add(natural_pattern(grid, options.seed + 2), {{&all, &natural}}));
  if (coaxial) {
    SYMRIG_CHECK(compare.add(bar_light, {{&all, &bar}, {&outside, &bar_outside}}));
  } else {
    SYMRIG_CHECK(compare.add(bar_light, {{&all, &bar}}));
  }
  return TransportErrors{frobenius.relative(),    indirect.relative(), flood.relative(),      bar.relative(),
                         random_light.relative(), natural.relative(),  bar_outside.relative()};
}

}  // namespace symrig
