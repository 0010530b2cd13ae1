// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/exchange.hpp"

#include <functional>
#include <memory>

namespace symrig::sim {

/// True where a point s from the crease on the left plane sees a point t from it on the right one.
using Sight = std::function<bool(double s, double t)>;

/// Exchange of a groove with a blocker that reaches along the whole crease, so that visibility depends on the
/// two columns alone: M[s, t] is a convolution along y, held as its (real) spectrum for each pair of columns
/// that see each other. High frequencies are kept near the crease only: the spectrum of 1/(a² + y²)²
/// falls as (1 + aω) e^{−aω}.
/// cost: one FFT of 2.5 rows a column and direction, then the kept products.  error: every entry within 3e-6
/// of the largest entry of its pair of columns, plus 2e-8 (two columns share a transform, and its rounding);
/// entries may fall below zero by as much. Visibility itself is exact.  source: form factors of groove.hpp.
std::unique_ptr<Exchange> masked_exchange(const Groove& groove, const Sight& sees);

/// The exchange of a groove cut into chambers by opaque fins across it: no light passes from one to another.
struct Chamber {
  int row_begin, row_end;
  std::unique_ptr<Exchange> exchange;  ///< on the rows of the chamber
};
std::unique_ptr<Exchange> chambered_exchange(Grid grid, std::vector<Chamber> chambers);

}  // namespace symrig::sim
