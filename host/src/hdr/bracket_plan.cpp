// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/bracket_plan.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <fmt/format.h>

namespace symrig {
namespace {

// Keeps the exponent and the first two bits of the mantissa of a positive float.
constexpr unsigned kShift = 21;
constexpr std::uint32_t kFirst = std::bit_cast<std::uint32_t>(0x1p-60F) >> kShift;

}  // namespace

std::size_t LightHistogram::bin_of(float radiance) {
  if (!(radiance >= 0x1p-60F)) return 0;
  return std::min<std::size_t>((std::bit_cast<std::uint32_t>(radiance) >> kShift) - kFirst + 1, kBins - 1);
}

double LightHistogram::upper_end(std::size_t bin) {
  if (bin == 0) return 0;
  return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bin + kFirst) << kShift));
}

void LightHistogram::add(const LightHistogram& other) {
  for (std::size_t bin = 0; bin < kBins; ++bin) counts_[bin] += other.counts_[bin];
}

double LightHistogram::pixels() const {
  double sum = 0;
  for (const double n : counts_) sum += n;
  return sum;
}

double LightHistogram::mean_square() const {
  double sum = 0, pixels = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const double middle = 0.92 * upper_end(bin);  // geometric middle of a quarter of an octave
    sum += counts_[bin] * middle * middle;
    pixels += counts_[bin];
  }
  return pixels > 0 ? sum / pixels : 0;
}

std::vector<ExpectedLight> LightHistogram::lights() const {
  std::vector<ExpectedLight> lights;
  for (std::size_t bin = 0; bin < kBins; ++bin)
    if (counts_[bin] > 0) lights.push_back({upper_end(bin), counts_[bin]});
  return lights;
}

namespace {

constexpr double kWhole = 1e-3;  // largest difference from whole periods, as a share of a period

double milliseconds(Nanoseconds t) {
  return 1e3 * seconds(t);
}

}  // namespace

Result<BeatForecast> forecast_beat(Nanoseconds exposure, Nanoseconds period, double duty) {
  if (exposure <= Nanoseconds{0} || period <= Nanoseconds{0} || !(duty > 0 && duty <= 1))
    return Error{
        ErrorCode::bad_argument,
        fmt::format("cannot compare an exposure of {:.4g} ms with a period of {:.4g} ms at a duty of {}",
                    milliseconds(exposure), milliseconds(period), duty),
        "give times above 0 and a duty from 0 to 1"};
  BeatForecast beat;
  beat.periods = seconds(exposure) / seconds(period);
  const double nearest = std::max(1.0, std::round(beat.periods));
  beat.nearest_whole = static_cast<std::int64_t>(nearest) * period;
  const double f = beat.periods - std::floor(beat.periods);
  const double low = std::max(0.0, f + duty - 1), high = std::min(f, duty);
  const bool whole = std::abs(beat.periods - nearest) <= kWhole;
  beat.spread = whole ? 0 : (high - low) / (beat.periods * duty);
  return beat;
}

std::string BeatForecast::to_string(Nanoseconds exposure, Nanoseconds period) const {
  return fmt::format(
      "exposure {:.4g} ms is {:.3g} periods of {:.4g} ms: its light may vary by {:.2g} %; {:.4g} ms is whole",
      milliseconds(exposure), periods, milliseconds(period), 100 * spread, milliseconds(nearest_whole));
}

namespace {

constexpr double kStep = std::numbers::sqrt2;  // ratio of neighbouring candidate exposures
constexpr int kSearched = 3;                   // largest number of frames that are searched exhaustively
constexpr double kFree = 0.1;                  // exposures are made longer for up to this share of the cost

/// Candidate exposures [s], shortest first.
std::vector<double> candidates(const ExposureRules& rules, const Expectation& expected) {
  const double period = seconds(rules.whole_periods);
  const double first = period > 0 ? std::max(1.0, std::ceil(seconds(rules.min_exposure) / period - 1e-9)) : 0;
  const double shortest = period > 0 ? first * period : seconds(rules.min_exposure);
  const double in_time =
      std::max(shortest, expected.most_seconds - seconds(rules.each_frame + rules.each_wait));
  const double longest =
      std::min({seconds(rules.max_exposure), expected.longest_seconds, in_time}) * (1 + 1e-9);
  std::vector<double> all;
  if (period > 0) {
    double n = first;
    while (n * period <= longest) {
      all.push_back(n * period);
      n = std::max(n + 1, std::floor(n * kStep));
    }
    return all;
  }
  double t = shortest;
  while (t <= longest) {
    all.push_back(t);
    t *= kStep;
  }
  return all;
}

/// One radiance of one part, in electrons.
struct Level {
  double rate;    // [e⁻/s], black included
  double unseen;  // its error if every frame saturates [e⁻²/s²]
  double weight;  // pixels over (pixels · noise) of its part [s²/e⁻²]
  std::size_t part;
};

class Planner {
 public:
  Planner(const Expectation& expected, const LightPath& path, const NoiseModel& noise,
          const ExposureRules& rules)
      : noise_(noise),
        rules_(rules),
        parts_(expected.parts.size()),
        budget_(expected.longest_seconds),
        most_(expected.most_seconds) {
    for (std::size_t p = 0; p < parts_; ++p) {
      double pixels = 0;
      for (const ExpectedLight& light : expected.parts[p].lights) pixels += light.pixels;
      const double allowed = expected.parts[p].noise / (path.scale * path.scale);
      for (const ExpectedLight& light : expected.parts[p].lights) {
        const double rate = std::max(0.0, light.radiance) / path.scale;
        levels_.push_back(
            {rate + path.black / path.scale, rate * rate, light.pixels / (pixels * allowed), p});
      }
    }
    times_ = candidates(rules, expected);
    for (const double t : times_)
      for (const Level& level : levels_)
        information_.push_back(exposure_information(noise, level.rate, t, rules.headroom));
  }

