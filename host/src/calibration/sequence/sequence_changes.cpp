// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence/photograph_noise.hpp"
#include "calibration/sequence/sequence_causes.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include <Eigen/Dense>
#include <fmt/format.h>

namespace symrig::calibration {
namespace {

/// Least squares with few unknowns over many samples.
class Line {
 public:
  void add(double x1, double x2, double y) {
    a_ += Eigen::Vector2d(x1, x2) * Eigen::RowVector2d(x1, x2);
    b_ += y * Eigen::Vector2d(x1, x2);
    squares_ += y * y;
    count_ += 1;
  }
  Eigen::Vector2d solve() const {
    constexpr double kRidge = 1e-4;
    return (a_ + kRidge * a_.trace() * Eigen::Matrix2d::Identity()).ldlt().solve(b_);
  }
  double left(const Eigen::Vector2d& x) const {
    return std::max(squares_ - 2 * b_.dot(x) + x.dot(a_ * x), 0.0);
  }
  double left() const { return left(solve()); }
  double squares() const { return squares_; }
  double count() const { return count_; }

 private:
  Eigen::Matrix2d a_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b_ = Eigen::Vector2d::Zero();
  double squares_ = 0, count_ = 0;
};

/// One cause with what it explains.
struct Explained {
  SequenceCause cause;
  double share = 0, effect = 0;
  double rank = 0;  ///< share, less for a model of many numbers
  bool particular = false;
};

class Changes {
 public:
  Changes(const CodePhotographs& photographs, const ClearPixels& clear, std::optional<int> held_out)
      : photographs_(photographs), clear_(clear), pairs_(photographs.code.pairs()), held_out_(held_out) {
    for (int pair = 0; pair <= pairs_; ++pair)
      if (pair != held_out) used_.push_back(pair);
    for (const std::size_t i : clear.at) {
      std::vector<float> sums;
      for (const int pair : used_) sums.push_back(sum(pair, i));
      usual_.push_back(median(sums));
    }
    for (const int pair : used_)
      for (std::size_t k = 0; k < usual_.size(); ++k) all_ += std::pow(off(pair, k), 2);
  }

  std::vector<Explained> causes() {
    find_gains();
    find_overlap();
    find_bands();
    find_offset();
    find_curve();
    std::ranges::stable_sort(found_, std::greater{}, &Explained::rank);
    return std::move(found_);
  }

 private:
  float of(int photograph, std::size_t pixel) const { return photographs_.image(photograph).values()[pixel]; }
  float sum(int pair, std::size_t pixel) const { return of(2 * pair, pixel) + of(2 * pair + 1, pixel); }
  double off(int pair, std::size_t k) const {
    return static_cast<double>(sum(pair, clear_.at[k]) - usual_[k]);
  }
  double pattern(int pair, std::size_t k) const { return static_cast<double>(of(2 * pair, clear_.at[k])); }
  double complement(int pair, std::size_t k) const {
    return static_cast<double>(of(2 * pair + 1, clear_.at[k]));
  }
  const std::string& name(int photograph) const { return photographs_.names[photograph]; }
  /// left: squares that the model does not explain.
  void add(double left, double effect, std::string what, std::string next, bool particular = false,
           double less = 0) {
    if (!(all_ > 0)) return;
    const double share = std::max(1 - left / all_, 0.0);
    what += fmt::format("; this explains {:.0f} % of the differences", 100 * share);
    found_.push_back({{std::move(what), std::move(next)}, share, effect, share - less, particular});
  }

