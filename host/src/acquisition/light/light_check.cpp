// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_check.hpp"

#include "acquisition/light/light_series.hpp"
#include "acquisition/light/light_tests.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace symrig::acquisition {

Error LightFault::error() const {
  std::string what = measured;
  for (std::size_t k = 0; k < causes.size(); ++k) {
    const char* const before = k > 0 ? "; or " : causes.size() == 1 ? "; cause: " : "; likely causes: ";
    what += before + causes[k].text;
  }
  std::string next = causes.empty() ? std::string() : causes.front().next;
  return {ErrorCode::wrong_light, std::move(what), std::move(next)};
}

LightCause late_frame() {
  return {"a frame came late or twice",
          "empty the camera's queue before each pattern, and tie each photograph to its trigger"};
}

LightCause stuck_pixels() {
  return {"stuck (hot) pixels of the camera",
          "state them as not valid, or list them as defects of the sensor"};
}

std::vector<LightCause> causes_of_missing_light() {
  return {{"a frame without light: it was lost, or the lamp or the shutter missed it",
           "tie each photograph to its trigger"},
          {"a lamp that flickers", "expose for whole periods of the lamp, or use a steady lamp"}};
}

std::vector<LightCause> causes_of_constant_light(bool equal) {
  const LightCause repeats{equal ? "the camera gives the same photograph again and again, with the same noise"
                                 : "the camera gives old photographs",
                           "check that the camera takes a new photograph for each trigger"};
  const LightCause room{
      "the projector's light does not reach the camera, and other light does (the lamp is off, "
      "the room is lit)",
      "switch the lamp on, and cover the rig"};
  const LightCause still{"the projector does not change its picture", "check what the projector shows"};
  return equal ? std::vector{repeats, still} : std::vector{room, still, repeats};
}

LightCause other_light(double black) {
  if (black > 0)
    return {fmt::format(
                "light of other sources, or a black level that is not subtracted: with the projector black, "
                "the camera still sees {} of that light",
                percent_of_light(black)),
            "cover the rig, and subtract a photograph of the dark projector"};
  return {
      fmt::format(
          "a black level that is subtracted, and too high: with the projector black, the photograph is {} "
          "of that light",
          percent_of_light(black)),
      "measure the black level again"};
}

LightFault afterglow(double share) {
  return {
      fmt::format("each photograph has {} of the light of the pattern before it", percent_of_light(share)),
      {{"the projector's picture is not settled, or the exposure begins before the pattern or ends after "
        "it",
        "wait longer between pattern and exposure (settle)"},
       {"a camera that mixes photographs (noise reduction over time)", ""}}};
}

LightFault sharpening(double less) {
  return {fmt::format("pixels beside lit ones are darker than others by {} of the light of lit ones",
                      percent_of_light(less)),
          {{"sharpening in the camera", "switch off sharpening and noise reduction, and take raw frames"}}};
}

std::string percent_of_light(double share) {
  const double percent = 100 * share;
  // {:.2g} would write 1e+02.
  return std::abs(percent) < 99.5 ? fmt::format("{:.2g} %", percent) : fmt::format("{:.0f} %", percent);
}

