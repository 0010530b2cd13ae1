// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence/sequence_verdicts.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::calibration {
namespace {

constexpr double kMisfit =
    0.1;  // of the contrast; interreflection and the projector's edges cost a few percent
constexpr double kMostWrong = 0.1;  // share of the lit pixels

Error wrong(std::string what, std::string next) {
  return {ErrorCode::bad_value, std::move(what), std::move(next)};
}

class Sums {
 public:
  explicit Sums(const SequenceLight& light) : light_(light), members_(light.pairs) {
    members_.push_back(light.photographs.code.pairs());  // white and black
    collect();
    compare();
    choose_consensus();
    find_halves();
  }

  SumsVerdict judge() const {
    if (off_.empty()) return {check_bounds(), false, true};
    if (off_.size() == 1) {
      SumsVerdict one = judge_one(off_.front());
      one.change = is_ends(off_.front()) || off_.front() == members_.front();
      return one;
    }
    if (off_.size() == 2) {
      if (const auto exchanged = judge_exchange(off_[0], off_[1])) return {*exchanged, false, true};
    }
    if (const auto change = judge_change()) return *change;
    return {wrong(fmt::format("the sums of {} differ from those of the other pairs", list(off_)),
                  "photograph the sequence again, or put the photographs in order")};
  }

 private:
  std::size_t size() const { return members_.size(); }
  bool is_ends(int pair) const { return pair == light_.photographs.code.pairs(); }
  double& apart(std::size_t a, std::size_t b) { return apart_[a * size() + b]; }
  double apart(std::size_t a, std::size_t b) const { return apart_[a * size() + b]; }
  const std::string& name(int photograph) const { return light_.name(photograph); }
  std::string names(int pair) const { return name(2 * pair) + " and " + name(2 * pair + 1); }
  std::string full(int pair) const {
    return is_ends(pair) ? names(pair) + " (white, black)"
                         : fmt::format("{} ({})", names(pair), light_.photographs.code.pair(pair).name);
  }
  std::string list(const std::vector<int>& pairs) const {
    std::vector<std::string> all;
    all.reserve(pairs.size());
    for (const int pair : pairs) all.push_back(full(pair));
    return fmt::format("{}", fmt::join(all, ", "));
  }

  void collect() {
    double noise = 0;
    for (const std::size_t i : light_.sample) noise += std::pow(light_.sigma(i), 2);
    noise_ = noise / static_cast<double>(light_.sample.size());
    for (const int pair : members_) {
      std::vector<float> sums;
      sums.reserve(light_.sample.size());
      for (const std::size_t i : light_.sample) sums.push_back(light_.sum(pair, i));
      sums_.push_back(std::move(sums));
    }
  }
  /// rms difference of two pictures above the noise of `noises` photographs, over twice the amplitude, which
  /// is white minus black.
  double distance(const std::vector<float>& a, const std::vector<float>& b, double noises) const {
    double squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) squares += std::pow(static_cast<double>(a[i] - b[i]), 2);
    const double mean = squares / static_cast<double>(a.size()) - noises * noise_;
    return std::sqrt(std::max(mean, 0.0)) / (2 * light_.contrast);
  }
  void compare() {
    apart_.resize(size() * size());
    std::vector<double> all;
    for (std::size_t a = 0; a < size(); ++a)
      for (std::size_t b = a + 1; b < size(); ++b)
        all.push_back(apart(a, b) = apart(b, a) = distance(sums_[a], sums_[b], 4));
    limit_ = std::max(kMisfit, 3 * ranked(all, std::ssize(all) / 4));
  }
  /// Chooses the largest set of sums that agree with one of them.
  void choose_consensus() {
    std::size_t best = 0, most = 0;
    for (std::size_t a = 0; a < size(); ++a) {
      std::size_t alike = 0;
      for (std::size_t b = 0; b < size(); ++b) alike += apart(a, b) <= limit_ ? 1 : 0;
      if (alike > most) most = alike, best = a;
    }
    std::vector<std::size_t> group;
    for (std::size_t b = 0; b < size(); ++b) {
      if (apart(best, b) <= limit_)
        group.push_back(b), good_.push_back(members_[b]);
      else
        off_.push_back(members_[b]);
    }
    std::vector<float> at;
    for (std::size_t i = 0; i < light_.sample.size(); ++i) {
      at.clear();
      for (const std::size_t b : group) at.push_back(sums_[b][i]);
      usual_.push_back(median(at));
    }
  }