  /// The factor by which each photograph is too bright: usual ≈ pattern / a + complement / b. Black has no
  /// light to tell its own.
  void find_gains() {
    double left = 0;
    for (const int pair : used_) {
      Line line;
      const bool ends = pair == pairs_;
      for (std::size_t k = 0; k < usual_.size(); ++k) {
        const auto y = static_cast<double>(usual_[k]);
        if (ends)
          line.add(pattern(pair, k), 0, y - complement(pair, k));
        else
          line.add(pattern(pair, k), complement(pair, k), y);
      }
      const Eigen::Vector2d x = line.solve();
      left += line.left(x);
      for (int k = 0; k < (ends ? 1 : 2); ++k)
        gains_.push_back(x[k] > 0 ? 1 / x[k] : 1), of_gain_.push_back(2 * pair + k);
    }
    const auto [low, high] = std::ranges::minmax(gains_);
    const double spread =
        quantile(std::vector<double>(gains_), 0.9) - quantile(std::vector<double>(gains_), 0.1);
    const double white = gains_.back(), middle = median(std::vector<double>(gains_));
    const double effect = std::max(spread / 2, std::abs(white / middle - 1));
    if (!is_of_light(low, high, middle)) return;
    const std::string range = fmt::format("by factors of {:.2f} to {:.2f}", low, high);
    if (is_automatic(middle))
      add(left, effect,
          fmt::format(
              "automatic exposure or gain: bright photographs are dimmed, {}; {} (white) is {:.2f} times as "
              "bright as the patterns tell",
              range, name(photographs_.code.white()), white / middle),
          "switch automatic exposure, gain and white balance off, and photograph the sequence again", true);
    else if (const auto at = step())
      add(left, effect,
          fmt::format("exposure or lamp has changed between {} and {}: brightness differs {}",
                      name(of_gain_[*at - 1]), name(of_gain_[*at]), range),
          "fix exposure, gain and lamp, and photograph the sequence again", true);
    else
      add(left, effect,
          fmt::format("the brightness changes from photograph to photograph, {}: {}", range,
                      std::abs(correlation([](std::size_t k) { return static_cast<double>(k); })) > kClearly
                          ? "the lamp warms up or cools down (drift)"
                          : "the lamp or the room light flickers, or the exposure is automatic"),
          "fix exposure and gain; expose for whole periods of the lamp; photograph the sequence again", true);
  }
  /// The gain from which on all are alike, as all before it are; none: they change more than once.
  std::optional<std::size_t> step() const {
    constexpr double kLeft = 0.1;  // of the squares about their mean; a steady drift leaves a quarter
    const auto squares = [this](std::size_t begin, std::size_t end) {
      double sum = 0, all = 0;
      for (std::size_t k = begin; k < end; ++k) sum += gains_[k], all += gains_[k] * gains_[k];
      return all - sum * sum / static_cast<double>(end - begin);
    };
    const double all = squares(0, gains_.size());
    for (std::size_t at = 1; at < gains_.size(); ++at)
      if (squares(0, at) + squares(at, gains_.size()) < kLeft * all) return at;
    return std::nullopt;
  }
  /// A lamp or an exposure changes several photographs, by moderate factors. One that shows another pattern
  /// has no factor.
  bool is_of_light(double low, double high, double middle) const {
    constexpr double kMost = 3, kChanged = 0.03;
    constexpr std::ptrdiff_t kFewest = 3;
    const auto changed =
        std::ranges::count_if(gains_, [&](double one) { return std::abs(one / middle - 1) > kChanged; });
    const bool white = gains_.back() < (1 - kChanged) * middle;
    return high < kMost * middle && middle < kMost * low && (changed >= kFewest || (changed == 1 && white));
  }
  static constexpr double kClearly = 0.85;
  /// Of the gains with something else that is known of each photograph.
  template <class Value>
  double correlation(const Value& value) const {
    double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    const auto n = static_cast<double>(gains_.size());
    for (std::size_t k = 0; k < gains_.size(); ++k) {
      const double at = value(k);
      x += at, y += gains_[k], xx += at * at, xy += at * gains_[k], yy += gains_[k] * gains_[k];
    }
    const double product = (xx - x * x / n) * (yy - y * y / n);
    return product > 0 ? (xy - x * y / n) / std::sqrt(product) : 0;
  }
  /// White has twice the light of a pattern; patterns differ too.
  bool is_automatic(double middle) const {
    constexpr double kDimmed = 0.9;
    const auto light = [this](std::size_t gain) {
      double sum = 0;
      for (const std::size_t i : clear_.at) sum += static_cast<double>(of(of_gain_[gain], i));
      return sum / gains_[gain];
    };
    return gains_.back() < kDimmed * middle && correlation(light) < -kClearly;
  }

