// SPDX-License-Identifier: Apache-2.0
#include "report/ratio_text.hpp"

#include "symrig/report/text.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::report {
namespace {

std::string with_reach(Reach reach, double value) {
  return (reach == Reach::at_most ? "≤ " : "") + text::short_number(value);
}

}  // namespace

std::string ratio_text(const Reading& reading) {
  return reading.reached() ? with_reach(reading.reach, reading.value) : "-";
}

std::string mean_text(const MeanRatio& mean) {
  if (mean.averaged == 0) return "-";
  std::string text = with_reach(mean.bounds > 0 ? Reach::at_most : Reach::read, mean.value);
  const int all = mean.averaged + mean.not_reached + mean.zero;
  if (mean.not_reached > 0) text += fmt::format(" ({} of {} not reached)", mean.not_reached, all);
  if (mean.zero > 0) text += fmt::format(" ({} of {} zero)", mean.zero, all);
  return text;
}

const FloodBias* flood_of_symrig(const BenchSummary& summary, const std::string& scene) {
  const auto found = std::find_if(summary.flood.begin(), summary.flood.end(), [&scene](const FloodBias& b) {
    return b.scene == scene && b.algorithm == Algorithm::symrig;
  });
  return found == summary.flood.end() ? nullptr : &*found;
}

}  // namespace symrig::report
