// SPDX-License-Identifier: Apache-2.0
#include "program/longer_bracket.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::program {
namespace {

constexpr double kLongest = 1e15;  // ns, as in program files

std::vector<Nanoseconds> each_once(const std::vector<Nanoseconds>& all) {
  std::vector<Nanoseconds> once;
  for (const Nanoseconds one : all)
    if (std::find(once.begin(), once.end(), one) == once.end()) once.push_back(one);
  return once;
}

std::vector<Nanoseconds> legalized(const std::vector<Nanoseconds>& bracket, const Legalize& legalize) {
  std::vector<Nanoseconds> legal;
  legal.reserve(bracket.size());
  for (const Nanoseconds exposure : bracket) legal.push_back(legalize(exposure));
  return each_once(legal);
}

Nanoseconds times(Nanoseconds exposure, double factor) {
  return Nanoseconds{
      std::llround(std::min(kLongest, std::round(static_cast<double>(exposure.count()) * factor)))};
}

}  // namespace

std::vector<Nanoseconds> longer_bracket(const std::vector<Nanoseconds>& bracket, Nanoseconds least,
                                        const Legalize& legalize) {
  const std::vector<Nanoseconds> once = each_once(bracket);
  std::vector<Nanoseconds> legal = legalized(once, legalize);
  if (once.empty() || legal.size() == once.size()) return legal;
  const Nanoseconds shortest = std::max(*std::min_element(once.begin(), once.end()), Nanoseconds{1});
  const double factor = static_cast<double>(least.count()) / static_cast<double>(shortest.count());
  if (!(factor > 1)) return legal;
  std::vector<Nanoseconds> longer;
  longer.reserve(once.size());
  for (const Nanoseconds exposure : once) longer.push_back(std::max(times(exposure, factor), least));
  longer = legalized(longer, legalize);
  return longer.size() > legal.size() ? longer : legal;
}

std::vector<Nanoseconds> longer_bracket(const std::vector<Nanoseconds>& bracket, Nanoseconds least) {
  return longer_bracket(bracket, least, [least](Nanoseconds exposure) { return std::max(exposure, least); });
}

}  // namespace symrig::program
