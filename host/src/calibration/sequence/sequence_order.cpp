// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence/sequence_verdicts.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

constexpr int kWidest = 8;  // pixels; largest blur of an edge
constexpr double kMostEdges = 25, kLeastEdges = 6;
constexpr double kLines = 64;  // lines of pixels across the lit part, along each axis

/// The signs of pair t at the edges of pair s.
struct Votes {
  double lit = 0, dark = 0, weak = 0;
  double all() const { return lit + dark + weak; }
};

/// The signs of a pair over the lit picture, where most pairs have a clear sign: votes come from there too.
struct SignRates {
  double lit = 0.5;   ///< share of the clear signs
  double weak = 0.1;  ///< share of all signs
};

// How the order is judged: EdgeVotes finds the edges of each pair s along lines of pixels, and counts which
// sign each other pair t has there. Explanations makes the list of what may be wrong. Each gives every pair
// a role (axis, bit, inverted), which predicts the odds p of lit, dark and weak signs. Its likelihood is
//
//   L = Σ_{s ≠ t} w(s, t) Σ_sign votes(s, t, sign) ln p(sign | role of s, role of t)
//
// with weights w that let a pair count as at most 25 edges. The order is wrong if some L exceeds that of
// the usual roles by 10. All explanations within 3 of the best are named.

