// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence/sequence_check.hpp"

#include "calibration/sequence/sequence_causes.hpp"
#include "calibration/sequence/sequence_light.hpp"
#include "calibration/sequence/sequence_verdicts.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::calibration {
namespace {

/// Pixels on a grid of every `stride`th row and column, away from the border.
struct Sample {
  std::vector<int> rows, cols;
};

constexpr int kBorder = 2;

Sample sample_of(Grid grid) {
  Sample sample;
  const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(grid.size()) / 40'000)));
  for (int r = kBorder; r < grid.rows - kBorder; r += stride) sample.rows.push_back(r);
  for (int c = kBorder; c < grid.cols - kBorder; c += stride) sample.cols.push_back(c);
  return sample;
}

/// pattern + complement ≈ gain (white + black), moved by (dcol, drow) camera pixels. Without complements:
/// pattern ≈ gain (white where it is lit, else black).
struct Match {
  double gain = 1, dcol = 0, drow = 0;
  double shift_sigma = 0;  ///< of the larger of both
  double misfit = 0;       ///< rms of the residual, share of the mean
};

double sum_at(const Image<float>& a, const Image<float>& b, int row, int col) {
  return static_cast<double>(a.at(row, col)) + static_cast<double>(b.at(row, col));
}

/// Least squares over gain and shift, linear in the shift [Lucas81 §4].
Match match(const CodePhotographs& photographs, int pair, const Sample& sample) {
  const Image<float>&p = photographs.image(2 * pair), &n = photographs.image(2 * pair + 1);
  const Image<float>&w = photographs.white(), &b = photographs.black();
  const bool alone = photographs.complements_derived;
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d y = Eigen::Vector3d::Zero();
  double squares = 0, mean = 0, count = 0;
  for (const int r : sample.rows)
    for (const int c : sample.cols) {
      const bool lit = p.at(r, c) > n.at(r, c);
      const auto light = [&](int row, int col) {
        return alone ? static_cast<double>((lit ? w : b).at(row, col)) : sum_at(w, b, row, col);
      };
      const double seen = alone ? static_cast<double>(p.at(r, c)) : sum_at(p, n, r, c);
      const double expected = light(r, c);
      const Eigen::Vector3d u(expected, (light(r, c + 1) - light(r, c - 1)) / 2,
                              (light(r + 1, c) - light(r - 1, c)) / 2);
      a += u * u.transpose();
      y += seen * u;
      squares += seen * seen;
      mean += expected;
      count += 1;
    }
  if (!(mean > 0)) return {};
  a += 1e-9 * a.trace() * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d x = a.ldlt().solve(y);
  const double left = std::max(squares - 2 * y.dot(x) + x.dot(a * x), 0.0) / count;
  const Eigen::Matrix3d inverse = a.inverse();
  return {x[0], -x[1] / x[0], -x[2] / x[0], std::sqrt(left * std::max(inverse(1, 1), inverse(2, 2))),
          std::sqrt(left) / (mean / count)};
}

constexpr double kShift = 0.25, kShiftSigmas = 10;  // camera pixels; a larger shift counts as a movement
constexpr double kLargestMisfit = 0.1;  // interreflection and the projector's edges cost a few percent

bool foreign(const Match& found, double usual_misfit) {
  return found.misfit > kLargestMisfit && found.misfit > 3 * usual_misfit;
}

bool moved(const Match& found) {
  const double shift = std::hypot(found.dcol, found.drow);
  return shift > kShift && shift > kShiftSigmas * found.shift_sigma;
}

/// White and black come last, so photographs before a movement do not match them.
Result<void> check_movement(const CodePhotographs& photographs, const std::vector<Match>& found) {
  const auto first = std::ranges::find_if(found, moved);
  if (first == found.end()) return {};
  const auto last = std::ranges::find_if(found.rbegin(), found.rend(), moved);
  const std::size_t pair = std::distance(last, found.rend()) - 1;
  const std::size_t half =
      std::min<std::ptrdiff_t>(2 * std::ssize(found), 2 * (static_cast<std::ptrdiff_t>(pair) + 1));
  return Error{
      ErrorCode::bad_value,
      fmt::format("camera or scene has moved between {} and {}: by {:.1f} pixels or more against white and "
                  "black",
                  photographs.names[2 * pair], photographs.names[half], std::hypot(first->dcol, first->drow)),
      "photograph the sequence again, with everything fixed"};
}

/// Without complements there are no sums, but patterns from before a movement do not look like white and
/// black.
Result<void> check_picture(const SequenceLight& light, const std::vector<Match>& found, double usual) {
  const auto other = [&](int pair) { return foreign(found[pair], usual); };
  if (!std::ranges::is_partitioned(light.pairs, other)) return {};
  const auto after = std::ranges::partition_point(light.pairs, other);
  if (after == light.pairs.begin() || after == light.pairs.end()) return {};
  const CodePhotographs& photographs = light.photographs;
  const int last = *std::prev(after);
  return Error{
      ErrorCode::bad_value,
      fmt::format(
          "the patterns up to {} do not look like white and black in their lit and dark parts ({:.0f} % "
          "off), the later ones do ({:.0f} %): camera or scene has moved or changed after it",
          photographs.names[2 * static_cast<std::size_t>(last)], 100 * found[last].misfit, 100 * usual),
      "photograph the sequence again, with everything fixed"};
}

/// Finds movements of a fraction of a pixel, which hardly change the sums.
Result<void> check_shifts(const SequenceLight& light) {
  const CodePhotographs& photographs = light.photographs;
  const Sample sample = sample_of(photographs.camera());
  std::vector<Match> found(photographs.code.pairs());
  std::vector<double> misfits;
  for (const int pair : light.pairs) {
    found[pair] = match(photographs, pair, sample);
    misfits.push_back(found[pair].misfit);
  }
  const double usual = median(misfits);
  if (photographs.complements_derived) SYMRIG_CHECK(check_picture(light, found, usual));
  for (Match& one : found)
    if (foreign(one, usual)) one = {};  // its shift has no meaning
  return check_movement(photographs, found);
}

Result<void> check_order(const SequenceLight& light) {
  const OrderFinding found = judge_order(light);
  if (found.right) return {};
  if (found.explanations.size() == 1)
    return Error{ErrorCode::bad_value, found.explanations.front(), found.advice};
  constexpr std::ptrdiff_t kMost = 4;
  const auto end = found.explanations.begin() + std::min(std::ssize(found.explanations), kMost);
  return Error{ErrorCode::bad_value,
               fmt::format("the stripes contradict the order of the photographs; possible causes: {}",
                           fmt::join(found.explanations.begin(), end, "; or ")),
               "put the photographs in order, or photograph the sequence again"};
}

/// A code that begins in the middle of its range shifts the whole map. A larger projector does not: it has
/// positions before that. A swapped coarsest pair also leaves positions out at the beginning; it mirrors the
/// map.
Result<void> check_centred(const SequenceLight& light, const CodeReach& reach) {
  const GrayCode& code = light.photographs.code;
  for (const StripeAxis direction : {StripeAxis::columns, StripeAxis::rows}) {
    const bool rows = direction == StripeAxis::rows;
    const CodeReach::OfAxis& axis = rows ? reach.rows : reach.columns;
    if (axis.first == 0) continue;
    const int all = 1 << code.bits(direction), pair = rows ? code.column_bits() : 0;
    const int offset = (all - (rows ? code.projector().rows : code.projector().cols)) / 2;
    const std::string centred = fmt::format(
        "the pattern lies in the middle of its code, so that all positions are {} too large", offset);
    const std::string swapped = fmt::format("{} and {} ({}) are swapped", light.name(2 * pair),
                                            light.name(2 * pair + 1), code.pair(pair).name);
    const std::string where = fmt::format(
        "the stripes run from {0} {1} to {0} {2}, of {3} positions of their "
        "code{4}: ",
        rows ? "row" : "column", axis.first, axis.last, all,
        reach.mirrored ? ", and the picture is mirrored" : "");
    const std::string begin_at_0 =
        "show a code that begins at 0 (gray_code_patterns() makes it); another projector size does not help";
    if (!axis.swapped) return Error{ErrorCode::bad_value, where + centred, begin_at_0};
    return Error{ErrorCode::bad_value,
                 fmt::format("{}{}, or {}", where, reach.mirrored ? swapped : centred,
                             reach.mirrored ? centred : swapped),
                 reach.mirrored ? "exchange the two files; or " + begin_at_0
                                : begin_at_0 + "; or exchange the two files"};
  }
  return {};
}

Result<void> check_reach(const SequenceLight& light, bool mirrored) {
  CodeReach reach = find_reach_beyond(light);
  reach.mirrored = reach.mirrored != mirrored;
  SYMRIG_CHECK(check_centred(light, reach));
  const GrayCode& code = light.photographs.code;
  const Grid projector = code.projector();
  std::vector<std::string> where;
  std::vector<SequenceCause> causes;
  const auto add = [&](const CodeReach::OfAxis& axis, const char* what, int coarsest) {
    if (axis.farthest == 0) return;
    where.push_back(fmt::format("{} {}", what, axis.farthest));
    if (axis.swapped && reach.mirrored)
      causes.push_back(
          {fmt::format("{} and {} ({}) are swapped, since the map runs backwards", light.name(2 * coarsest),
                       light.name(2 * coarsest + 1), code.pair(coarsest).name),
           "exchange the two files"});
  };
  add(reach.rows, "row", code.column_bits());
  add(reach.columns, "column", 0);
  if (where.empty()) return {};
  if (reach.exchanged && reach.mirrored)
    causes.insert(causes.begin(),
                  {"the rows come before the columns, since the map is mirrored and fits if they "
                   "are exchanged",
                   "name the files by the order: column pairs, row pairs, white, black"});
  const Grid least{std::max(projector.rows, reach.rows.farthest + 1),
                   std::max(projector.cols, reach.columns.farthest + 1)};
  causes.push_back(
      {fmt::format("the stripes reach {}: the projector that showed them is larger than {}",
                   fmt::join(where, " and "), to_string(projector)),
       fmt::format("give its size as projector, or in capture.toml: at least {} in rows x columns",
                   to_string(least))});
  return error_of(causes);
}

/// Two photographs that are equal in every pixel, although each has its own noise. Neighbours are left out: a
/// doubled one usually makes all later ones late, which find_arrangements() tells.
std::vector<SequenceCause> find_copies(const CodePhotographs& photographs) {
  const int count = photographs.code.photographs();
  if (photographs.complements_derived) return {};
  for (int k = 2; k < count; ++k)
    for (int j = 0; j + 1 < k; ++j)
      if (std::ranges::equal(photographs.image(j).values(), photographs.image(k).values()))
        return {{fmt::format("{} and {} are the same photograph: all pixels are equal, noise included",
                             photographs.names[j], photographs.names[k]),
                 "photograph the sequence again, or put the right file in its place"}};
  return {};
}

}  // namespace