  bool possible() const { return !times_.empty() && !levels_.empty(); }

  BracketPlan run() {
    std::vector<double> known(levels_.size());
    search(known, 0, 0, kSearched);
    if (!best_) return add_one_by_one();
    std::vector<double> times;
    for (const std::size_t e : *best_) times.push_back(times_[e]);
    if (rules_.whole_periods.count() == 0) fill_wells(times);
    return plan_of(times);
  }

 private:
  double cost(std::size_t e) const { return times_[e] + seconds(rules_.each_frame); }

  /// Whether one more frame than those chosen fits, if all of them cost so much. One always does.
  bool in_time(double price) const {
    const auto frames = static_cast<double>(chosen_.size() + 1);
    return chosen_.empty() || price + frames * seconds(rules_.each_wait) <= most_;
  }

  /// Mean square noise / wanted noise of the worst part.
  double misses(const std::vector<double>& known) const {
    std::vector<double> sums(parts_);
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      const double variance = known[l] > 0 ? 1 / known[l] : 4 * levels_[l].unseen;
      sums[levels_[l].part] += levels_[l].weight * std::min(variance, kUnseen);
    }
    return *std::max_element(sums.begin(), sums.end());
  }

  void add(std::size_t e, std::vector<double>& known) const {
    for (std::size_t l = 0; l < levels_.size(); ++l) known[l] += information_[e * levels_.size() + l];
  }

  /// Tries all brackets of up to `left` more frames, none shorter than candidate `from`.
  void search(const std::vector<double>& known, double spent, std::size_t from, int left) {
    for (std::size_t e = from; e < times_.size(); ++e) {
      const double price = spent + cost(e);
      if (price >= best_cost_ || exposure_sum(e) > budget_ || !in_time(price)) break;
      std::vector<double> more = known;
      add(e, more);
      chosen_.push_back(e);
      if (misses(more) <= 1) {
        best_ = chosen_;
        best_cost_ = price;
      } else if (left > 1) {
        search(more, price, e, left - 1);
      }
      chosen_.pop_back();
    }
  }
  double exposure_sum(std::size_t next) const {
    double sum = times_[next];
    for (const std::size_t e : chosen_) sum += times_[e];
    return sum;
  }

  /// Adds the frame that reduces the logarithm of misses() most for its cost, until the wanted noise is met
  /// or no time is left.
  BracketPlan add_one_by_one() {
    std::vector<double> known(levels_.size()), times;
    double left = budget_, left_of_all = most_;
    double now = std::numeric_limits<double>::infinity();
    while (now > 1 && std::ssize(times) < rules_.most_frames) {
      std::optional<std::size_t> choice;
      double gain = 0, after = now;
      for (std::size_t e = 0; e < times_.size() && times_[e] <= left; ++e) {
        if (!times.empty() && cost(e) + seconds(rules_.each_wait) > left_of_all) break;
        std::vector<double> more = known;
        add(e, more);
        const double missed = misses(more);
        const double per_cost =
            (std::isinf(now) ? -std::log(missed) + 100 : std::log(now / missed)) / cost(e);
        if (missed < now && per_cost > gain) {
          choice = e;
          gain = per_cost;
          after = missed;
        }
      }
      if (!choice) break;
      add(*choice, known);
      times.push_back(times_[*choice]);
      left -= times_[*choice];
      left_of_all -= cost(*choice) + seconds(rules_.each_wait);
      now = after;
    }
    if (times.empty()) times.push_back(times_.front());
    return plan_of(times);
  }

  double misses_of(const std::vector<double>& times) const {
    std::vector<double> known(levels_.size());
    for (const double t : times)
      for (std::size_t l = 0; l < levels_.size(); ++l)
        known[l] += exposure_information(noise_, levels_[l].rate, t, rules_.headroom);
    return misses(known);
  }