  /// Exposures that begin before the pattern is shown, or end after it, by the rows of a rolling shutter:
  /// sum − usual = share · (last one before + first one − usual).
  void find_overlap() {
    constexpr int kBands = 16;
    for (const bool before : {true, false}) {
      std::vector<Line> lines(kBands);
      double other = 0;
      for (const int pair : used_) {
        const int first = before ? 2 * pair - 1 : 2 * pair + 1;
        const bool exists = first >= 0 && first + 1 <= photographs_.code.black() && first / 2 != held_out_ &&
                            (first + 1) / 2 != held_out_;
        for (std::size_t k = 0; k < usual_.size(); ++k) {
          const double y = off(pair, k);
          if (!exists) {
            other += y * y;
            continue;
          }
          const std::size_t i = clear_.at[k];
          const auto x = static_cast<double>(of(first, i) + of(first + 1, i) - usual_[k]);
          lines[band_of(i, kBands)].add(x, 0, y);
        }
      }
      double left = other, most = 0, least = 1;
      for (const Line& line : lines) {
        if (line.count() == 0) continue;
        const double share = line.solve()[0];
        left += line.left();
        most = std::max(most, share), least = std::min(least, share);
      }
      // The model holds for small shares; a share s of another pattern leaves 1 − s of its own.
      add(left, most,
          fmt::format(
              "the exposures overlap two patterns: photographs contain up to {:.0f} % of the pattern {}{}",
              100 * most, before ? "before" : "after",
              most - least > 0.5 * most ? ", more in some rows than in others (rolling shutter)" : ""),
          before ? "wait for the projector before each exposure"
                 : "end each exposure before the next pattern",
          true);
    }
  }
  std::size_t band_of(std::size_t pixel, int bands) const {
    const Grid grid = photographs_.camera();
    const std::size_t row = pixel / static_cast<std::size_t>(grid.cols);
    return row * static_cast<std::size_t>(bands) / static_cast<std::size_t>(grid.rows);
  }

  /// A rolling shutter reads its rows at different times: every row of a photograph has its own factor.
  void find_bands() {
    const Grid grid = photographs_.camera();
    const auto cols = static_cast<std::size_t>(grid.cols);
    double left = 0, whole = 0, most = 0;
    int worst = 0;
    for (const int pair : used_) {
      std::vector<Line> lines(grid.rows);
      Line all;
      for (std::size_t k = 0; k < usual_.size(); ++k) {
        const auto y = static_cast<double>(usual_[k]);
        lines[clear_.at[k] / cols].add(pattern(pair, k), complement(pair, k), y);
        all.add(pattern(pair, k), complement(pair, k), y);
      }
      whole += all.left();
      std::vector<double> factors;
      for (const Line& line : lines) {
        if (line.count() < 8) continue;
        // Two unknowns of a row explain that part of the noise.
        left += line.left() * line.count() / (line.count() - 2);
        const double factor = line.solve().sum() / 2;
        if (factor > 0 && pair < pairs_) factors.push_back(1 / factor);
      }
      if (factors.empty()) continue;
      const double spread = quantile(factors, 0.95) - quantile(factors, 0.05);
      if (spread > most) most = spread, worst = pair;
    }
    constexpr double kOfRows = 0.3;  // one factor for all rows is the simpler cause
    if (left > kOfRows * whole) return;
    constexpr double kManyNumbers = 0.25;  // two for each row of each pair
    add(left, most / 2,
        fmt::format(
            "bands of brightness run over the rows, by up to {:.0f} % in {} and {}: the exposure is no whole "
            "number of periods of the lamp (rolling shutter)",
            100 * most, name(2 * worst), name(2 * worst + 1)),
        "expose for whole periods of the projector's picture and of the mains, and photograph the sequence "
        "again",
        false, kManyNumbers);
  }

  /// Light that does not come from the pattern, or another black level: a constant in all pixels.
  void find_offset() {
    double left = 0, most = 0;
    int at = 0;
    for (const int pair : used_) {
      Line line;
      for (std::size_t k = 0; k < usual_.size(); ++k) line.add(1, 0, off(pair, k));
      left += line.left();
      const double by = line.solve()[0];
      if (std::abs(by) > std::abs(most)) most = by, at = pair;
    }
    add(left, std::abs(most) / clear_.contrast,
        fmt::format(
            "the black level or the room light differs between photographs: {} and {} together are {} by "
            "{:.1f} % of the contrast in all pixels alike",
            name(2 * at), name(2 * at + 1), most > 0 ? "brighter" : "darker",
            100 * std::abs(most) / clear_.contrast),
        "fix the camera's black level, keep the room dark, and photograph the sequence again", true);
  }