  /// Computes the mean of the darker and of the brighter photograph of each pair.
  void find_halves() {
    for (const std::size_t i : light_.sample) {
      double low = 0, high = 0, n = 0;
      for (const int pair : good_) {
        if (is_ends(pair)) continue;
        const auto p = static_cast<double>(light_.of(2 * pair, i)),
                   q = static_cast<double>(light_.of(2 * pair + 1, i));
        low += std::min(p, q), high += std::max(p, q), n += 1;
      }
      low_.push_back(low / std::max(n, 1.0)), high_.push_back(high / std::max(n, 1.0));
    }
  }
  /// Share of the lit pixels in which a photograph is brighter than the darker halves of the patterns, or
  /// darker than the brighter halves. Black is darker and white is brighter than both.
  double beyond(int photograph, bool above_dark) const {
    double count = 0;
    for (std::size_t k = 0; k < light_.sample.size(); ++k) {
      const std::size_t i = light_.sample[k];
      const double part = 0.25 * (high_[k] - low_[k]) + 3 * light_.sigma(i);
      const auto is = static_cast<double>(light_.of(photograph, i));
      count += (above_dark ? is > low_[k] + part : is < high_[k] - part) ? 1 : 0;
    }
    return count / static_cast<double>(light_.sample.size());
  }
  bool dark(int photograph) const { return beyond(photograph, true) <= kMostWrong; }
  bool bright(int photograph) const { return beyond(photograph, false) <= kMostWrong; }

  int white() const { return light_.photographs.code.white(); }
  int black() const { return light_.photographs.code.black(); }
  Error black_is_lit() const {
    return wrong(
        fmt::format(
            "{} (black) is lit: in {:.0f} % of the lit pixels it is brighter than patterns that leave them "
            "dark",
            name(black()), 100 * beyond(black(), true)),
        "take the last photograph while the projector shows black");
  }
  Error white_is_dark() const {
    return wrong(
        fmt::format(
            "{} (white) is dark: in {:.0f} % of the lit pixels it is darker than patterns that light them",
            name(white()), 100 * beyond(white(), false)),
        "take the last photograph but one while the projector shows white");
  }
  Result<void> check_bounds() const {
    const bool is_white = bright(white()), is_black = dark(black());
    if (is_white && is_black) return {};
    if (const auto change = local_change()) return *change;
    if (is_white) return black_is_lit();
    if (is_black) return white_is_dark();
    return wrong(
        fmt::format("{} and {}, the last two, are not white and black", name(white()), name(black())),
        candidates());
  }
  /// White and black contradict the patterns in a part of the scene, and agree with them elsewhere.
  std::optional<Error> local_change() const {
    constexpr double kLargest =
        0.35;  // of the lit pixels; a pattern differs from white in about half of them
    constexpr double kAgrees = 0.04;
    if (light_.photographs.complements_derived) return std::nullopt;  // all sums are those of white and black
    const auto& sum = sum_of(light_.photographs.code.pairs());
    double differ = 0, along = 0, square = 0;
    for (std::size_t k = 0; k < sum.size(); ++k) {
      const auto usual = static_cast<double>(usual_[k]), is = static_cast<double>(sum[k]);
      if (std::abs(is - usual) > kMisfit * (high_[k] - low_[k]) + 6 * light_.sigma(light_.sample[k]))
        differ += 1;
      else
        along += is * usual, square += usual * usual;
    }
    const double share = differ / static_cast<double>(sum.size());
    if (share > kLargest || !(square > 0) || std::abs(along / square - 1) > kAgrees) return std::nullopt;
    return wrong(
        fmt::format("{} (white) and {} (black) contradict the patterns in {:.0f} % of the lit pixels, and "
                    "agree with them in the others: something in the scene has moved or changed",
                    name(white()), name(black()), 100 * share),
        "photograph the sequence again, with everything fixed");
  }
  /// The photographs that look like white and black.
  std::string candidates() const {
    if (bright(black()) && dark(white())) return "exchange the two files: white comes before black";
    std::optional<int> light, shade;
    for (int k = 0; k < white(); ++k) {
      if (!light && bright(k)) light = k;
      if (!shade && dark(k)) shade = k;
    }
    if (light && shade)
      return fmt::format(
          "{} looks like white and {} like black: check the order: column pairs, row pairs, white, black",
          name(*light), name(*shade));
    return "check the order: column pairs, row pairs, white, black";
  }

