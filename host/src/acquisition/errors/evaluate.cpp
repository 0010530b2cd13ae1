// SPDX-License-Identifier: Apache-2.0
// The patterns that errors and reports are made with.
#include "symrig/acquisition/evaluate.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

/// Value noise of one octave: random heights on a lattice of `cells` steps across the longer side,
/// cosine-interpolated.
void add_octave(Image<float>& picture, int cells, float weight, unsigned seed) {
  const Grid grid = picture.grid();
  const double step = static_cast<double>(std::max(grid.rows, grid.cols)) / cells;
  const int side = cells + 2;
  std::vector<float> lattice(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  Random random(seed * 1000003ULL + static_cast<unsigned>(cells));
  for (float& h : lattice) h = static_cast<float>(random.uniform());
  const auto height = [&](int y, int x) {
    return lattice[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) +
                   static_cast<std::size_t>(x)];
  };
  const auto smooth = [](double t) { return static_cast<float>(0.5 - 0.5 * std::cos(3.14159265358979 * t)); };
  for (int row = 0; row < grid.rows; ++row) {
    const int y = static_cast<int>(row / step);
    const float v = smooth(row / step - y);
    for (int col = 0; col < grid.cols; ++col) {
      const int x = static_cast<int>(col / step);
      const float u = smooth(col / step - x);
      const float top = height(y, x) * (1 - u) + height(y, x + 1) * u;
      const float bottom = height(y + 1, x) * (1 - u) + height(y + 1, x + 1) * u;
      picture.at(row, col) += weight * (top * (1 - v) + bottom * v);
    }
  }
}

}  // namespace

Image<float> bar_pattern(Grid grid) {
  Image<float> pattern(grid);
  const int first = grid.cols * 5 / 16;
  const int last = std::max(first + 1, grid.cols * 7 / 16);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = first; col < last; ++col) pattern.at(row, col) = 1;
  return pattern;
}

Image<float> natural_pattern(Grid grid, unsigned seed) {
  Image<float> pattern(grid);
  for (const int cells : {3, 7, 17, 41}) add_octave(pattern, cells, 1.0F / static_cast<float>(cells), seed);
  const auto [low, high] = std::minmax_element(pattern.values().begin(), pattern.values().end());
  const float floor = *low;
  const float span = *high > *low ? *high - *low : 1;
  for (float& v : pattern.values()) v = (v - floor) / span;
  return pattern;
}

Image<float> random_pattern(Grid grid, unsigned seed) {
  Image<float> pattern(grid);
  Random random(seed);
  for (float& v : pattern.values()) v = random.sign() > 0 ? 1.0F : 0.0F;
  return pattern;
}

namespace {

/// Squared norms gathered over pixels, channels and random vectors, less what noise adds to them.
struct Squares {
  double error = 0, truth = 0, everything = 0;
  double error_noise = 0;  ///< variance of error by the photographs' noise

  Squares& operator+=(const Squares& other) {
    error += other.error;
    truth += other.truth;
    everything += other.everything;
    error_noise += other.error_noise;
    return *this;
  }

  /// ‖error‖/‖truth‖. Where the truth is exactly dark (a plane has no indirect light), the error is a share
  /// of the whole photograph instead. It is still 0 only for a tensor that is dark there too.
  double relative() const {
    if (truth > 0) return std::sqrt(std::max(0.0, error) / truth);
    return error > 0 && everything > 0 ? std::sqrt(error / everything) : 0;
  }
};

using Seen = std::vector<char>;  ///< pixels, or samples, that count; empty = all

/// What a photograph should be, with its variance.
using Truth = std::function<Result<Radiance>(const Image<float>& pattern)>;

class TruthComparison {
 public:
  TruthComparison(const TransportOperator& tensor, Truth truth) : tensor_(tensor), truth_(std::move(truth)) {}