/// The votes of each pair at the edges of each other pair.
class EdgeVotes {
 public:
  explicit EdgeVotes(const SequenceLight& light) : light_(light), count_(light.photographs.code.pairs()) {
    votes_.resize(static_cast<std::size_t>(count_) * static_cast<std::size_t>(count_));
    find_resolved();
    find_rates();
    const Grid grid = light.photographs.camera();
    const auto lit = std::ranges::count_if(light.amplitude.values(), [](float a) { return a > 0; });
    const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(lit)) / kLines));
    const auto lines = [step](int length) { return (length - step / 2 + step - 1) / step; };
    const std::size_t width = grid.cols, apart = step, first = step / 2;
    scan({first * width, apart * width, lines(grid.rows)}, 1, grid.cols);
    scan({first, apart, lines(grid.cols)}, width, grid.rows);
  }

  const Votes& at(int s, int t) const {
    return votes_[static_cast<std::size_t>(s) * static_cast<std::size_t>(count_) +
                  static_cast<std::size_t>(t)];
  }
  int pairs() const { return count_; }
  bool resolved(int pair) const { return resolved_[pair]; }
  const SignRates& rates(int pair) const { return rates_[pair]; }

 private:
  /// Finds the pairs that the camera resolves. Stripes that are too fine have no clear sign anywhere.
  void find_resolved() {
    resolved_.assign(count_, false);
    for (const int pair : light_.pairs) {
      const auto strong = std::ranges::count_if(light_.sample, [&](std::size_t i) {
        return std::abs(light_.difference(pair, i)) > light_.clear_difference(i);
      });
      resolved_[pair] = 2 * strong > std::ssize(light_.sample);
    }
  }
  /// Dark pixels have no sign of any pair, so they say nothing about one.
  void find_rates() {
    rates_.assign(count_, {});
    std::vector<std::size_t> strong(count_), lit(count_), all(count_);
    for (const std::size_t i : light_.sample) {
      const float level = light_.clear_difference(i);
      for (const int pair : light_.pairs) {
        const auto difference = [&](int other) { return light_.difference(other, i); };
        if (!is_clear_place(pair, level, difference)) continue;
        const float d = difference(pair);
        all[pair] += 1, strong[pair] += std::abs(d) > level ? 1 : 0, lit[pair] += d > level ? 1 : 0;
      }
    }
    for (const int pair : light_.pairs) {
      if (all[pair] == 0) continue;
      rates_[pair] = {(static_cast<double>(lit[pair]) + 1) / (static_cast<double>(strong[pair]) + 2),
                      1 - static_cast<double>(strong[pair]) / static_cast<double>(all[pair])};
    }
  }
  /// Parallel lines of pixels.
  struct Lines {
    std::size_t first, apart;
    int count;
    std::size_t begin(int line) const { return first + static_cast<std::size_t>(line) * apart; }
  };
  /// The last pixel of a line with a clear sign.
  struct Clear {
    int at = -1;
    float difference = 0;
  };
  /// Follows all lines at once: neighbours of lines along columns share the memory of a row.
  void scan(const Lines& lines, std::size_t stride, int length) {
    std::vector<float> levels;
    levels.reserve(static_cast<std::size_t>(lines.count) * static_cast<std::size_t>(length));
    for (int k = 0; k < length; ++k)
      for (int line = 0; line < lines.count; ++line) {
        const std::size_t pixel = lines.begin(line) + static_cast<std::size_t>(k) * stride;
        levels.push_back(light_.amplitude.values()[pixel] > 0 ? light_.clear_difference(pixel) : 0);
      }
    for (const int pair : light_.pairs) {
      if (!resolved(pair)) continue;
      std::vector<Clear> last(lines.count);
      auto level = levels.begin();
      for (int k = 0; k < length; ++k)
        for (int line = 0; line < lines.count; ++line)
          follow(pair, lines.begin(line), stride, k, *level++, last[line]);
    }
  }
  void follow(int pair, std::size_t begin, std::size_t stride, int k, float level, Clear& last) {
    if (!(level > 0)) {
      last.at = -1;
      return;
    }
    const float d = light_.difference(pair, begin + static_cast<std::size_t>(k) * stride);
    if (std::abs(d) < level) return;
    if (last.at >= 0 && k - last.at <= kWidest && d * last.difference < 0)
      vote(pair, begin, stride, last.at, k);
    last = {k, d};
  }
  /// Whether most pairs have a clear sign. At a stripe's edge they do, even if the pair shows other stripes.
  /// At the rim of a shadow or of another surface all are weak, and this tells nothing about any pair.
  template <class Difference>
  bool is_clear_place(int pair, float level, Difference difference) const {
    int clear = 0, all = 0;
    for (const int other : light_.pairs)
      if (other != pair && resolved(other)) all += 1, clear += std::abs(difference(other)) > level ? 1 : 0;
    return 2 * clear >= all;
  }
  /// Counts the sign of each other pair at an edge between two pixels.
  void vote(int pair, std::size_t begin, std::size_t stride, int from, int to) {
    const auto pixel = [&](int k) { return begin + static_cast<std::size_t>(k) * stride; };
    int k = from;
    while (k + 1 < to && light_.difference(pair, pixel(k)) * light_.difference(pair, pixel(k + 1)) > 0) ++k;
    const std::size_t i = pixel(k), j = pixel(k + 1);
    const float a = light_.difference(pair, i), b = light_.difference(pair, j);
    const float share = a == b ? 0.5F : a / (a - b);
    const float level = (light_.clear_difference(i) + light_.clear_difference(j)) / 2;
    const auto difference = [&](int other) {
      return (1 - share) * light_.difference(other, i) + share * light_.difference(other, j);
    };
    if (!is_clear_place(pair, level, difference)) return;
    for (const int other : light_.pairs) {
      if (other == pair) continue;
      const float v = difference(other);
      Votes& votes = votes_[static_cast<std::size_t>(pair) * static_cast<std::size_t>(count_) +
                            static_cast<std::size_t>(other)];
      (v > level ? votes.lit : v < -level ? votes.dark : votes.weak) += 1;
    }
  }

  const SequenceLight& light_;
  int count_;
  std::vector<Votes> votes_;
  std::vector<bool> resolved_;
  std::vector<SignRates> rates_;
};

/// The pattern that an explanation assigns to a pair.
struct Role {
  int axis = 0, bit = 0;
  bool inverted = false, known = true;
};
struct Explanation {
  std::vector<Role> roles;
  std::string text, advice;
  bool vague = false;  ///< reports only that a pair is wrong
  int pair = -1;       ///< the pair at fault
  double likelihood = 0;
};