  SumsVerdict judge_one(int pair) const {
    if (is_ends(pair)) {
      if (const auto bounds = check_bounds(); !bounds) return {bounds, false, true};
      return {
          wrong(fmt::format("{} (white) and {} (black) add up to {:.2f} times the sum of each pair",
                            name(white()), name(black()), gain(pair)),
                "photograph the sequence again: one of them has another exposure or lamp, or shows another "
                "pattern")};
    }
    for (const int member : {2 * pair, 2 * pair + 1})
      if (const auto what = seen_of(member))
        return {
            wrong(fmt::format("{} {}; {} do not add up to white + black", name(member), *what, full(pair)),
                  "photograph it again"),
            false, true};
    const double factor = gain(pair);
    std::vector<float> scaled = usual_;
    for (float& v : scaled) v *= static_cast<float>(factor);
    const double left = distance(sum_of(pair), scaled, 2 + factor * factor);
    if (left < limit_ / 2)
      return {wrong(fmt::format("{} add up to {:.2f} times white + black", full(pair), factor),
                    "photograph the sequence again with both fixed: exposure or lamp has changed for one or "
                    "both of them"),
              false, true};
    return {wrong(fmt::format("{} do not add up to white + black ({:.0f} % off)", full(pair),
                              100 * distance(sum_of(pair), usual_, 2)),
                  "check both: one of them shows another pattern or exposure, or is out of order")};
  }
  /// What is wrong with a photograph of a pair that does not add up.
  std::optional<std::string> seen_of(int member) const {
    if (dark(member)) return "is dark where its pattern lights the scene";
    if (bright(member)) return "is lit where its pattern leaves the scene dark";
    const auto twin = same_as(member);
    return twin ? std::optional("is the same picture as " + name(*twin)) : std::nullopt;
  }
  const std::vector<float>& sum_of(int pair) const {
    return sums_[std::ranges::find(members_, pair) - members_.begin()];
  }
  double gain(int pair) const {
    const auto& sum = sum_of(pair);
    double along = 0, square = 0;
    for (std::size_t i = 0; i < usual_.size(); ++i)
      along += static_cast<double>(sum[i]) * static_cast<double>(usual_[i]),
          square += std::pow(static_cast<double>(usual_[i]), 2);
    return square > 0 ? along / square : 1;
  }
  std::vector<float> picture(int photograph) const {
    std::vector<float> values;
    for (const std::size_t i : light_.sample) values.push_back(light_.of(photograph, i));
    return values;
  }
  /// A photograph of a correct pair that shows the same picture.
  std::optional<int> same_as(int photograph) const {
    const auto mine = picture(photograph);
    for (const int pair : good_)
      for (const int other : {2 * pair, 2 * pair + 1})
        if (distance(mine, picture(other), 2) < kMisfit / 4) return other;
    return std::nullopt;
  }

  /// Two sums differ by the same amount with opposite signs: two of their photographs have changed places.
  std::optional<Error> judge_exchange(int a, int b) const {
    std::vector<std::string> fits;
    for (const int x : {2 * a, 2 * a + 1})
      for (const int y : {2 * b, 2 * b + 1}) {
        std::vector<float> with_y = sum_of(a), with_x = sum_of(b);
        for (std::size_t i = 0; i < with_y.size(); ++i) {
          const float difference = light_.of(y, light_.sample[i]) - light_.of(x, light_.sample[i]);
          with_y[i] += difference, with_x[i] -= difference;
        }
        if (is_ends(b) && !(y == white() ? bright(x) && dark(black()) : dark(x) && bright(white()))) continue;
        if (distance(with_y, usual_, 2) < limit_ && distance(with_x, usual_, 2) < limit_)
          fits.push_back(name(x) + " and " + name(y));
      }
    if (fits.empty()) return std::nullopt;
    return wrong(fmt::format("two photographs have changed places: {}", fmt::join(fits, ", or ")),
                 fits.size() == 1
                     ? "exchange the two files"
                     : "exchange the two files of one of these, or photograph the sequence again");
  }

