// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence/sequence_causes.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

/// The photograph of each pattern of the sequence; −1: none.
using Order = std::vector<int>;

/// Of an order that fits, and how many pixels tell that one does not.
constexpr double kMostMisfit = 0.15;
constexpr std::size_t kFew = 300;

/// How well an order fits.
struct Fit {
  double misfit = 1;      ///< rms of the sums of the pairs about their median, share of the contrast
  double neighbours = 0;  ///< of the pixels whose code differs from their neighbour's, how many differ by one
  bool mirrored = false;  ///< the map that it gives

  /// Cameras seldom see a mirror. It decides between orders that are alike but for the axes.
  double distance() const { return misfit + (1 - neighbours) + (mirrored ? 0.05 : 0); }
};

/// Positions along one axis: how a pixel's neighbours to the right and below differ from it.
struct AxisSteps {
  double by_one = 0;  ///< of those that differ, how many differ by one
  std::vector<std::array<int, 2>> of;
};

class Judge {
 public:
  Judge(const CodePhotographs& photographs, const ClearPixels& clear)
      : photographs_(photographs), clear_(clear) {}

  Fit operator()(const Order& order) const {
    const std::vector<float> usual = usual_sums(order);
    const GrayCode& code = photographs_.code;
    const AxisSteps columns = steps(order, usual, 0, code.column_bits()),
                    rows = steps(order, usual, code.column_bits(), code.row_bits());
    double handed = 0;
    for (std::size_t k = 0; k < std::min(columns.of.size(), rows.of.size()); ++k)
      handed += columns.of[k][0] * rows.of[k][1] - columns.of[k][1] * rows.of[k][0];
    return {misfit(order, usual), std::min(columns.by_one, rows.by_one), handed < 0};
  }
  /// By a few of the pixels: most orders are far off, and need no closer look.
  bool far_off(const Order& order) const {
    const std::size_t step = clear_.at.size() / kFew + 1;
    return misfit(order, usual_sums(order, step), step) > 2 * kMostMisfit;
  }
  /// Whether white and black of an order are in the right places.
  bool ends_are_right(const Order& order) const {
    const GrayCode& code = photographs_.code;
    const int white = order[code.white()], black = order[code.black()];
    const auto mean = [&](int photograph) {
      double sum = 0;
      for (const std::size_t i : clear_.at) sum += static_cast<double>(of(photograph, i));
      return sum / static_cast<double>(clear_.at.size());
    };
    constexpr double kClearly = 0.2;  // of the contrast; patterns light about a half
    double patterns = 0;
    for (int k = 0; k < code.white(); ++k)
      if (order[k] >= 0) patterns += mean(order[k]) / code.white();
    const double least = kClearly * clear_.contrast;
    return (white < 0 || mean(white) > patterns + least) && (black < 0 || mean(black) < patterns - least);
  }

