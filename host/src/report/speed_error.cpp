// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/speed_error.hpp"

#include <algorithm>
#include <cmath>

namespace symrig {
namespace {

bool usable(const CostError& p) {
  return std::isfinite(p.cost) && p.cost > 0 && std::isfinite(p.error) && p.error >= 0;
}

/// y at x by linear interpolation of log y over log x through two points. x0 ≠ x1; all > 0.
double on_log_line(double x, double x0, double y0, double x1, double y1) {
  const double share = std::log(x / x0) / std::log(x1 / x0);
  return y0 * std::pow(y1 / y0, share);
}

}  // namespace

std::vector<CostError> lower_envelope(std::vector<CostError> captures) {
  std::erase_if(captures, [](const CostError& p) { return !usable(p); });
  std::sort(captures.begin(), captures.end(), [](const CostError& a, const CostError& b) {
    return a.cost < b.cost || (a.cost == b.cost && a.error < b.error);
  });
  std::vector<CostError> envelope;
  for (const CostError& p : captures)
    if (envelope.empty() || p.error < envelope.back().error) envelope.push_back(p);
  return envelope;
}

Reading cost_at_error(std::span<const CostError> envelope, double error) {
  if (envelope.empty() || !(error >= envelope.back().error)) return {};
  if (error > envelope.front().error) return {Reach::at_most, envelope.front().cost};
  const auto hit = std::find_if(envelope.begin(), envelope.end(),
                                [error](const CostError& p) { return p.error <= error; });
  if (hit->error == error) return {Reach::read, hit->cost};
  if (hit->error == 0) return {Reach::at_most, hit->cost};
  const CostError& before = *std::prev(hit);
  return {Reach::read, on_log_line(error, before.error, before.cost, hit->error, hit->cost)};
}

Reading error_at_cost(std::span<const CostError> envelope, double cost) {
  if (envelope.empty() || !(cost >= envelope.front().cost)) return {};
  if (cost > envelope.back().cost) return {Reach::at_most, envelope.back().error};
  const auto hit =
      std::find_if(envelope.begin(), envelope.end(), [cost](const CostError& p) { return p.cost >= cost; });
  if (hit->cost == cost) return {Reach::read, hit->error};
  const CostError& before = *std::prev(hit);
  if (hit->error == 0) return {Reach::at_most, before.error};
  return {Reach::read, on_log_line(cost, before.cost, before.error, hit->cost, hit->error)};
}

Reading ratio(const Reading& value, double reference) {
  if (!value.reached()) return {};
  if (reference > 0) return {value.reach, value.value / reference};
  return value.value == 0 ? Reading{value.reach, 1} : Reading{};
}

Reading larger(const Reading& a, const Reading& b) {
  if (!a.reached() || !b.reached()) return {};
  if (a.value != b.value) return a.value > b.value ? a : b;
  return a.reach == Reach::read ? a : b;
}

Reach MeanRatio::reach() const {
  if (averaged == 0 || not_reached > 0) return Reach::not_reached;
  return bounds > 0 || zero > 0 ? Reach::at_most : Reach::read;
}

MeanRatio geometric_mean(std::span<const Reading> ratios) {
  MeanRatio mean;
  double logs = 0;
  for (const Reading& one : ratios) {
    if (!one.reached()) {
      ++mean.not_reached;
    } else if (one.value <= 0) {
      ++mean.zero;
    } else {
      ++mean.averaged;
      mean.bounds += one.reach == Reach::at_most ? 1 : 0;
      logs += std::log(one.value);
    }
  }
  if (mean.averaged > 0) mean.value = std::exp(logs / mean.averaged);
  return mean;
}

}  // namespace symrig