Result<void> explain_contradiction(const CodePhotographs& photographs, const Result<void>& finding,
                                   bool definite) {
  const ClearPixels clear = find_clear_pixels(photographs);
  std::vector<SequenceCause> causes = find_arrangements(photographs, clear);
  if (!causes.empty() || !definite)
    if (auto copies = find_copies(photographs); !copies.empty()) causes = std::move(copies);
  if (causes.empty() && !finding) {
    const LightChanges changes(photographs, clear);
    causes = definite ? changes.all() : changes.most();
  }
  return causes.empty() ? finding : Result<void>(error_of(causes));
}

Result<void> check_light(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  const ClearPixels clear = find_clear_pixels(photographs, held_out);
  std::vector<SequenceCause> causes = LightChanges(photographs, clear, held_out).harmful();
  if (causes.empty()) causes = find_sharpening(photographs, clear, held_out);
  return causes.empty() ? Result<void>() : Result<void>(error_of(causes));
}

Result<void> check_sequence(const CodePhotographs& photographs, const DecodeOptions& options) {
  const SequenceLight light = find_sequence_light(photographs, options.held_out_pair);
  if (light.sample.empty() || light.pairs.size() < 2) return explain_contradiction(photographs, {}, false);
  SYMRIG_CHECK(check_saturation(light));
  const SumsVerdict sums = check_sums(light);
  if (!sums.result) {
    if (sums.definite) return explain_contradiction(photographs, sums.result, true);
    // A small movement also changes sums, but its own message says more.
    const Result<void> shifts = sums.change ? check_shifts(light) : Result<void>();
    return explain_contradiction(photographs, shifts ? sums.result : shifts, false);
  }
  if (const auto shifts = check_shifts(light); !shifts)
    return explain_contradiction(photographs, shifts, false);
  if (const auto order = check_order(light); !order) return explain_contradiction(photographs, order, true);
  SYMRIG_CHECK(check_reach(light, options.mirrored));
  const auto causes =
      LightChanges(photographs, find_clear_pixels(photographs, options.held_out_pair), options.held_out_pair)
          .spoiling();
  return causes.empty() ? Result<void>() : Result<void>(error_of(causes));
}

}  // namespace symrig::calibration
