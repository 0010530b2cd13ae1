// SPDX-License-Identifier: Apache-2.0
#include "sim/exchange.hpp"

#include <utility>

namespace symrig::sim {

namespace {

constexpr double kCrossFin = 0.37;                   // of the rows
constexpr double kFinBottom = 0.04, kFinTop = 0.15;  // of the columns

Groove with_rows(const Groove& groove, int rows) {
  return Groove({rows, groove.grid.cols});
}

}  // namespace

bool passes_hovering_fin(const Groove& groove, double s, double t) {
  const double height = s + t > 0 ? 2 * s * t / (s + t) : 0;
  return height < kFinBottom * groove.grid.cols || height > kFinTop * groove.grid.cols;
}

int row_of_cross_fin(const Groove& groove) {
  return static_cast<int>(kCrossFin * groove.grid.rows);
}

std::unique_ptr<Exchange> occluded_exchange(const Groove& groove) {
  const int cut = row_of_cross_fin(groove);
  const int rows = groove.grid.rows;
  const auto sees = [&groove](double s, double t) { return passes_hovering_fin(groove, s, t); };
  std::vector<Chamber> chambers;
  if (cut > 0) chambers.push_back({0, cut, open_exchange(with_rows(groove, cut))});
  chambers.push_back({cut, rows, masked_exchange(with_rows(groove, rows - cut), sees)});
  return chambered_exchange(groove.grid, std::move(chambers));
}

}  // namespace symrig::sim