namespace {

using Found = std::optional<LightFault>;

std::string times(double correlation) {
  return fmt::format("{:.2f}", correlation + 0.0);
}

/// By the sum, by single bright pixels, and by what two photographs of all light have in common.
bool has_light(const LightSeries& series) {
  const LightSeries::Sum all = series.sum(LightSeries::kFlood);
  if (all.above(kLightSigmas)) return true;
  const LightPhotograph& flood = series[LightSeries::kFlood];
  double common = 0, squares = 0;
  for (std::size_t at = 0; at < series.valid().size(); ++at) {
    if (series.valid()[at] == 0) continue;
    const double light = flood.mean[at];
    if (series.size() == 1) {
      if (light > 0 && light * light > kLightSigmas * kLightSigmas * flood.variance[at]) return true;
      continue;
    }
    const double halves = static_cast<double>(series[LightSeries::kHalf].mean[at]) +
                          static_cast<double>(series[LightSeries::kOtherHalf].mean[at]);
    const double noise = static_cast<double>(flood.variance[at]) + series[LightSeries::kHalf].variance[at] +
                         series[LightSeries::kOtherHalf].variance[at];
    if (light > 0 && halves > 0 && light * light > kLightSigmas * kLightSigmas * noise &&
        halves * halves > kLightSigmas * kLightSigmas * noise)
      return true;
    common += light * halves;
    squares += light * light * halves * halves;
  }
  return common > kLightSigmas * std::sqrt(squares) && common > 0;
}

std::vector<LightCause> causes_of_darkness() {
  return {{"a cap on the lens or a closed iris", "let light reach the camera"},
          {"a lamp or a projector that is off", ""},
          {"a scene that is black", ""}};
}

/// One photograph cannot tell light that is missing from light that comes at other times.
std::vector<LightCause> causes_of_one_dark_photograph() {
  return {{"a cap on the lens, a lamp that is off, or a black scene", "let light reach the camera"},
          {"a camera that is one photograph late, or a projector that shows black for white",
           "capture with --check-axis, which tells"}};
}

/// No photograph holds light.
Found find_dark(const LightSeries& series) {
  for (std::size_t k = 0; k < series.size(); ++k) {
    const LightSeries::Sum sum = series.sum(k);
    if (sum.above(kLightSigmas) || sum.below(kLightSigmas)) return std::nullopt;
  }
  if (has_light(series)) return std::nullopt;
  const LightSeries::Sum flood = series.sum(LightSeries::kFlood);
  const std::string all =
      flood.sigma > 0 ? fmt::format("all its light is {:.1f} times its noise", flood.value / flood.sigma)
                      : std::string("it is 0 everywhere");
  return LightFault{fmt::format("the flood-lit photograph is dark: {}{}", all,
                                series.size() > 1 ? ", and no other pattern gives light" : ""),
                    series.size() > 1 ? causes_of_darkness() : causes_of_one_dark_photograph()};
}

std::string name_turn(Turn turn) {
  switch (turn) {
    case Turn::columns:
      return "mirrored left to right";
    case Turn::rows:
      return "mirrored top to bottom";
    case Turn::both:
      return "turned upside down (by 180 degrees)";
    case Turn::transposed:
      return "transposed: rows are columns";
    case Turn::across:
      return "transposed across the other diagonal: rows are columns";
    case Turn::quarter:
    case Turn::back:
      return "turned by a quarter";
    case Turn::none:
      break;
  }
  return "in place";
}

/// Where the user sets it right.
std::string undo(Turn turn) {
  const auto mirror = [](std::string_view which) {
    return fmt::format(
        "set mirror = \"{}\" under [projector] of the rig file, or let an exec: rig state mirror={}", which,
        which);
  };
  switch (turn) {
    case Turn::columns:
      return mirror("columns");
    case Turn::rows:
      return mirror("rows");
    case Turn::both:
      return mirror("both");
    case Turn::transposed:
    case Turn::across:
      return "exchange rows and columns of its picture: pixels come row by row";
    default:
      return "turn the camera, or its picture";
  }
}

/// Photographs that follow their patterns in another order. A mirrored picture of a scene that is symmetric
/// itself is no fault: its T is symmetric too.
Found find_other_order(const LightSeries& series, const LightMatch& match) {
  if (!match.elsewhere()) return std::nullopt;
  const LightOrder& order = match.order();
  const ExchangedLight exchanged = exchanged_light(series);
  const bool turned_only = order.late == 0 && !order.inverted;
  if (turned_only && !exchanged.significant) return std::nullopt;
  LightFault fault{fmt::format("the photographs do not follow their patterns: the correlation is {}, and {} ",
                               times(match.as_shown()), times(match.best())),
                   {}};
  if (order.late != 0)
    fault.measured +=
        fmt::format("with the pattern {} {}", std::abs(order.late), order.late > 0 ? "before" : "after");
  else if (order.inverted)
    fault.measured += "with black and white exchanged";
  else
    fault.measured +=
        fmt::format("if the picture is {}; light between pixels differs from the light back by {}",
                    name_turn(order.turn), percent_of_light(exchanged.difference));
  fault.causes.push_back(cause_of_order(order));
  if (!turned_only && order.turn != Turn::none) fault.causes.push_back(cause_of_turn(order.turn));
  return fault;
}

/// One photograph of some other pattern.
Found find_exchanged(const LightSeries& series, const LightMatch& match) {
  const auto found = match.exchanged();
  if (!found) return std::nullopt;
  const auto [k, x] = *found;
  const bool before = x < k;
  return LightFault{
      fmt::format("photograph {} ({}) shows pattern {} ({}): their correlation is {}", k + 1, series[k].name,
                  x + 1, series[x].name, times(match.correlation(k, x, Turn::none))),
      {before ? late_frame() : LightCause{"a frame was lost", late_frame().next}}};
}

/// Light that does not depend on the pattern at all.
Found find_constant(const LightSums& sums, const LightMatch& match) {
  constexpr double kAlike = 0.25;  // half of the pixels lit give half of the light
  constexpr double kEqual = 0.1;   // times the noise
  if (match.follows() || sums.spread() > kAlike) return std::nullopt;
  return LightFault{
      fmt::format(
          "the photographs do not depend on the patterns: {} of the pixels lit give {} of the light of all, "
          "and two halves differ by {:.1f} times their noise",
          percent_of_light(sums.share_lit(LightSeries::kSparse)),
          percent_of_light(sums.share(LightSeries::kSparse)), sums.changed()),
      causes_of_constant_light(sums.changed() < kEqual)};
}

}  // namespace