 private:
  float of(int photograph, std::size_t pixel) const { return photographs_.image(photograph).values()[pixel]; }
  static bool complete(const Order& order, int pair) {
    return order[2 * static_cast<std::size_t>(pair)] >= 0 &&
           order[2 * static_cast<std::size_t>(pair) + 1] >= 0;
  }
  float sum(const Order& order, int pair, std::size_t pixel) const {
    return of(order[2 * static_cast<std::size_t>(pair)], pixel) +
           of(order[2 * static_cast<std::size_t>(pair) + 1], pixel);
  }
  /// Of each clear pixel, or of one in `step`, over the complete pairs, and white + black.
  std::vector<float> usual_sums(const Order& order, std::size_t step = 1) const {
    std::vector<float> usual, all;
    usual.reserve(clear_.at.size() / step + 1);
    for (std::size_t k = 0; k < clear_.at.size(); k += step) {
      all.clear();
      for (int pair = 0; pair <= photographs_.code.pairs(); ++pair)
        if (complete(order, pair)) all.push_back(sum(order, pair, clear_.at[k]));
      usual.push_back(median(all));
    }
    return usual;
  }
  double misfit(const Order& order, const std::vector<float>& usual, std::size_t step = 1) const {
    double squares = 0, count = 0;
    for (int pair = 0; pair <= photographs_.code.pairs(); ++pair) {
      if (!complete(order, pair)) continue;
      for (std::size_t k = 0; k < usual.size(); ++k) {
        squares += std::pow(static_cast<double>(sum(order, pair, clear_.at[k * step]) - usual[k]), 2);
        count += 1;
      }
    }
    return count > 0 ? std::sqrt(squares / count) / clear_.contrast : 1;
  }
  /// Pattern minus complement. A lost one is the usual sum minus the other.
  float difference(const Order& order, int pair, std::size_t pixel, float usual) const {
    const int p = order[2 * static_cast<std::size_t>(pair)],
              n = order[2 * static_cast<std::size_t>(pair) + 1];
    if (p < 0) return usual - 2 * of(n, pixel);
    if (n < 0) return 2 * of(p, pixel) - usual;
    return of(p, pixel) - of(n, pixel);
  }
  /// The bits of an axis, widest stripes first, that most pixels see clearly.
  int resolved(const Order& order, const std::vector<float>& usual, int first, int bits) const {
    constexpr double kStrong = 0.3;
    const auto least = static_cast<float>(kStrong * clear_.contrast);
    for (int bit = 0; bit < bits; ++bit) {
      std::size_t strong = 0;
      for (std::size_t k = 0; k < usual.size(); ++k)
        strong += std::abs(difference(order, first + bit, clear_.at[k], usual[k])) > least ? 1 : 0;
      if (2 * strong < usual.size()) return bit;
    }
    return bits;
  }
  AxisSteps steps(const Order& order, const std::vector<float>& usual, int first, int bits) const {
    if (bits == 0) return {1, {}};
    const int seen = resolved(order, usual, first, bits);
    if (seen < std::min(bits, 3)) return {};
    const std::size_t width = photographs_.camera().cols;
    const auto position = [&](std::size_t pixel, float of_sums) {
      int bit = 0, value = 0;
      for (int k = first; k < first + seen; ++k) {
        bit ^= difference(order, k, pixel, of_sums) > 0 ? 1 : 0;
        value = 2 * value + bit;
      }
      return value;
    };
    AxisSteps found;
    double differ = 0, by_one = 0;
    for (std::size_t k = 0; k < usual.size(); ++k) {
      const int here = position(clear_.at[k], usual[k]);
      const std::array<int, 2> step{position(clear_.at[k] + ClearPixels::kNext, usual[k]) - here,
                                    position(clear_.at[k] + ClearPixels::kNext * width, usual[k]) - here};
      for (const int one : step) differ += one != 0 ? 1 : 0, by_one += std::abs(one) == 1 ? 1 : 0;
      found.of.push_back(step);
    }
    found.by_one = differ > 0 ? by_one / differ : 1;
    return found;
  }

  const CodePhotographs& photographs_;
  const ClearPixels& clear_;
};

struct Candidate {
  Order order;
  std::string text, next;
};

/// All orders that are tried.
class Orders {
 public:
  explicit Orders(const CodePhotographs& photographs)
      : photographs_(photographs), count_(photographs.code.photographs()) {
    delayed();
    lost();
    rearranged();
    begins_elsewhere();
  }
  const std::vector<Candidate>& all() const { return all_; }
  Order given() const {
    return made([](int k) { return k; });
  }

 private:
  Order made(const std::function<int(int)>& photograph) const {
    Order order;
    for (int k = 0; k < count_; ++k) {
      const int from = photograph(k);
      order.push_back(from >= 0 && from < count_ ? from : -1);
    }
    return order;
  }
  const std::string& name(int k) const { return photographs_.names[k]; }

