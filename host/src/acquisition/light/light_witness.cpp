// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_witness.hpp"

#include "symrig/hdr/bracket_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <optional>

#include <fmt/format.h>

namespace symrig::acquisition {
namespace {

/// Direct light that a photograph lacks, and that it has.
constexpr double kLacksLight = 0.5, kHasLight = 0.75;

double total(std::span<const float> values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Standard deviation of the sum of the pixels, as they scatter: a rig may state less noise than it has.
double scatter_of_total(std::span<const float> values) {
  const double mean = total(values) / static_cast<double>(std::max<std::size_t>(values.size(), 1));
  double squares = 0;
  for (const float v : values) squares += std::pow(static_cast<double>(v) - mean, 2);
  return std::sqrt(squares);
}

/// The correlation of two pictures, one of them moved.
double correlation_of(Grid grid, std::span<const float> a, std::span<const float> b, int row, int col) {
  double n = 0, x = 0, y = 0, xy = 0, xx = 0, yy = 0;
  for (int r = std::max(0, -row); r < grid.rows - std::max(0, row); ++r)
    for (int c = std::max(0, -col); c < grid.cols - std::max(0, col); ++c) {
      const auto cols = static_cast<std::size_t>(grid.cols);
      const double u = a[static_cast<std::size_t>(r) * cols + static_cast<std::size_t>(c)],
                   v = b[static_cast<std::size_t>(r + row) * cols + static_cast<std::size_t>(c + col)];
      n += 1, x += u, y += v, xy += u * v, xx += u * u, yy += v * v;
    }
  const double spread = (xx - x * x / n) * (yy - y * y / n);
  return spread > 0 ? (xy - x * y / n) / std::sqrt(spread) : 0;
}

struct PictureMotion {
  int row = 0, col = 0;
  double in_place = 0, there = 0;
};
/// Where the second picture lies on the first one.
PictureMotion motion_of(Grid grid, std::span<const float> first, std::span<const float> second) {
  constexpr int kReach = 8;
  PictureMotion best;
  best.in_place = best.there = correlation_of(grid, second, first, 0, 0);
  const int rows = std::min(kReach, grid.rows / 4), cols = std::min(kReach, grid.cols / 4);
  for (int row = -rows; row <= rows; ++row)
    for (int col = -cols; col <= cols; ++col) {
      const double there = correlation_of(grid, second, first, row, col);
      if (there > best.there) best = {row, col, best.in_place, there};
    }
  return best;
}

}  // namespace

LightWitness::Picture LightWitness::picture_of(const Radiance& photograph) {
  const auto pixels = static_cast<std::size_t>(photograph.mean.grid().size());
  Picture picture{std::vector<float>(pixels), std::vector<float>(pixels),
                  std::vector<std::uint8_t>(pixels, 1)};
  for (int channel = 0; channel < photograph.mean.channels(); ++channel) {
    const auto mean = photograph.mean.plane(channel), variance = photograph.variance.plane(channel);
    const auto valid = photograph.valid.plane(channel);
    for (std::size_t at = 0; at < pixels; ++at) {
      if (valid[at] == 0) {
        picture.valid[at] = 0;
        continue;
      }
      picture.light[at] += mean[at];
      picture.variance[at] += variance[at];
    }
  }
  return picture;
}

Result<std::vector<Radiance>> LightWitness::seen(std::span<const Pattern> patterns,
                                                 Result<std::vector<Radiance>> photographs) {
  if (!photographs || photographs->size() != patterns.size()) return photographs;
  for (std::size_t k = 0; k < patterns.size(); ++k)
    if ((*photographs)[k].mean.grid() == grid()) SYMRIG_CHECK(see(patterns[k], (*photographs)[k]));
  return photographs;
}

/// From the second and the third photograph, if their patterns are complements.
void LightWitness::learn_direct(const Pattern& pattern, const Picture& picture) {
  const std::span<const float> first = before_pattern_.values(), second = pattern.values();
  double sum = 0, squares = 0;
  std::vector<float> direct(picture.light.size());
  for (std::size_t at = 0; at < direct.size(); ++at) {
    if (first[at] + second[at] != 1) return;
    direct[at] = (first[at] - second[at]) * (before_.light[at] - picture.light[at]);
    sum += static_cast<double>(direct[at]),
        squares += static_cast<double>(direct[at]) * static_cast<double>(direct[at]);
  }
  if (!(squares > 0) || !(sum > 0)) return;
  direct_ = std::move(direct);
  random_ = std::max(0.0, 1 - sum * sum / (squares * static_cast<double>(direct_.size())));
}

double LightWitness::answer(const Picture& picture, const Pattern& lit, const Pattern* dark) const {
  constexpr double kUnknown = -1;
  if (direct_.empty()) return kUnknown;
  double light = 0, wanted = 0, squares = 0;
  for (std::size_t at = 0; at < direct_.size(); ++at) {
    if (lit.values()[at] != 1 || (dark != nullptr && dark->values()[at] > 0)) continue;
    const double direct = direct_[at];
    light += static_cast<double>(picture.light[at]);
    wanted += direct, squares += direct * direct;
  }
  const bool known = wanted > 0 && wanted > kLightSigmas * std::sqrt(2 * random_ * squares);
  return known ? std::max(0.0, light / wanted) : kUnknown;
}

Result<void> LightWitness::see(const Pattern& pattern, const Radiance& photograph) {
  Picture picture = picture_of(photograph);
  if (count_ == 0) flood_ = picture;
  if (count_ == 1) half_ = picture, half_pattern_ = pattern;
  if (count_ == 2) learn_direct(pattern, picture);
  const bool judged =
      count_ >= static_cast<std::int64_t>(LightSeries::kCount) && look_ && asked_in_vain_ < kMostInVain;
  ++count_;
  if (judged) {
    const double sigma = std::sqrt(total(picture.variance));
    const bool repeats = pattern != before_pattern_ && sigma > 0 &&
                         total(picture.light) > kLightSigmas * sigma && picture.light == before_.light;
    const double own = answer(picture, pattern, &before_pattern_), all = answer(picture, pattern, nullptr);
    if (repeats || (own >= 0 && own < kLacksLight) || (all >= 0 && all < kLacksLight))
      SYMRIG_CHECK(prove({count_, before_pattern_, pattern, picture}, repeats));
    if (own < 0 && all < 0) remember(pattern, picture);
    const bool all_lit = std::ranges::all_of(pattern.values(), [](float v) { return v == 1; });
    if (all_lit) SYMRIG_CHECK(check_place(flood_, picture, "the flood-lit photograph"));
  }
  before_ = std::move(picture);
  before_pattern_ = pattern;
  return {};
}

void LightWitness::remember(const Pattern& pattern, const Picture& picture) {
  constexpr std::size_t kMostPixels = 4 << 20;  // 64 MB
  if ((unjudged_.size() + 1) * picture.light.size() > kMostPixels) return;
  unjudged_.push_back({count_, before_pattern_, pattern, picture});
}

double LightWitness::squares_apart(const Picture& a, const Picture& b, double factor) {
  double squares = 0;
  for (std::size_t at = 0; at < a.light.size(); ++at)
    if (a.valid[at] != 0 && b.valid[at] != 0)
      squares += std::pow(static_cast<double>(a.light[at]) - factor * static_cast<double>(b.light[at]), 2);
  return squares;
}

double LightWitness::factor_of(const Picture& a, const Picture& b) {
  double both = 0, square = 0;
  for (std::size_t at = 0; at < a.light.size(); ++at) {
    if (a.valid[at] == 0 || b.valid[at] == 0) continue;
    both += static_cast<double>(a.light[at]) * static_cast<double>(b.light[at]);
    square += static_cast<double>(b.light[at]) * static_cast<double>(b.light[at]);
  }
  return square > 0 ? both / square : 0;
}

/// Far more than the stated noise. The sum of squares of independent errors of variances v scatters by √(2 Σ
/// v²).
bool LightWitness::differs(const Picture& first, const Picture& again) {
  constexpr double kShare = 0.1;
  double light = 0, noise = 0, scatter = 0;
  for (std::size_t at = 0; at < first.light.size(); ++at) {
    if (first.valid[at] == 0 || again.valid[at] == 0) continue;
    const double v = static_cast<double>(first.variance[at]) + static_cast<double>(again.variance[at]);
    light += static_cast<double>(again.light[at]) * static_cast<double>(again.light[at]);
    noise += v, scatter += 2 * v * v;
  }
  return squares_apart(first, again) > noise + kLightSigmas * std::sqrt(scatter) + kShare * light;
}

/// As well known as the photograph was the first time. A rig that is told nothing exposes until dark pixels
/// are known too.
Expectation LightWitness::expected_again(const Picture& picture) const {
  LightHistogram light;
  double variance = 0;
  for (std::size_t at = 0; at < picture.light.size(); ++at) {
    if (picture.valid[at] == 0) continue;
    light.add(std::max(picture.light[at] / static_cast<float>(channels()), 0.F));
    variance += static_cast<double>(picture.variance[at]) / channels();
  }
  Expectation expected;
  if (variance > 0) expected.parts = {{light.lights(), variance / light.pixels()}};
  return expected;
}

/// From the last to the first: a camera that has been late since some photograph would show in each what it
/// showed before, if it were asked in the same order.
Result<void> LightWitness::look_at_unjudged() {
  constexpr std::size_t kTogether = 16;
  if (!look_) return {};
  for (std::size_t left = unjudged_.size(); left > 0;) {
    const std::size_t count = std::min(kTogether, left);
    std::vector<Pattern> patterns;
    std::vector<Expectation> expected;
    for (std::size_t k = 1; k <= count; ++k) {
      patterns.push_back(unjudged_[left - k].pattern);
      expected.push_back(expected_again(unjudged_[left - k].picture));
    }
    SYMRIG_TRY(const std::vector<Radiance> taken, look_(patterns, expected));
    if (taken.size() != count || taken.front().mean.grid() != grid()) return {};
    for (std::size_t k = 1; k <= count; ++k) {
      const Seen& seen = unjudged_[left - k];
      if (!differs(seen.picture, picture_of(taken[k - 1]))) continue;
      SYMRIG_CHECK(prove(seen, false));
      if (asked_in_vain_ >= kMostInVain) return {};
    }
    left -= count;
  }
  return {};
}

/// Takes the photograph again, four times: a camera that is one late shows the pattern from the second on.
/// The last three tell the noise, whatever is stated. If they came out better exposed than the photograph,
/// its noise is more than theirs, as the statements differ.
Result<void> LightWitness::prove(const Seen& seen, bool repeats) {
  constexpr double kNoise = 4, kExplains = 0.25;
  const std::vector<Pattern> patterns{seen.before,  seen.before,  seen.pattern,
                                      seen.pattern, seen.pattern, seen.pattern};
  static_assert(kEachProof == 6);
  const std::vector<Expectation> expected(patterns.size(), expected_again(seen.picture));
  SYMRIG_TRY(const std::vector<Radiance> taken, look_(patterns, expected));
  if (taken.size() != patterns.size() || taken.front().mean.grid() != grid()) return {};
  const Picture shown_before = picture_of(taken[1]), again = picture_of(taken[3]),
                second = picture_of(taken[4]), third = picture_of(taken[5]);
  const double away = squares_apart(seen.picture, again);
  const double of_first = total(seen.picture.variance), of_again = total(again.variance);
  const double more = of_again > 0 ? std::max(1.0, (of_first + of_again) / (2 * of_again)) : 1;
  const double noise = more * std::max({squares_apart(second, again), squares_apart(third, again),
                                        squares_apart(third, second)});
  const double shows = answer(again, seen.pattern, nullptr);
  if (!differs(seen.picture, again) || away < kNoise * noise || (shows >= 0 && shows < kHasLight)) {
    ++asked_in_vain_;
    return {};
  }
  const bool before = repeats || squares_apart(seen.picture, shown_before) < kExplains * away;
  const double factor = factor_of(seen.picture, again);
  const bool less = !before && factor < 1 && squares_apart(seen.picture, again, factor) < kExplains * away;
  LightFault fault{
      fmt::format("photograph {} {}; taken again, it shows its own pattern", seen.number,
                  repeats  ? std::string("is the same as the one before, noise included")
                  : before ? std::string("shows the pattern of the one before")
                  : less   ? fmt::format("has {} of its light", percent_of_light(std::max(factor, 0.0)))
                           : std::string("shows another pattern")),
      {}};
  if (less)
    fault.causes = causes_of_missing_light();
  else
    fault.causes.push_back(late_frame());
  if (!before && !less) fault.causes.push_back({"a frame was lost", late_frame().next});
  return fault.error();
}

Result<void> LightWitness::check_place(const Picture& first, const Picture& again, const char* what) const {
  constexpr double kExplains = 0.5;
  const PictureMotion motion = motion_of(grid(), first.light, again.light);
  const bool moved =
      (motion.row != 0 || motion.col != 0) && 1 - motion.there < kExplains * (1 - motion.in_place);
  if (!moved) return {};
  return LightFault{
      fmt::format(
          "{}, taken again, lies {} rows and {} columns away: the correlation is {:.2f} there, and {:.2f} in "
          "place",
          what, std::abs(motion.row), std::abs(motion.col), motion.there, motion.in_place),
      {{"the camera, the projector or the scene has moved during the capture",
        "fasten all, and capture again"}}}
      .error();
}

/// The rms difference of two pictures, over the rms of the second.
double LightWitness::apart(const Picture& a, const Picture& b) {
  double squares = 0, all = 0;
  for (std::size_t at = 0; at < a.light.size(); ++at) {
    const double light = b.light[at], off = static_cast<double>(a.light[at]) - light;
    squares += off * off, all += light * light;
  }
  return all > 0 ? std::sqrt(squares / all) : HUGE_VAL;
}

Result<void> LightWitness::look_again() {
  constexpr double kDiffers = 0.03, kLeast = 5e-4, kSame = 0.2;
  if (!look_ || count_ < 2 || half_.light.empty()) return {};
  const Pattern white(grid(), 1, 1.0F);
  const std::vector<Pattern> patterns{half_pattern_, white, Pattern(grid()), white, white};
  SYMRIG_TRY(const std::vector<Radiance> taken, look_(patterns, {}));
  if (taken.size() != patterns.size() || taken.front().mean.grid() != grid()) return {};
  const Picture half = picture_of(taken[0]), black = picture_of(taken[2]);
  if (apart(picture_of(taken[1]), half_) < kSame && apart(black, flood_) < kSame)
    return LightFault{
        "of the first patterns, shown again, each photograph shows the pattern before it",
        {{"a frame came late or twice during the capture",
          "empty the camera's queue before each pattern, and tie each photograph to its trigger"}}}
        .error();
  SYMRIG_CHECK(check_place(half_, half, "the photograph of a random half"));
  const double dark = total(black.light);
  const double noise = std::max(std::sqrt(total(black.variance)), scatter_of_total(black.light));
  if (std::abs(dark) > std::max(kLightSigmas * noise, kLeast * total(flood_.light)))
    return LightFault{
        fmt::format("with the projector black, the camera sees {:.2g} % of the light that it sees with all "
                    "pixels lit",
                    100 * dark / total(flood_.light)),
        {{dark > 0 ? "light of other sources, or a black level that is not subtracted"
                   : "a black level that is subtracted, and too high",
          "cover the rig, and subtract a photograph of the dark projector"}}}
        .error();
  double least = total(flood_.light), most = least;
  for (const std::size_t k : {1U, 3U, 4U}) {
    least = std::min(least, total(picture_of(taken[k]).light));
    most = std::max(most, total(picture_of(taken[k]).light));
  }
  if (most - least > std::max(kDiffers * most, kLightSigmas * std::sqrt(total(flood_.variance))))
    return LightFault{
        fmt::format("photographs of all pixels lit, one at the beginning and three now, differ by {}",
                    percent_of_light(1 - least / most)),
        {{"a lamp that flickers or drifts", "use a steady lamp, and let it warm up"},
         {"automatic exposure of the camera", "fix exposure and gain"}}}
        .error();
  return {};
}

}  // namespace symrig::acquisition
