// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence_check.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Dense>
#include <fmt/format.h>

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

Result<void> check_white(const CodePhotographs& photographs) {
  constexpr double kMostSaturated = 0.02;
  const auto white = photographs.white().values();
  // Integer files hold 1 at their largest code; measured radiance does not meet it by chance.
  const auto saturated = static_cast<double>(std::ranges::count(white, 1.0F));
  const double share = saturated / static_cast<double>(white.size());
  if (share <= kMostSaturated) return {};
  return Error{
      ErrorCode::bad_value,
      fmt::format("{} (white) is saturated in {:.0f} % of its pixels",
                  photographs.names[static_cast<std::size_t>(photographs.code.white())], 100 * share),
      "photograph the sequence again with a shorter exposure"};
}

/// Black is the darkest photograph everywhere.
Result<void> check_black(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  constexpr double kMostLit = 0.1;
  const auto white = photographs.white().values(), black = photographs.black().values();
  double lit = 0, all = 0;
  for (std::size_t i = 0; i < white.size(); ++i) {
    if (!(white[i] > 0)) continue;
    float darkest = white[i];
    for (int k = 0; k < photographs.code.white(); ++k)
      if (k / 2 != held_out) darkest = std::min(darkest, photographs.image(k).values()[i]);
    all += 1;
    lit += black[i] - darkest > 0.25F * (white[i] - darkest) && white[i] > darkest ? 1 : 0;
  }
  if (all == 0 || lit <= kMostLit * all) return {};
  return Error{
      ErrorCode::bad_value,
      fmt::format("{} (black) is lit: over {:.0f} % of its pixels it is brighter than patterns that leave "
                  "them dark",
                  photographs.names[static_cast<std::size_t>(photographs.code.black())], 100 * lit / all),
      "the last photograph must be taken with the projector showing black"};
}

/// pattern + complement ≈ gain (white + black), moved by (dcol, drow) camera pixels.
struct Match {
  double gain = 1, dcol = 0, drow = 0;
  double shift_sigma = 0;  ///< of the larger of both
  double misfit = 0;       ///< rms of what is left, share of the mean
};

double sum_at(const Image<float>& a, const Image<float>& b, int row, int col) {
  return static_cast<double>(a.at(row, col)) + static_cast<double>(b.at(row, col));
}