  /// Adds ‖T̃p − Tp‖² and ‖Tp‖² over the pixels of each mask.
  Result<void> add(const Image<float>& pattern,
                   std::initializer_list<std::pair<const Seen*, Squares*>> masks) const {
    SYMRIG_TRY(const Image<float> estimate, tensor_.apply(pattern));
    SYMRIG_TRY(const Radiance exact, truth_(pattern));
    const Image<float>& mean = exact.mean;
    if (mean.grid() != estimate.grid() || mean.channels() != estimate.channels())
      return Error{ErrorCode::size_mismatch,
                   "the truth is " + to_string(mean.grid()) + " with " + std::to_string(mean.channels()) +
                       " channels, the tensor " + to_string(estimate.grid()) + " with " +
                       std::to_string(estimate.channels()),
                   "evaluate against the rig that the scene was captured with"};
    bool compared = false;
    for (std::size_t i = 0; i < mean.values().size(); ++i) {
      if (exact.valid.values()[i] == 0) continue;
      compared = true;
      const double t = mean.values()[i], variance = exact.variance.values()[i];
      const double e = static_cast<double>(estimate.values()[i]) - t;
      if (!std::isfinite(e) || !std::isfinite(variance))
        return Error{ErrorCode::bad_value,
                     fmt::format("{} of pixel {} is not a finite number",
                                 !std::isfinite(t)          ? "the truth"
                                 : !std::isfinite(variance) ? "the variance of the truth"
                                                            : "the tensor's light",
                                 i % mean.grid().size()),
                     "look for invalid pixels or values in what it is compared with"};
      for (const auto& [seen, squares] : masks) {
        squares->everything += t * t - variance;
        if (!seen->empty() && (*seen)[i % seen->size()] == 0) continue;
        squares->error += e * e - variance;
        squares->error_noise += 4 * variance * e * e - 2 * variance * variance;  // Var[e²]
        squares->truth += t * t - variance;
      }
    }
    if (compared) return {};
    return Error{ErrorCode::bad_value, "no pixel of a photograph to compare with is valid",
                 "lower the exposures, or see whether the camera is covered"};
  }

 private:
  const TransportOperator& tensor_;
  Truth truth_;
};

/// A truth without noise.
Truth exactly(const TrueTransport& truth) {
  return [&truth](const Image<float>& pattern) -> Result<Radiance> {
    SYMRIG_TRY(Image<float> mean, truth(pattern));
    const Grid grid = mean.grid();
    const int channels = mean.channels();
    return Radiance{std::move(mean), Image<float>(grid, channels), Image<std::uint8_t>(grid, channels, 1)};
  };
}

/// Positive and negative light apart: what a projector can show. Empty: there is none of that sign.
std::vector<Pattern> parts_of(const Image<float>& pattern) {
  std::vector<Pattern> parts;
  for (const float sign : {1.F, -1.F}) {
    Pattern part(pattern.grid());
    bool lit = sign > 0;  // a dark pattern is a photograph too
    for (std::size_t i = 0; i < pattern.values().size(); ++i) {
      part.values()[i] = std::max(0.F, sign * pattern.values()[i]);
      lit = lit || part.values()[i] > 0;
    }
    if (lit) parts.push_back(std::move(part));
  }
  return parts;
}

/// Photographs of a probe: T p₊ − T p₋.
Truth photographed(Probe& probe, const Progress& progress, std::int64_t photographs) {
  return [&probe, progress, photographs,
          done = std::int64_t{0}](const Image<float>& pattern) mutable -> Result<Radiance> {
    if (progress && !progress({"photographs to compare with", done, photographs, kNoneToCome}))
      return Error{ErrorCode::interrupted, "stopped before the comparison was done", "nothing was written"};
    const std::vector<Pattern> parts = parts_of(pattern);
    SYMRIG_TRY(std::vector<Radiance> taken, probe.measure(parts));
    done += static_cast<std::int64_t>(parts.size());
    Radiance out = std::move(taken[0]);
    if (parts.size() == 1) return out;
    for (std::size_t i = 0; i < out.mean.values().size(); ++i) {
      out.mean.values()[i] -= taken[1].mean.values()[i];
      out.variance.values()[i] += taken[1].variance.values()[i];
      out.valid.values()[i] = out.valid.values()[i] != 0 && taken[1].valid.values()[i] != 0 ? 1 : 0;
    }
    return out;
  };
}

/// The brighter half of a picture, fully lit.
Image<float> cut_at_median(Image<float> picture) {
  std::vector<float> sorted(picture.values().begin(), picture.values().end());
  const float middle = median(sorted);
  for (float& value : picture.values()) value = value >= middle ? 1.F : 0.F;
  return picture;
}

struct Told {
  double value, half_width;
};

/// Half of the interval that noise leaves: two standard deviations of the squared error.
double noise_width(const Squares& of) {
  constexpr double kSigmas = 2;
  const double value = of.relative();
  if (!(of.error_noise > 0) || !(of.truth > 0)) return 0;
  const double high = std::max(0.0, of.error) + kSigmas * std::sqrt(of.error_noise);
  const double low = of.error - kSigmas * std::sqrt(of.error_noise);
  return std::max(std::sqrt(high / of.truth) - value, value - std::sqrt(std::max(0.0, low) / of.truth));
}

Told told(const Squares& of) {
  return {of.relative(), noise_width(of)};
}

/// Several random vectors: what leaving each one out changes. Few vectors: Student's t instead of two
/// standard deviations, 2 (1 + 1.2 / degrees of freedom) to a per cent from three degrees on.
Told told(const std::vector<Squares>& probes) {
  Squares all;
  for (const Squares& one : probes) all += one;
  const auto n = static_cast<double>(probes.size());
  if (probes.size() < 2) return {all.relative(), all.relative()};
  double mean = 0, squares = 0;
  for (const Squares& out : probes) {
    Squares left;
    for (const Squares& one : probes)
      if (&one != &out) left += one;
    const double value = left.relative();
    mean += value / n;
    squares += value * value;
  }
  const double variance = std::max(0.0, squares - n * mean * mean) * (n - 1) / n;
  return {all.relative(), 2 * (1 + 1.2 / (n - 1)) * std::sqrt(variance) + noise_width(all)};
}

Result<ErrorEstimate> compare_all(const TransportOperator& tensor, const TruthComparison& compare,
                                  const Image<float>& natural_light, const EvaluateOptions& options) {
  const Grid grid = tensor.projector_grid();
  const std::size_t pixels = grid.size();
  const bool own = options.seen != nullptr;
  const bool coaxial = own || grid == tensor.camera_grid();
  const Seen all = own ? options.seen(nullptr) : Seen();
  Random random(options.seed);
  std::vector<Squares> frobenius(std::max(0, options.probes));
  std::vector<Squares> indirect = frobenius;
  Squares flood, bar, bar_outside, random_light, natural;
  for (std::size_t k = 0; k < frobenius.size(); ++k) {
    Image<float> z(grid);
    for (float& v : z.values()) v = random.sign();
    SYMRIG_CHECK(compare.add(z, {{&all, &frobenius[k]}}));
    Seen dark(pixels, 1);
    for (std::size_t i = 0; i < pixels; ++i) {
      const bool lit = random.uniform() < 1.0 / 16;
      z.values()[i] = lit ? random.sign() : 0;
      dark[i] = lit ? 0 : 1;
    }
    if (own) dark = options.seen(&z);
    if (coaxial) SYMRIG_CHECK(compare.add(z, {{&dark, &indirect[k]}}));
  }
  const Image<float> bar_light = bar_pattern(grid);
  Seen outside(pixels);
  for (std::size_t i = 0; i < pixels; ++i) outside[i] = bar_light.values()[i] == 0 ? 1 : 0;
  if (own) outside = options.seen(&bar_light);
  SYMRIG_CHECK(compare.add(Image<float>(grid, 1, 1.0F), {{&all, &flood}}));
  SYMRIG_CHECK(compare.add(random_pattern(grid, options.seed + 1), {{&all, &random_light}}));
  SYMRIG_CHECK(compare.add(natural_light, {{&all, &natural}}));
  if (coaxial) {
    SYMRIG_CHECK(compare.add(bar_light, {{&all, &bar}, {&outside, &bar_outside}}));
  } else {
    SYMRIG_CHECK(compare.add(bar_light, {{&all, &bar}}));
  }
  const Told f = told(frobenius), i = told(indirect), e = told(flood), b = told(bar), r = told(random_light),
             n = told(natural), o = told(bar_outside);
  return ErrorEstimate{
      {f.value, i.value, e.value, b.value, r.value, n.value, o.value},
      {f.half_width, i.half_width, e.half_width, b.half_width, r.half_width, n.half_width, o.half_width},
      {}};
}

}  // namespace

