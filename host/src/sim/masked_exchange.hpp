// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/exchange.hpp"

#include <functional>
#include <memory>

namespace symrig::sim {

/// True if a point s from the crease on the left plane sees a point t from the crease on the right plane.
using Sight = std::function<bool(double s, double t)>;

/// Exchange of a groove with a blocker along the whole crease, so that visibility depends only on the two
/// columns. M[s, t] is a convolution along y. It is stored as its real spectrum for each pair of columns that
/// see each other. High frequencies are kept only near the crease, because the spectrum of 1/(a² + y²)² falls
/// as (1 + aω) e^{−aω}.
/// cost: one FFT of 2.5 rows per column and direction, then the stored products.
/// error: every entry within 3e-6 of the largest entry of its pair of columns, plus 2e-8 because two columns
/// share a transform. Entries may be negative by the same amounts. Visibility itself is exact.
/// source: form factors of groove.hpp.
std::unique_ptr<Exchange> masked_exchange(const Groove& groove, const Sight& sees);

/// One part of a groove that opaque fins cut into chambers. No light passes between chambers.
struct Chamber {
  int row_begin, row_end;
  std::unique_ptr<Exchange> exchange;  ///< for the rows of the chamber
};
std::unique_ptr<Exchange> chambered_exchange(Grid grid, std::vector<Chamber> chambers);

}  // namespace symrig::sim
