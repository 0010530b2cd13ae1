// SPDX-License-Identifier: Apache-2.0
#include "calibration/first_bounce/light_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// Largest level at which blocks are at least `size` pixels wide. Every level above the single pixels is a
/// product of row and column bands, because all blocks of one band split equally.
int level_of(const BlockTree& tree, int size) {
  int level = 0;
  while (level + 1 < tree.levels() && tree.grid().cols >> (level + 1) >= size &&
         tree.grid().rows >> (level + 1) >= 1)
    ++level;
  return level;
}

/// Middle of each block. starts: the first pixel of each block, and the end.
std::vector<double> centres_of(const std::vector<int>& starts) {
  std::vector<double> centres;
  for (std::size_t i = 0; i + 1 < starts.size(); ++i)
    centres.push_back(0.5 * (starts[i] + starts[i + 1] - 1));
  return centres;
}

std::size_t band(const std::vector<int>& starts, int at) {
  return static_cast<std::size_t>(std::ranges::upper_bound(starts, at) - starts.begin()) - 1;
}

}  // namespace

Surroundings::Surroundings(const BlockTree& tree, int size) {
  const auto level = tree.level(level_of(tree, size));
  std::set<int> rows{tree.grid().rows}, cols{tree.grid().cols};
  for (const Block& b : level) {
    rows.insert(b.row);
    cols.insert(b.col);
  }
  row_starts_.assign(rows.begin(), rows.end());
  col_starts_.assign(cols.begin(), cols.end());
  row_centres_ = centres_of(row_starts_);
  col_centres_ = centres_of(col_starts_);
  blocks_.resize(level.size());
  for (const Block& b : level)
    blocks_[band(row_starts_, b.row) * (col_starts_.size() - 1) + band(col_starts_, b.col)] = &b;
}

std::vector<float> Surroundings::means(std::span<const float> values, const std::vector<int>& starts) {
  std::vector<float> result;
  result.reserve(starts.size());
  for (std::size_t i = 0; i + 1 < starts.size(); ++i)
    result.push_back(std::accumulate(values.begin() + starts[i], values.begin() + starts[i + 1], 0.0F) /
                     static_cast<float>(starts[i + 1] - starts[i]));
  return result;
}

Taps Surroundings::linear_taps(double position, const std::vector<double>& centres) {
  const auto after = std::ranges::upper_bound(centres.begin() + 1, centres.end(), position);
  const auto below = after - 1;
  Taps taps;
  taps.first = static_cast<int>(below - centres.begin());
  taps.count = after == centres.end() ? 1 : 2;
  const double share = taps.count == 1 ? 0 : std::clamp((position - *below) / (*after - *below), 0.0, 1.0);
  taps.weight[0] = static_cast<float>(1 - share);
  taps.weight[1] = static_cast<float>(share);
  return taps;
}

namespace {

// Sets of unknowns: bit i stands for unknown i of (black, direct, near..., far).
constexpr unsigned kBlack = 1, kDirect = 2, kFar = 1U << (2 + kNearSizes);

}  // namespace

/// If no photograph distinguishes two kinds of light, the matrix is singular. This share of its trace keeps
/// it solvable.
double PixelLightFit::ridge() const {
  constexpr double kRidge = 1e-6;
  double trace = 0;
  for (std::size_t i = 0; i < kUnknowns; ++i) trace += a_[i][i];
  return kRidge * trace;
}

/// Σ y² − 2 b x + x A x
double PixelLightFit::squared_residual(const Solver::Vector& x) const {
  double sum = yy_;
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    double row = -2 * b_[i];
    for (std::size_t j = 0; j < kUnknowns; ++j) row += a_[i][j] * x[j];
    sum += x[i] * row;
  }
  return std::max(sum, 0.0);
}

/// Near light of the sizes that are not negligible. Near light cannot be negative, so noise alone would take
/// some of the direct light in every pixel. So the weakest size is removed, one after another, as long as the
/// residual rises by less than `least`² without it.
PixelLightFit::Point PixelLightFit::without_noise(const Solver& solver, double least,
                                                  Solver::Set& allowed) const {
  Point light = solver.minimum(allowed, {.active = kBlack});
  while (true) {
    std::size_t weakest = 0;
    double size = 0;
    for (std::size_t z = 2; z < 2 + kNearSizes; ++z) {
      const double light_of = light.x[z] * std::sqrt(a_[z][z]);
      if (light_of > 0 && (weakest == 0 || light_of < size)) weakest = z, size = light_of;
    }
    if (weakest == 0) return light;
    const Solver::Set fewer = allowed & ~(1U << weakest);
    const Point other = solver.minimum(fewer, light);
    if (squared_residual(other.x) - squared_residual(light.x) > least * least) return light;
    light = other;
    allowed = fewer;
  }
}

PixelLight PixelLightFit::light_of(const Point& point) const {
  PixelLight light;
  light.black = point.x[0];
  light.direct = point.x[1];
  std::copy_n(point.x.begin() + 2, kNearSizes, light.near.begin());
  light.far = point.x[kUnknowns - 1];
  light.squared_residual = squared_residual(point.x);
  return light;
}

PixelLight PixelLightFit::solve(bool lit, double least, double least_near) const {
  const Solver solver(a_, b_, ridge(), kBlack);
  Solver::Set allowed = lit ? Solver::kAll : kBlack | kFar;
  const Point light = without_noise(solver, least_near, allowed);
  const double direct = light.x[1];
  if (direct <= 0) return light_of(light);
  const double deviation = std::sqrt(solver.solved(Solver::kAll, {0, 1})[1]);
  if (direct > least * deviation) return light_of(light);
  return light_of(solver.minimum(Solver::kAll & ~kDirect, {.active = kBlack}));
}