std::vector<LightCause> causes_of_other_pixels() {
  return {
      {"the camera's pixels come in another order than the projector's (a wrong length of rows, a picture "
       "that is cut or scaled)",
       "check that pixel (row, column) of a photograph sees pixel (row, column) of the pattern"},
      {"a camera that is not aligned with the projector",
       "align them (symrig align), or register the camera (symrig calibrate)"},
      {"photographs of other patterns", late_frame().next}};
}

LightCause cause_of_turn(Turn turn) {
  return {"the camera's picture is " + name_turn(turn), undo(turn)};
}

LightCause cause_of_order(const LightOrder& order) {
  if (order.late > 0)
    return {fmt::format("the camera is {} photograph{} late: each shows the pattern before it", order.late,
                        order.late == 1 ? "" : "s"),
            "empty the camera's queue before each pattern, and wait until the pattern is shown"};
  if (order.late < 0)
    return {fmt::format("{} photograph{} lost: each shows a pattern after its own", -order.late,
                        order.late == -1 ? " was" : "s were"),
            "tie each photograph to its trigger"};
  if (order.inverted)
    return {"the projector shows black for white",
            "switch off the inversion of the projector or of the picture"};
  return cause_of_turn(order.turn);
}

LightFault no_light(std::size_t photographs, bool below_black) {
  if (below_black)
    return {fmt::format("{} photographs, each of one lit pixel, are darker than black", photographs),
            {cause_of_order({0, true, Turn::none}),
             {"a black level that is subtracted, and too high", "measure the black level again"}}};
  return {fmt::format("no light: none of {} photographs holds any above its noise", photographs),
          causes_of_darkness()};
}

Result<void> check_light(const LightSeries& series, const LookAside& look) {
  if (series.pixels() < kFewestPixels) return {};
  if (const Found dark = find_dark(series)) return dark->error();
  if (series.size() < LightSeries::kCount) return {};
  const LightMatch match(series);
  if (const Found order = find_other_order(series, match)) return order->error();
  if (const Found exchanged = find_exchanged(series, match)) return exchanged->error();
  const LightSums sums(series);
  const Found constant = find_constant(sums, match);
  if (constant && sums.changed() == 0) return constant->error();
  // One stuck pixel can be most of the light.
  if (const Found pixels = find_wrong_pixels(series)) return pixels->error();
  // On few pixels, automatic exposure looks like light that does not depend on the pattern.
  if (constant && !find_automatic(series)) return constant->error();
  if (const Found shift = find_shift(series, match)) return shift->error();
  if (const Found missing = find_missing_light(series, match)) return missing->error();
  if (const Found glow = find_afterglow(series, match)) return glow->error();
  SYMRIG_TRY(const Found dead, find_dead_lines(series, look));
  if (dead) return dead->error();
  SYMRIG_TRY(const Found brightness, find_wrong_brightness(series, match, look));
  if (brightness) return brightness->error();
  SYMRIG_TRY(const Found other, find_other_pixels(series, match, look));
  if (other) return other->error();
  return {};
}

}  // namespace symrig::acquisition