  /// Makes exposures longer if this costs almost nothing: the shortest first, while it lowers the noise.
  void fill_wells(std::vector<double>& times) const {
    double spare = 0;
    for (const double t : times) spare += kFree * (t + seconds(rules_.each_frame));
    const double step = std::sqrt(kStep);
    for (double& t : times) {
      double missed = misses_of(times);
      while (t * step <= times_.back() && (step - 1) * t <= spare) {
        const double before = t;
        t *= step;
        const double now = misses_of(times);
        if (now >= missed) {
          t = before;
          break;
        }
        missed = now;
        spare -= t - before;
      }
    }
  }

  /// Whole microseconds are whole ticks of a board: the exposure then does not depend on where in a run it
  /// begins.
  Nanoseconds whole_microseconds(double t) const {
    const Nanoseconds exact{std::llround(1e9 * t)}, whole = exact - exact % std::chrono::microseconds{1};
    return rules_.whole_periods.count() > 0 || whole < rules_.min_exposure ? exact : whole;
  }

  BracketPlan plan_of(std::vector<double> times) const {
    std::sort(times.begin(), times.end());
    BracketPlan plan;
    for (double& t : times) {
      plan.exposures.push_back(whole_microseconds(t));
      t = seconds(plan.exposures.back());
    }
    plan.noise = misses_of(times);
    plan.held_short = std::isfinite(most_) && plan.noise > 1;
    return plan;
  }

  static constexpr double kUnseen = 1e300;

  const NoiseModel& noise_;
  const ExposureRules& rules_;
  std::size_t parts_;
  double budget_;  // longest sum of exposures [s]
  double most_;    // longest sum of exposures and readouts [s]
  std::vector<Level> levels_;
  std::vector<double> times_;
  std::vector<double> information_;  // [candidate][level]
  std::vector<std::size_t> chosen_;
  std::optional<std::vector<std::size_t>> best_;
  double best_cost_ = std::numeric_limits<double>::infinity();
};

Result<void> check(const Expectation& expected, const LightPath& path, const NoiseModel& noise) {
  const auto bad = [](std::string what, std::string hint) -> Result<void> {
    return Error{ErrorCode::bad_argument, std::move(what), std::move(hint)};
  };
  if (!noise.valid()) return bad("the noise model is not valid: " + noise.to_string(), "measure the sensor");
  if (!(path.scale > 0) || !(path.black >= 0))
    return bad("the light path has no valid scale or black level",
               "give a scale above 0 and a black level of at least 0");
  for (const ExpectedPart& part : expected.parts) {
    if (part.lights.empty() || !(part.noise > 0))
      return bad("a part of a photograph has no pixels, or no wanted noise", "give both, above 0");
    for (const ExpectedLight& light : part.lights)
      if (!std::isfinite(light.radiance) || !(light.pixels > 0))
        return bad(fmt::format("an expectation of {} pixels with radiance {} is not valid", light.pixels,
                               light.radiance),
                   "give finite numbers");
  }
  if (expected.parts.empty())
    return bad("the expectation of the photograph has no parts", "give at least one");
  return {};
}

/// Of whole_most_seconds().
constexpr double kSteps = 8;                    // an octave
constexpr int kShortest = -80, kLongest = 143;  // 1 ms, 67 hours: no photograph takes less, or more

int steps_of(double most_seconds) {
  if (!(most_seconds > std::exp2(kShortest / kSteps))) return kShortest;
  return static_cast<int>(std::min<double>(kLongest, std::floor(kSteps * std::log2(most_seconds) + 1e-6)));
}

}  // namespace

double whole_most_seconds(double seconds) {
  return std::exp2(steps_of(seconds) / kSteps);
}

std::int32_t Expectation::budget_note(bool held_short) const {
  if (!held_short) return coarser_steps;
  // Both in one number; a step of coarseness is far from one of time.
  constexpr std::int32_t kNotes = kLastNote - kHeldShort + 1, kFar = 37;
  static_assert(kLongest - kShortest < kNotes);
  return kHeldShort + (steps_of(most_seconds) - kShortest + kFar * coarser_steps) % kNotes;
}

double exposure_information(const NoiseModel& noise, double rate, double seconds, double headroom) {
  const double electrons = rate * seconds;
  if (headroom * electrons * noise.gain() > noise.saturation_code() - noise.pedestal()) return 0;
  return seconds * seconds / noise.variance(electrons);
}

Result<BracketPlan> plan_bracket(const Expectation& expected, const LightPath& path, const NoiseModel& noise,
                                 const ExposureRules& rules) {
  SYMRIG_CHECK(check(expected, path, noise));
  Planner planner(expected, path, noise, rules);
  if (planner.possible()) return planner.run();
  return Error{
      ErrorCode::bad_argument,
      fmt::format("no legal exposure between {:.3g} ms and {:.3g} ms", 1e3 * seconds(rules.min_exposure),
                  1e3 * std::min(seconds(rules.max_exposure), expected.longest_seconds)),
      "allow the photograph more time"};
}

}  // namespace symrig
