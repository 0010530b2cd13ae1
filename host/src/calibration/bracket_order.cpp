// SPDX-License-Identifier: Apache-2.0
#include "calibration/bracket_order.hpp"

#include "hdr/clipping.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

using Still = SensorPhotographs::Still;

constexpr double kLonger = 1.5;
constexpr double kFewestPixels = 100;  // pixels

/// How a longer exposure differs from a shorter one, in numbers of samples.
struct Difference {
  double brighter = 0, darker = 0;
  double middle = 0;  ///< samples of middle tones, which a longer exposure must change
  double middle_changed = 0;

  double changed() const { return brighter + darker; }
  bool is_darker() const { return changed() >= kFewestPixels && darker > brighter; }
  bool is_equal() const {
    constexpr double kMostChanged = 0.05;
    return middle >= kFewestPixels && middle_changed < kMostChanged * middle;
  }
};

/// What noise does not explain counts: two codes, and 3 % of the brightest code.
Difference compare(const Still& shorter, const Still& longer) {
  constexpr double kNoise = 0.03, kDark = 0.1, kBright = 0.6;
  const double top = std::max(hdr::brightest(shorter.codes), hdr::brightest(longer.codes));
  const double least = std::max(2.0, kNoise * top);
  Difference found;
  for (std::size_t i = 0; i < shorter.codes.size(); ++i) {
    const double change = static_cast<double>(longer.codes[i]) - shorter.codes[i];
    found.brighter += change > least ? 1 : 0;
    found.darker += change < -least ? 1 : 0;
    if (shorter.codes[i] < kDark * top || shorter.codes[i] > kBright * top) continue;
    found.middle += 1;
    found.middle_changed += std::abs(change) > least ? 1 : 0;
  }
  return found;
}

std::string name_of(const Still& still) {
  return fmt::format("{} ({:.4g} ms)", still.file, 1e3 * seconds(still.exposure));
}

/// The first still of each exposure, each at least kLonger times as long as the one before.
std::vector<const Still*> ladder_of(const SensorPhotographs& photographs) {
  std::vector<const Still*> sorted, ladder;
  for (const Still& still : photographs.bracket) sorted.push_back(&still);
  std::ranges::stable_sort(sorted, {}, [](const Still* one) { return one->exposure; });
  for (const Still* one : sorted)
    if (ladder.empty() || seconds(one->exposure) >= kLonger * seconds(ladder.back()->exposure))
      ladder.push_back(one);
  return ladder;
}

/// Whether each frame from the second one on shows the exposure of the one before: they grow, and the first
/// one, which belongs to what was before, is no shorter one.
bool is_late(const std::vector<const Still*>& ladder) {
  if (ladder.size() < 3) return false;
  for (std::size_t k = 2; k < ladder.size(); ++k)
    if (compare(*ladder[k - 1], *ladder[k]).is_darker()) return false;
  return compare(*ladder[0], *ladder[1]).is_darker();
}

Error longer_is_darker(const std::vector<const Still*>& ladder, std::size_t at, const Difference& by,
                       bool all) {
  const std::string seen =
      fmt::format("{} is darker than {} in {:.0f} % of the values that differ", name_of(*ladder[at + 1]),
                  name_of(*ladder[at]), 100 * by.darker / by.changed());
  const std::string late =
      at == 0 && is_late(ladder)
          ? "the frames are one late, since all others grow with their exposure (the first one is of another "
            "bracket)"
          : "";
  const std::string order = all            ? "the exposures are in the reverse order"
                            : late.empty() ? "exposures are exchanged, or the light has changed"
                                           : late + ", or exposures are exchanged, or the light has changed";
  return {ErrorCode::bad_value, seen + ": " + order,
          "correct the exposures in capture.toml, or photograph the bracket again"};
}

/// A camera gives no two frames of the same codes: read noise changes some of them.
bool are_the_same(const Still& one, const Still& other) {
  return one.codes == other.codes;
}

Error both_are_equal(const Still& shorter, const Still& longer) {
  if (are_the_same(shorter, longer))
    return {
        ErrorCode::bad_value,
        fmt::format("{} and {} are the same frame, code for code: one was doubled, and another is missing",
                    name_of(longer), name_of(shorter)),
        "photograph the bracket again"};
  return {
      ErrorCode::bad_value,
      fmt::format("{} is as bright as {}: the camera has not used these exposures (automatic exposure), or "
                  "they are not what capture.toml says",
                  name_of(longer), name_of(shorter)),
      "switch automatic exposure off and photograph the bracket again, or correct the exposures"};
}

}  // namespace

Result<void> check_bracket_order(const SensorPhotographs& photographs) {
  const std::vector<const Still*> ladder = ladder_of(photographs);
  std::vector<Difference> found;
  for (std::size_t k = 1; k < ladder.size(); ++k) found.push_back(compare(*ladder[k - 1], *ladder[k]));
  const auto first = std::ranges::find_if(found, &Difference::is_darker);
  if (first != found.end()) {
    const bool all = std::ranges::all_of(
        found, [](const Difference& one) { return one.is_darker() || one.changed() < kFewestPixels; });
    return longer_is_darker(ladder, static_cast<std::size_t>(first - found.begin()), *first, all);
  }
  const auto same = std::ranges::find_if(found, &Difference::is_equal);
  if (same == found.end()) return {};
  const auto at = static_cast<std::size_t>(same - found.begin());
  return both_are_equal(*ladder[at], *ladder[at + 1]);
}

}  // namespace symrig::calibration