  /// All photographs up to one, or from one on, show another picture.
  std::optional<SumsVerdict> judge_change() const {
    const int first = off_.front(), last = off_.back();
    if (static_cast<std::size_t>(last - first) + 1 >
        off_.size() +
            (light_.pairs.size() < static_cast<std::size_t>(light_.photographs.code.pairs()) ? 1 : 0))
      return std::nullopt;
    const bool begins = first == members_.front(), ends = is_ends(last);
    if (begins == ends) return std::nullopt;
    // A change within a pair gives a sum that matches neither side: it lies between them.
    const int before = begins ? 2 * std::max(last - 1, 0) + 1 : 2 * first - 1;
    const int after = begins ? 2 * (last + 1) : std::min(2 * first + 2, black());
    std::vector<float> scaled = usual_;
    const int clear = begins ? first : last == first ? first : off_[1];
    const double factor = gain(clear);
    for (float& v : scaled) v *= static_cast<float>(factor);
    const std::string place = fmt::format("between {} and {}", name(before), name(after));
    if (distance(sum_of(clear), scaled, 2 + factor * factor) < limit_ / 2)
      return SumsVerdict{
          wrong(fmt::format("exposure or lamp has changed {}: photographs {} are {:.2f} times as "
                            "bright",
                            place, begins ? "before" : "after", factor),
                "photograph the sequence with both fixed"),
          true, true};
    const auto seen = another_picture(clear);
    if (!seen) return std::nullopt;
    return SumsVerdict{
        wrong(fmt::format("the photographs show another picture {} {}: {}",
                          begins ? "before than after a change" : "after than before a change", place, *seen),
              "photograph the sequence again, with everything fixed"),
        true};
  }
  /// What differs in the sum of a pair on the other side of a change. nullopt: those sums differ among
  /// themselves, so there are no two pictures.
  std::optional<std::string> another_picture(int clear) const {
    for (const int one : off_)
      if (one != clear && one != off_.front() && one != off_.back() &&
          distance(sum_of(one), sum_of(clear), 4) > limit_)
        return std::nullopt;
    if (const auto by = displacement(clear))
      return fmt::format("camera, projector or scene has moved, by {:.0f} pixels", *by);
    double differ = 0;
    const auto& sum = sum_of(clear);
    for (std::size_t k = 0; k < sum.size(); ++k)
      differ += std::abs(static_cast<double>(sum[k] - usual_[k])) >
                        2 * limit_ * static_cast<double>(light_.amplitude.values()[light_.sample[k]])
                    ? 1
                    : 0;
    const double share = differ / static_cast<double>(sum.size());
    constexpr double kSmallPart = 0.5;
    return share < kSmallPart
               ? fmt::format("something in the scene has moved or changed, in {:.0f} % of the lit pixels",
                             100 * share)
               : fmt::format(
                     "they differ in {:.0f} % of the lit pixels, so they belong to another sequence or "
                     "another place of the camera",
                     100 * share);
  }
  /// The whole pixels by which the sum of a pair lies beside those of the others; nullopt if no shift halves
  /// the difference.
  std::optional<double> displacement(int pair) const {
    constexpr int kFarthest = 12;  // camera pixels
    const Grid grid = light_.photographs.camera();
    const auto reference_at = std::ranges::find_if(good_, [&](int one) { return !is_ends(one); });
    if (reference_at == good_.end()) return std::nullopt;
    const int reference = *reference_at;
    const std::size_t stride = light_.sample.size() / 2000 + 1;
    const auto left = [&](int down, int right) {
      double squares = 0, count = 0;
      for (std::size_t k = 0; k < light_.sample.size(); k += stride) {
        const int row = static_cast<int>(light_.sample[k] / static_cast<std::size_t>(grid.cols)),
                  col = static_cast<int>(light_.sample[k] % static_cast<std::size_t>(grid.cols));
        if (row + down < 0 || row + down >= grid.rows || col + right < 0 || col + right >= grid.cols)
          continue;
        const std::size_t there = static_cast<std::size_t>(row + down) * static_cast<std::size_t>(grid.cols) +
                                  static_cast<std::size_t>(col + right);
        squares += std::pow(
            static_cast<double>(light_.sum(pair, light_.sample[k]) - light_.sum(reference, there)), 2);
        count += 1;
      }
      return count > 0 ? squares / count : 1e300;
    };
    double least = left(0, 0) / 4, by = 0;  // half of the rms
    for (int down = -kFarthest; down <= kFarthest; ++down)
      for (int right = -kFarthest; right <= kFarthest; ++right)
        if (const double here = left(down, right); here < least) least = here, by = std::hypot(down, right);
    return by > 0 ? std::optional(by) : std::nullopt;
  }

  const SequenceLight& light_;
  std::vector<int> members_;  ///< the pairs, then white and black
  std::vector<std::vector<float>> sums_;
  std::vector<double> apart_;
  std::vector<int> good_, off_;
  std::vector<double> low_, high_;
  std::vector<float> usual_;  ///< the sum that most pairs agree on
  double noise_ = 0, limit_ = kMisfit;
};

}  // namespace

SumsVerdict check_sums(const SequenceLight& light) {
  return Sums(light).judge();
}

}  // namespace symrig::calibration