/// Probabilities of lit, dark and weak.
using SignOdds = std::array<double, 3>;

/// What an explanation predicts of the sign of pair t at an edge of pair s. rates: of t at a place of no
/// meaning. Two in nine of the clear signs belong to another place: with even rates, every tenth sign is
/// wrong.
SignOdds predicted(const Role& s, const Role& t, const SignRates& rates) {
  const auto elsewhere = [&](double part) {
    return SignOdds{part * rates.lit, part * (1 - rates.lit), 1 - part};
  };
  if (!s.known || !t.known) return elsewhere(0.66);
  if (s.axis == t.axis && s.bit == t.bit) return {0.05, 0.05, 0.9};
  const double clear = 1 - rates.weak;
  if (s.axis != t.axis || t.bit < s.bit) return elsewhere(clear);
  const bool lit = (t.bit == s.bit + 1) != t.inverted;
  const double right = clear * 7 / 9;
  const SignOdds stray = elsewhere(clear - right);
  return {stray[0] + (lit ? right : 0), stray[1] + (lit ? 0 : right), rates.weak};
}

/// Of a pair that the camera does not resolve, noise alone has a clear sign at one edge in 370. Such signs
/// say nothing.
double likelihood_at(const Votes& votes, SignOdds p, bool resolved) {
  if (resolved) return votes.lit * std::log(p[0]) + votes.dark * std::log(p[1]) + votes.weak * std::log(p[2]);
  constexpr double kBeyond = 0.0027;  // of a normal distribution beyond three sigmas
  const double clear = votes.lit + votes.dark, noise = std::min(kBeyond * votes.all() / clear, 1.0);
  for (double& one : p) one = (1 - noise) * one + noise / 2;
  return votes.lit * std::log(p[0]) + votes.dark * std::log(p[1]);
}

/// rates: of pair t over all clear places. A camera that sees a small part of the projector sees one side of
/// the coarse stripes almost everywhere. Such a pair has this sign at every edge, so the sign tells nothing.
/// Stripes that are nearly too fine are weak at many edges. Where the edges of s lie together, t may have
/// other signs there: then the usual rates explain more.
double likelihood_of(const Votes& votes, const Role& s, const Role& t, SignRates rates, bool resolved) {
  constexpr double kRare = 0.005;    // no sign is rarer, or one stray sign would outweigh all others
  constexpr double kMostWeak = 0.3;  // a pair of another picture is weak at a third of the edges
  const double all = resolved ? votes.all() : votes.lit + votes.dark;
  if (all < kLeastEdges) return 0;
  const SignRates usual;
  rates = {std::clamp(rates.lit, kRare, 1 - kRare), std::clamp(rates.weak, usual.weak, kMostWeak)};
  const double weight = std::min(all, kMostEdges) / all;
  return weight * std::max(likelihood_at(votes, predicted(s, t, rates), resolved),
                           likelihood_at(votes, predicted(s, t, usual), resolved));
}

class Explanations {
 public:
  explicit Explanations(const SequenceLight& light) : light_(light), votes_(light) {
    add(usual(), "", "", -1);
    single_pairs();
    two_pairs();
    whole_sequence();
  }

  OrderFinding finding() const {
    constexpr double kMargin = 10, kAlike = 3;
    OrderFinding found;
    double best = -1e300;
    for (const Explanation& e : all_) best = std::max(best, e.likelihood);
    if (all_.front().likelihood >= best - kMargin) return found;
    found.right = false;
    for (const Explanation& e : all_)
      if (e.likelihood >= best - kAlike && !(e.vague && has_definite_alternative(e, best - kAlike))) {
        found.explanations.push_back(e.text);
        found.advice = e.advice;
      }
    return found;
  }

