// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence_verdicts.hpp"
#include "symrig/base/quantile.hpp"

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
    if (off_.empty()) return {check_bounds()};
    if (off_.size() == 1)
      return {judge_one(off_.front()), is_ends(off_.front()) || off_.front() == members_.front()};
    if (off_.size() == 2) {
      if (const auto exchanged = judge_exchange(off_[0], off_[1])) return {*exchanged};
    }
    if (const auto change = judge_change()) return {*change, true};
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
    if (is_white) return black_is_lit();
    if (is_black) return white_is_dark();
    return wrong(
        fmt::format("{} and {}, the last two, are not white and black", name(white()), name(black())),
        candidates());
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

  Result<void> judge_one(int pair) const {
    if (is_ends(pair)) {
      SYMRIG_CHECK(check_bounds());
      return wrong(
          fmt::format("{} (white) and {} (black) add up to {:.2f} times the sum of each pair", name(white()),
                      name(black()), gain(pair)),
          "photograph the sequence again: one of them has another exposure or lamp, or shows another "
          "pattern");
    }
    for (const int member : {2 * pair, 2 * pair + 1}) {
      if (dark(member))
        return wrong(seems(member, pair, "is dark where its pattern lights the scene"),
                     "photograph it again");
      if (bright(member))
        return wrong(seems(member, pair, "is lit where its pattern leaves the scene dark"),
                     "photograph it again");
      if (const auto twin = same_as(member))
        return wrong(seems(member, pair, "is the same picture as " + name(*twin)), "photograph it again");
    }
    const double factor = gain(pair);
    std::vector<float> scaled = usual_;
    for (float& v : scaled) v *= static_cast<float>(factor);
    const double left = distance(sum_of(pair), scaled, 2 + factor * factor);
    if (left < limit_ / 2)
      return wrong(
          fmt::format("{} add up to {:.2f} times white + black", full(pair), factor),
          "photograph the sequence again with both fixed: exposure or lamp has changed for one or both of "
          "them");
    return wrong(fmt::format("{} do not add up to white + black ({:.0f} % off)", full(pair),
                             100 * distance(sum_of(pair), usual_, 2)),
                 "check both: one of them shows another pattern or exposure, or is out of order");
  }
  std::string seems(int member, int pair, const std::string& what) const {
    return fmt::format("{} {}; {} do not add up to white + black", name(member), what, full(pair));
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
  std::optional<Error> judge_change() const {
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
      return wrong(fmt::format("exposure or lamp has changed {}: photographs {} are {:.2f} times as bright",
                               place, begins ? "before" : "after", factor),
                   "photograph the sequence with both fixed");
    return wrong(
        fmt::format(
            "the photographs show another picture {} {}: camera, projector or scene has moved, or they "
            "belong to another sequence",
            begins ? "before than after a change" : "after than before a change", place),
        "photograph the sequence again, with everything fixed");
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