Result<ErrorEstimate> measure_errors(const TransportOperator& tensor, const TrueTransport& truth,
                                     const EvaluateOptions& options) {
  const Image<float> natural = natural_pattern(tensor.projector_grid(), options.seed + 2);
  return compare_all(tensor, TruthComparison(tensor, exactly(truth)), natural, options);
}

Result<ErrorEstimate> measure_errors(const TransportOperator& tensor, Probe& probe,
                                     const EvaluateOptions& options, const Progress& progress) {
  const Image<float> natural = cut_at_median(natural_pattern(tensor.projector_grid(), options.seed + 2));
  const std::int64_t photographs = std::int64_t{4} * options.probes + 4;
  return compare_all(tensor, TruthComparison(tensor, photographed(probe, progress, photographs)), natural,
                     options);
}

Result<TransportErrors> evaluate(const TransportOperator& tensor, const TrueTransport& truth,
                                 const EvaluateOptions& options) {
  SYMRIG_TRY(const ErrorEstimate measured, measure_errors(tensor, truth, options));
  return measured.value;
}

Result<TransportErrors> evaluate(const TransportOperator& tensor, Probe& probe,
                                 const EvaluateOptions& options, const Progress& progress) {
  SYMRIG_TRY(const ErrorEstimate measured, measure_errors(tensor, probe, options, progress));
  return measured.value;
}

}  // namespace symrig