namespace {

/// Direct light above this many sigmas of its noise is kept. A shadow sees only near and far light.
constexpr double kDirectSigmas = 3;
/// A size of near light is kept if it lowers χ² by more than this. Then it predicts other photographs better
/// than without it [Akaike74].
constexpr double kNearGain = 2;

float shown(const GrayCode& code, int index, int position) {
  if (index >= code.white()) return index == code.white() ? 1.0F : 0.0F;
  const bool complement = index % 2 != 0;
  return code.lit(index / 2, position) != complement ? 1.0F : 0.0F;
}

}  // namespace

Footprint footprint(const PixelMap& map, std::size_t pixel, double sigma) {
  return {gaussian_taps(static_cast<double>(map.col.values()[pixel]), sigma, map.projector.cols),
          gaussian_taps(static_cast<double>(map.row.values()[pixel]), sigma, map.projector.rows)};
}

LightModel::LightModel(const CodePhotographs& photographs, const DecodeOptions& options,
                       std::span<const Surroundings> surroundings)
    : surroundings_(surroundings), model_error_(options.policy.model_error) {
  for (int i = 0; i < photographs.code.photographs(); ++i)
    if (i >= photographs.code.white() || i / 2 != options.held_out_pair)
      seen_.push_back(observe(photographs, i));
}

LightModel::Observation LightModel::observe(const CodePhotographs& photographs, int index) const {
  const GrayCode& code = photographs.code;
  Observation o;
  o.pixels = photographs.images[index].values().data();
  if (index < code.white()) o.axis = code.pair(index / 2).axis;
  const bool columns = o.axis == StripeAxis::columns;
  const int size = columns ? code.projector().cols : code.projector().rows;
  o.stripes.reserve(size);
  for (int x = 0; x < size; ++x) o.stripes.push_back(shown(code, index, x));
  for (std::size_t z = 0; z < kNearSizes; ++z)
    o.blocks[z] = columns ? surroundings_[z].column_means(o.stripes) : surroundings_[z].row_means(o.stripes);
  o.mean = std::accumulate(o.stripes.begin(), o.stripes.end(), 0.0) / size;
  return o;
}

PixelLight LightModel::fit(const PixelMap& map, std::size_t pixel, double sigma) const {
  const bool lit = map.mask.values()[pixel] != 0;
  const Footprint foot = lit ? footprint(map, pixel, sigma) : Footprint{};
  std::array<Footprint, kNearSizes> near{};
  for (std::size_t z = 0; lit && z < kNearSizes; ++z)
    near[z] = {surroundings_[z].column_taps(static_cast<double>(map.col.values()[pixel])),
               surroundings_[z].row_taps(static_cast<double>(map.row.values()[pixel]))};
  PixelLightFit fit;
  for (const Observation& o : seen_) {
    const bool columns = o.axis == StripeAxis::columns;
    PatternLight light{static_cast<double>((columns ? foot.col : foot.row).sum(o.stripes)), {}, o.mean};
    for (std::size_t z = 0; z < kNearSizes; ++z)
      light.near[z] = static_cast<double>((columns ? near[z].col : near[z].row).sum(o.blocks[z]));
    fit.add(light, static_cast<double>(o.pixels[pixel]));
  }
  // An edge is not known better than decoding knows it. That error must not count as near light.
  const double model = model_error_ * static_cast<double>(map.contrast.values()[pixel]) / std::numbers::sqrt2;
  return fit.solve(lit, kDirectSigmas * map.noise, std::sqrt(kNearGain) * std::hypot(map.noise, model));
}

std::vector<PixelLight> LightModel::fit_all(const PixelMap& map, double sigma) const {
  std::vector<PixelLight> light(map.mask.values().size());
  tbb::parallel_for(std::size_t{0}, light.size(),
                    [&](std::size_t pixel) { light[pixel] = fit(map, pixel, sigma); });
  return light;
}

double LightModel::squared_residual(const PixelMap& map, double sigma) const {
  const std::size_t pixels = map.mask.values().size();
  const std::size_t stride = std::max<std::size_t>(1, pixels / 3'000) | 1U;
  std::vector<double> squares((pixels + stride - 1) / stride, 0);
  tbb::parallel_for(std::size_t{0}, squares.size(), [&](std::size_t i) {
    if (map.mask.values()[i * stride]) squares[i] = fit(map, i * stride, sigma).squared_residual;
  });
  return std::accumulate(squares.begin(), squares.end(), 0.0);
}

/// Golden-section search: the residual decreases towards the best blur from both sides.
FittedBlur LightModel::best_blur(const PixelMap& map) const {
  constexpr double kGolden = 0.6180339887498949;
  constexpr double kNarrowest = 0.1, kPrecision = 0.05;  // projector pixels
  double low = kNarrowest, high = kLargestSigma;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double at_a = squared_residual(map, a), at_b = squared_residual(map, b);
  while (high - low > kPrecision) {
    if (at_a < at_b) {
      high = std::exchange(b, a);
      at_b = at_a;
      a = high - kGolden * (high - low);
      at_a = squared_residual(map, a);
    } else {
      low = std::exchange(a, b);
      at_a = at_b;
      b = low + kGolden * (high - low);
      at_b = squared_residual(map, b);
    }
  }
  return {(low + high) / 2, std::min(at_a, at_b)};
}

}  // namespace symrig::calibration