 private:
  bool has_definite_alternative(const Explanation& vague, double least) const {
    return std::ranges::any_of(all_, [&](const Explanation& e) {
      return !e.vague && e.pair == vague.pair && e.pair >= 0 && e.likelihood >= least;
    });
  }
  const GrayCode& code() const { return light_.photographs.code; }
  std::vector<Role> divided(int columns) const {
    std::vector<Role> roles;
    roles.reserve(code().pairs());
    for (int k = 0; k < code().pairs(); ++k)
      roles.push_back({k < columns ? 0 : 1, k < columns ? k : k - columns});
    return roles;
  }
  std::vector<Role> usual() const { return divided(code().column_bits()); }
  /// Of the photographs of a pair. A derived complement is none.
  std::string names(int pair) const {
    const std::string& pattern = light_.name(2 * pair);
    return derived() ? pattern : pattern + " and " + light_.name(2 * pair + 1);
  }
  bool derived() const { return light_.photographs.complements_derived; }
  std::string full(int pair) const { return names(pair) + " (" + code().pair(pair).name + ")"; }

  void add(std::vector<Role> roles, std::string text, std::string advice, int pair, bool vague = false) {
    Explanation e{std::move(roles), std::move(text), std::move(advice), vague, pair, 0};
    for (const int s : light_.pairs)
      for (const int t : light_.pairs)
        if (s != t)
          e.likelihood +=
              likelihood_of(votes_.at(s, t), e.roles[s], e.roles[t], votes_.rates(t), votes_.resolved(t));
    all_.push_back(std::move(e));
  }
  void single_pairs() {
    for (const int k : light_.pairs) {
      auto roles = usual();
      roles[k].inverted = true;
      if (derived())
        add(roles, full(k) + " shows the complement of its pattern, or camera or scene has moved before it",
            "photograph the sequence again, with everything fixed", k);
      else
        add(roles, full(k) + " are swapped: the complement comes first", "exchange the two files", k);
      roles = usual();
      roles[k].known = false;
      add(roles, full(k) + " do not show their stripes", "photograph the sequence again", k, true);
      for (const int j : light_.pairs) {
        if (j == k) continue;
        roles = usual();
        roles[k] = roles[j];
        add(roles, fmt::format("{} show the stripes of {}", full(k), names(j)),
            "replace them by the photographs of their own pattern, or photograph the sequence again", k);
      }
    }
  }
  void two_pairs() {
    for (const int a : light_.pairs)
      for (const int b : light_.pairs) {
        if (b <= a) continue;
        auto roles = usual();
        std::swap(roles[a], roles[b]);
        add(roles, fmt::format("{} and {} have changed places", full(a), full(b)), "exchange the two pairs",
            a);
      }
  }
  void whole_sequence() {
    for (int columns = 1; columns < code().pairs(); ++columns)
      if (columns != code().column_bits())
        add(divided(columns),
            fmt::format(
                "the sequence has {} pairs of columns and {} of rows, a projector of {} has {} and {}",
                columns, code().pairs() - columns, to_string(code().projector()), code().column_bits(),
                code().row_bits()),
            "give the size of the projector that showed it, in rows x columns", -1);
    auto roles = usual();
    for (Role& role : roles) role.inverted = true;
    add(roles,
        derived() ? "every photograph shows the complement of its pattern"
                  : "every complement comes before its pattern",
        derived() ? "photograph the patterns" : "exchange the two files of each pair", -1);
    roles = usual();
    for (Role& role : roles)
      role.bit = (role.axis == 0 ? code().column_bits() : code().row_bits()) - 1 - role.bit;
    add(roles, "the finest stripes come first", "name the files so that the widest stripes come first", -1);
  }

  const SequenceLight& light_;
  EdgeVotes votes_;
  std::vector<Explanation> all_;
};

}  // namespace

OrderFinding judge_order(const SequenceLight& light) {
  return Explanations(light).finding();
}

}  // namespace symrig::calibration