  /// A curve raises half light. sum − white − black = bend · (1 − m²) · (white − black), where m is the
  /// difference of pattern and complement, over white − black.
  void find_curve() {
    Line line;
    for (const int pair : used_) {
      if (pair == pairs_) continue;
      for (std::size_t k = 0; k < usual_.size(); ++k) {
        const double light = pattern(pairs_, k) - complement(pairs_, k);
        if (!(light > 0.1 * clear_.contrast)) continue;
        const double m = (pattern(pair, k) - complement(pair, k)) / light;
        const auto ends = static_cast<double>(sum(pairs_, clear_.at[k]));
        line.add(light * std::max(1 - m * m, 0.0), 0, static_cast<double>(sum(pair, clear_.at[k])) - ends);
      }
    }
    const double share = line.squares() > 0 ? line.left() / line.squares() : 1, bend = line.solve()[0];
    add(share * all_, std::abs(bend) / 2,
        fmt::format(
            "the camera is not linear (gamma, tone curve or contrast setting): half light gives {:+.0f} % of "
            "the range against half of it",
            50 * bend),
        "switch gamma and tone curve off, or give the response of the camera in capture.toml");
  }

  const CodePhotographs& photographs_;
  const ClearPixels& clear_;
  int pairs_;
  std::optional<int> held_out_;
  std::vector<int> used_;  ///< the pairs, then white and black
  std::vector<float> usual_;
  double all_ = 0;
  std::vector<double> gains_;  ///< of all photographs but black
  std::vector<int> of_gain_;   ///< the photograph of each gain
  std::vector<Explained> found_;
};

}  // namespace

LightChanges::LightChanges(const CodePhotographs& photographs, const ClearPixels& clear,
                           const std::optional<int>& held_out) {
  constexpr std::size_t kFewestClear = 200;
  if (clear.at.size() < kFewestClear || photographs.complements_derived) return;
  for (Explained& one : Changes(photographs, clear, held_out).causes())
    found_.push_back({std::move(one.cause), one.share, one.effect, one.rank, one.particular});
}

std::vector<SequenceCause> LightChanges::named(double least_explained, double least_effect,
                                               bool particular) const {
  constexpr double kNearBest = 0.15;
  std::vector<SequenceCause> causes;
  double best = 0;
  for (const Found& one : found_) {
    if (one.explained < least_explained || one.rank < best - kNearBest || one.effect < least_effect ||
        (particular && !one.particular))
      continue;
    best = std::max(best, one.rank);
    causes.push_back(one.cause);
  }
  return causes;
}

namespace {
/// Photographs of a still bench reach it in these models (interreflection, rounding). What changes light by
/// less makes no sequence contradict itself.
constexpr double kStill = 0.02;
}  // namespace

std::vector<SequenceCause> LightChanges::most() const {
  return named(0.7, kStill, false);
}
std::vector<SequenceCause> LightChanges::all() const {
  return named(0.9, kStill, true);
}
std::vector<SequenceCause> LightChanges::spoiling() const {
  return named(0.7, 0.15, false);
}

/// A fit predicts the photographs of a still bench to 6 %.
std::vector<SequenceCause> LightChanges::harmful() const {
  return named(0.3, 2 * kStill, false);
}

std::vector<SequenceCause> find_sharpening(const CodePhotographs& photographs, const ClearPixels& clear,
                                           const std::optional<int>& held_out) {
  constexpr double kBeyond = 0.06, kMost = 0.03;  // of the contrast; of the values
  if (clear.at.empty() || photographs.complements_derived) return {};
  double below = 0, above = 0, all = 0;
  constexpr double kSigmas = 6;  // of one photograph; a difference has 1.4
  const NoiseLine noise = estimate_repeat_noise(photographs, held_out);
  for (int pair = 0; pair < photographs.code.pairs(); ++pair) {
    if (pair == held_out) continue;
    for (const std::size_t i : clear.at) {
      const float p = photographs.image(2 * pair).values()[i],
                  n = photographs.image(2 * pair + 1).values()[i];
      const double sigma = std::sqrt(noise.variance(std::max(static_cast<double>(std::max(p, n)), 0.0)));
      const auto beyond = static_cast<float>(kBeyond * clear.contrast + kSigmas * sigma);
      below += std::min(p, n) < photographs.black().values()[i] - beyond ? 1 : 0;
      above += std::max(p, n) > photographs.white().values()[i] + beyond ? 1 : 0;
      all += 1;
    }
  }
  if (below < kMost * all || above < kMost * all) return {};
  return {{fmt::format("the photographs are sharpened, or strongly compressed: patterns are darker than "
                       "black in {:.0f} % of the values, and "
                       "brighter than white in {:.0f} %",
                       100 * below / all, 100 * above / all),
           "switch the sharpening of the camera off, or take raw photographs"}};
}

}  // namespace symrig::calibration