/// Least squares over gain and shift, linear in the shift [Lucas81 §4].
Match match(const CodePhotographs& photographs, int pair, const Sample& sample) {
  const Image<float>&p = photographs.image(2 * pair), &n = photographs.image(2 * pair + 1);
  const Image<float>&w = photographs.white(), &b = photographs.black();
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d y = Eigen::Vector3d::Zero();
  double squares = 0, mean = 0, count = 0;
  for (const int r : sample.rows)
    for (const int c : sample.cols) {
      const double seen = sum_at(p, n, r, c), expected = sum_at(w, b, r, c);
      const Eigen::Vector3d u(expected, (sum_at(w, b, r, c + 1) - sum_at(w, b, r, c - 1)) / 2,
                              (sum_at(w, b, r + 1, c) - sum_at(w, b, r - 1, c)) / 2);
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

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

std::string names_of(const CodePhotographs& photographs, int pair) {
  return photographs.names[static_cast<std::size_t>(2 * pair)] + " and " +
         photographs.names[static_cast<std::size_t>(2 * pair) + 1];
}

constexpr double kShift = 0.25, kShiftSigmas = 10;  // camera pixels; what counts as moved
constexpr double kMisfit = 0.1;  // interreflection and the projector's edges cost a few percent

bool foreign(const Match& found, double usual_misfit) {
  return found.misfit > kMisfit && found.misfit > 3 * usual_misfit;
}

bool moved(const Match& found) {
  const double shift = std::hypot(found.dcol, found.drow);
  return shift > kShift && shift > kShiftSigmas * found.shift_sigma;
}

/// White and black come last: what was taken before a movement lies off them.
Result<void> check_movement(const CodePhotographs& photographs, const std::vector<Match>& found) {
  const auto first = std::ranges::find_if(found, moved);
  if (first == found.end()) return {};
  const auto last = std::ranges::find_if(found.rbegin(), found.rend(), moved);
  const auto pair = static_cast<std::size_t>(std::distance(last, found.rend()) - 1);
  const auto half = static_cast<std::size_t>(
      std::min<std::ptrdiff_t>(2 * std::ssize(found), 2 * (static_cast<std::ptrdiff_t>(pair) + 1)));
  return Error{
      ErrorCode::bad_value,
      fmt::format("camera or scene has moved between {} and {}: by {:.1f} pixels or more against white and "
                  "black",
                  photographs.names[2 * pair], photographs.names[half], std::hypot(first->dcol, first->drow)),
      "photograph the sequence again, with everything fixed"};
}

Result<void> judge(const CodePhotographs& photographs, int pair, const Match& found, double usual_misfit) {
  constexpr double kGain = 0.1;
  if (foreign(found, usual_misfit))
    return Error{
        ErrorCode::bad_value,
        fmt::format("{} ({}) do not add up to white + black ({:.0f} % off)", names_of(photographs, pair),
                    photographs.code.pair(pair).name, 100 * found.misfit),
        "one of them shows another pattern or exposure, or is out of order"};
  if (std::abs(found.gain - 1) > kGain)
    return Error{ErrorCode::bad_value,
                 fmt::format("{} ({}) add up to {:.2f} times white + black", names_of(photographs, pair),
                             photographs.code.pair(pair).name, found.gain),
                 "exposure or lamp has changed: photograph the sequence with both fixed"};
  return {};
}

Result<void> check_pairs(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  const Sample sample = sample_of(photographs.camera());
  std::vector<Match> found;
  std::vector<double> misfits;
  for (int pair = 0; pair < photographs.code.pairs(); ++pair) {
    found.push_back(pair == held_out ? Match{} : match(photographs, pair, sample));
    if (pair != held_out) misfits.push_back(found.back().misfit);
  }
  const double usual = misfits.empty() ? 0 : median(misfits);
  std::vector<Match> alike = found;
  for (Match& one : alike)
    if (foreign(one, usual)) one = {};  // its shift means nothing
  SYMRIG_CHECK(check_movement(photographs, alike));
  for (int pair = 0; pair < photographs.code.pairs(); ++pair)
    SYMRIG_CHECK(judge(photographs, pair, found[static_cast<std::size_t>(pair)], usual));
  return {};
}

/// Positions along one axis as the signs spell them, −1 where a pixel has little light.
Image<int> spelt(const CodePhotographs& photographs, StripeAxis axis) {
  const GrayCode& code = photographs.code;
  const int first = axis == StripeAxis::columns ? 0 : code.column_bits();
  Image<int> positions(photographs.camera(), 1, -1);
  double mean = 0;
  for (std::size_t i = 0; i < positions.values().size(); ++i)
    mean += static_cast<double>(photographs.white().values()[i] - photographs.black().values()[i]);
  const auto least = static_cast<float>(mean / 2 / static_cast<double>(positions.values().size()));
  for (std::size_t i = 0; i < positions.values().size(); ++i) {
    if (photographs.white().values()[i] - photographs.black().values()[i] < least) continue;
    int bit = 0, value = 0;
    for (int k = first; k < first + code.bits(axis); ++k) {
      bit ^= photographs.image(2 * k).values()[i] > photographs.image(2 * k + 1).values()[i] ? 1 : 0;
      value = 2 * value + bit;
    }
    positions.values()[i] = value;
  }
  return positions;
}

/// Swapping a pair mirrors every position inside its block; block 0: none is swapped.
int mirrored(int position, int block) {
  return block == 0 ? position : 2 * (position / block) * block + block - 1 - position;
}

/// How rough positions are that are mirrored inside blocks: of fine blocks the mean of min(|second
/// difference|, 4), of wide ones the number of jumps over a quarter of `size` (few, as they have few
/// borders).
class Roughness {
 public:
  Roughness(const Image<int>& positions, int size) : positions_(positions), size_(size) {}

  double operator()(int block) const {
    const Grid grid = positions_.grid();
    double sum = 0;
    const int stride = std::max(1, grid.rows / 256);
    for (int r = 0; r < grid.rows; r += stride)
      for (int c = kApart; c + kApart < grid.cols; ++c)
        sum += at(positions_.at(r, c - kApart), positions_.at(r, c), positions_.at(r, c + kApart), block);
    for (int r = kApart; r + kApart < grid.rows; ++r)
      for (int c = 0; c < grid.cols; c += stride)
        sum += at(positions_.at(r - kApart, c), positions_.at(r, c), positions_.at(r + kApart, c), block);
    return sum;
  }

 private:
  static constexpr int kApart = 2, kMost = 4, kFine = 16;

  double at(int a, int b, int c, int block) const {
    if (a < 0 || b < 0 || c < 0) return 0;
    const int second = std::abs(mirrored(a, block) - 2 * mirrored(b, block) + mirrored(c, block));
    if (size_ <= kFine) return std::min(second, kMost);
    return second > size_ / 4 ? 1 : 0;
  }

  const Image<int>& positions_;
  int size_;
};

}  // namespace

std::optional<int> find_swapped_pair(const CodePhotographs& photographs) {
  constexpr double kSmoother = 0.7, kLeast = 20;
  std::optional<int> found;
  double best = kSmoother;
  for (const StripeAxis axis : {StripeAxis::columns, StripeAxis::rows}) {
    const Image<int> positions = spelt(photographs, axis);
    const int bits = photographs.code.bits(axis);
    const int first = axis == StripeAxis::columns ? 0 : photographs.code.column_bits();
    for (int bit = 1; bit < bits; ++bit) {
      const int block = 1 << (bits - bit);
      const Roughness roughness(positions, block);
      const double as_is = roughness(0);
      const double ratio = as_is > kLeast ? roughness(block) / as_is : 1;
      if (ratio < best) {
        best = ratio;
        found = first + bit;
      }
    }
  }
  return found;
}

Result<void> check_sequence(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  SYMRIG_CHECK(check_white(photographs));
  SYMRIG_CHECK(check_black(photographs, held_out));
  SYMRIG_CHECK(check_pairs(photographs, held_out));
  if (held_out) return {};
  if (const auto swapped = find_swapped_pair(photographs))
    return Error{ErrorCode::bad_value,
                 fmt::format("{} ({}) are swapped: the complement comes first",
                             names_of(photographs, *swapped), photographs.code.pair(*swapped).name),
                 "exchange the two files"};
  return {};
}

}  // namespace symrig::calibration