  /// From some photograph on, each shows the pattern before its own.
  void delayed() {
    all_.push_back(
        {made([](int k) { return k + 1; }),
         fmt::format("the photographs are one late: {} shows the first pattern, and black is missing",
                     name(1)),
         "start the camera before the first pattern, or leave out the first photograph and add "
         "black"});
    for (int j = 0; j + 2 < count_; ++j)
      all_.push_back(
          {made([j](int k) { return k <= j ? k : k + 1; }),
           fmt::format("{} is {} once more: from there on the photographs are one late, and black is "
                       "missing",
                       name(j + 1), name(j)),
           "remove the doubled photograph and add black, or photograph the sequence again"});
  }
  void lost() {
    for (int j = 0; j < count_ - 1; ++j)
      all_.push_back(
          {made([j](int k) { return k < j    ? k
                                    : k == j ? -1
                                             : k - 1; }),
           j == 0 ? fmt::format("the first photograph is missing: {} shows the second pattern", name(0))
                  : fmt::format("a photograph is missing between {} and {}: from there on each shows "
                                "the pattern after its own",
                                name(j - 1), name(j)),
           "photograph the sequence again"});
  }
  /// The place in the standard order of the pattern that a photograph shows, for other programs' orders.
  void add(const std::function<int(int)>& place_of, const std::string& text) {
    const char* const next = "name the files by the order: column pairs, row pairs, white, black";
    const Order order = made(place_of);
    if (std::ranges::find(order, -1) == order.end()) all_.push_back({order, text, next});
    all_.push_back({made([&](int k) { return count_ - 1 - place_of(k); }), text + ", all backwards", next});
    all_.push_back({made([&](int k) { return (place_of(k) + 2) % count_; }),
                    "white and black come first" + (text.empty() ? text : ", then " + text), next});
  }
  void rearranged() {
    const GrayCode& code = photographs_.code;
    const int pairs = code.pairs(), columns = code.column_bits(), rows = code.row_bits();
    const auto finest = [=](int k) {
      const int pair = k / 2, mirrored = pair < columns ? columns - 1 - pair : 2 * columns + rows - 1 - pair;
      return 2 * mirrored + k % 2;
    };
    const auto halves = [=](int k) { return k % 2 * pairs + k / 2; };
    const auto rows_first = [=](int k) { return k < 2 * columns ? k + 2 * rows : k - 2 * columns; };
    const auto keep_ends = [=](auto place) {
      return std::function<int(int)>([=](int k) { return k < 2 * pairs ? place(k) : k; });
    };
    all_.push_back({made([this](int k) { return count_ - 1 - k; }),
                    "the photographs are in the reverse order",
                    "name the files by the order in which they were taken"});
    all_.push_back(
        {made([](int k) { return k ^ 1; }),
         "every photograph shows the complement of its pattern: the projector's picture is inverted",
         "switch the inversion of the projector off"});
    all_.push_back({made([this](int k) { return (k + 2) % count_; }), "white and black come first",
                    "name the files by the order: column pairs, row pairs, white, black"});
    add(keep_ends(halves), "all patterns come before all complements");
    add(keep_ends([=](int k) { return halves(rows_first(k)); }),
        "all patterns come before all complements, rows before columns");
    add(keep_ends(finest), "the finest stripes come first");
    add(keep_ends(rows_first), "the rows come before the columns");
    add(keep_ends([=](int k) { return k ^ 1; }), "every complement comes before its pattern");
    by_text();
  }
  /// Names without leading zeros, in the order of the letters: 0, 1, 10, 11, …, 19, 2, 20.
  void by_text() {
    std::vector<int> sorted(count_);
    std::iota(sorted.begin(), sorted.end(), 0);
    std::ranges::sort(sorted, {}, [](int k) { return std::to_string(k); });
    const char* const text = "the files were numbered in the order 0, 1, 10, 11, ... 2, 20";
    add([&](int k) { return static_cast<int>(std::ranges::find(sorted, k) - sorted.begin()); }, text);
    add([&](int k) { return sorted[k]; }, text);
  }
  void begins_elsewhere() {
    for (int by = 1; by < count_; ++by)
      if (by != 2)  // white and black come first
        all_.push_back(
            {made([&](int k) { return (k + by) % count_; }),
             fmt::format("the sequence begins with {}: the counter of the file names has begun again",
                         name(by)),
             "name the files by the order in which they were taken"});
  }

  const CodePhotographs& photographs_;
  int count_;
  std::vector<Candidate> all_;
};

}  // namespace

std::vector<SequenceCause> find_arrangements(const CodePhotographs& photographs, const ClearPixels& clear) {
  constexpr double kFewestNeighbours = 0.75;
  constexpr double kBetter = 0.1, kTimes = 3, kAlike = 0.02;
  constexpr std::size_t kFewestClear = 200;
  if (clear.at.size() < kFewestClear || photographs.complements_derived) return {};
  const Judge judge(photographs, clear);
  const Orders candidates(photographs);
  const Fit given = judge(candidates.given());
  std::vector<std::pair<Fit, const Candidate*>> fitting;
  double best = std::min(given.distance() - kBetter, given.distance() / kTimes) - kAlike;
  for (const Candidate& one : candidates.all()) {
    if (judge.far_off(one.order)) continue;
    const Fit fit = judge(one.order);
    if (fit.misfit > kMostMisfit || fit.neighbours < kFewestNeighbours || fit.distance() > best + kAlike ||
        !judge.ends_are_right(one.order))
      continue;
    fitting.emplace_back(fit, &one);
    best = std::min(best, fit.distance());
  }
  std::vector<SequenceCause> causes;
  for (const auto& [fit, one] : fitting)
    if (fit.distance() <= best + kAlike)
      causes.push_back(
          {fmt::format("{} (then the pairs add up to within {:.1f} % of the contrast, as they are "
                       "{:.0f} %; {:.0f} % of the edges fit, as they are {:.0f} %)",
                       one->text, 100 * fit.misfit, 100 * given.misfit, 100 * fit.neighbours,
                       100 * given.neighbours),
           one->next});
  return causes;
}

}  // namespace symrig::calibration
