// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/camera_errors.hpp"

#include "symrig/acquisition/internal/error_sums.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig {
namespace {

using acquisition::EnergySums;
using acquisition::ErrorSums;
using Order = acquisition::HeldOutOrder;

}  // namespace

SeenCells::SeenCells(const CameraTransport& camera, std::span<const CornerMap> corners)
    : cells_(camera.projector_grid()) {
  constexpr double margin = 0.1;  // [cells]
  const Grid grid = camera.camera_grid();
  for (const CornerMap& map : corners) {
    std::vector<Box>& boxes = boxes_.emplace_back(grid.size());
    tbb::parallel_for(0, grid.rows, [&](int row) {
      for (int col = 0; col < grid.cols; ++col)
        boxes[std::size_t{1} * row * grid.cols + col] = box_of(map, row, col, margin);
    });
  }
  counted_.assign(std::size_t{1} * grid.size() * camera.channels(), 0);
  std::size_t at = 0;
  for (const CameraTransport::Group& group : camera.parts().groups)
    for (std::int32_t k = 0; k < group.pixels; ++k, ++at) {
      const std::int32_t pixel = camera.parts().pixels[at];
      const Box& box = boxes(group.channel)[pixel];
      if (box.bottom >= box.top) counted_[group.channel * grid.size() + pixel] = 1;
    }
}

/// An empty box: the pixel sees something beside the cells.
SeenCells::Box SeenCells::box_of(const CornerMap& corners, int row, int col, double margin) const {
  double top = std::numeric_limits<double>::infinity(), left = top, bottom = -top, right = -top;
  for (const Point& p : outline_of(corners, row, col)) {
    top = std::min(top, p.row), bottom = std::max(bottom, p.row);
    left = std::min(left, p.col), right = std::max(right, p.col);
  }
  if (!(top >= 0 && left >= 0 && bottom <= cells_.rows && right <= cells_.cols)) return {};
  const auto in = [](double v, int most) {
    return static_cast<std::int16_t>(std::clamp(static_cast<int>(std::floor(v)), 0, most - 1));
  };
  return {in(top - margin, cells_.rows), in(left - margin, cells_.cols), in(bottom + margin, cells_.rows),
          in(right + margin, cells_.cols)};
}

std::vector<char> SeenCells::dark(const Image<float>& lit) const {
  // Lit cells above and left of each corner of cells.
  const std::size_t width = std::size_t{1} + cells_.cols;
  std::vector<std::int32_t> before((std::size_t{1} + cells_.rows) * width);
  for (int r = 0; r < cells_.rows; ++r)
    for (int c = 0; c < cells_.cols; ++c)
      before[(r + 1) * width + c + 1] = before[r * width + c + 1] + before[(r + 1) * width + c] -
                                        before[r * width + c] + (lit.at(r, c) != 0 ? 1 : 0);
  std::vector<char> dark = counted_;
  const std::size_t pixels = boxes_.front().size();
  for (std::size_t i = 0; i < dark.size(); ++i) {
    if (dark[i] == 0) continue;
    const Box& box = boxes(static_cast<std::int32_t>(i / pixels))[i % pixels];
    const std::int32_t sum = before[(box.bottom + 1) * width + box.right + 1] -
                             before[box.top * width + box.right + 1] -
                             before[(box.bottom + 1) * width + box.left] + before[box.top * width + box.left];
    if (sum != 0) dark[i] = 0;
  }
  return dark;
}

std::int32_t SeenCells::cell(std::int32_t channel, std::int64_t pixel) const {
  const Box& box = boxes(channel)[pixel];
  return (box.top + box.bottom) / 2 * cells_.cols + (box.left + box.right) / 2;
}

namespace {

/// The held-out photographs, set by set, as the sums of ErrorSums want them.
class HeldOutSums {
 public:
  HeldOutSums(const CameraTransport& camera, const SeenCells& seen, const PhotographLog& log,
              std::size_t sets, Work work)
      : camera_(camera),
        seen_(seen),
        log_(log),
        work_(std::move(work)),
        sums_(camera.parts().cells, sets),
        place_(camera.projector_grid().size()),
        flood_(seen.counted().size()),
        squares_(flood_.size()),
        judged_(flood_.size()) {
    const std::span<const std::int32_t> order = camera.parts().cells.order();
    for (std::size_t t = 0; t < order.size(); ++t) place_[order[t]] = static_cast<std::int32_t>(t);
  }

  Result<void> add(std::span<const std::int64_t> photographs);
  ErrorSums& finish();
  std::vector<float> chi_square() const;
  std::int64_t unjudged() const {
    std::int64_t count = 0;
    for (std::size_t at = 0; at < flood_.size(); ++at)
      count += seen_.counted()[at] != 0 && flood_[at].invalid ? 1 : 0;
    return count;
  }

 private:
  /// Of a sample of the mean of all halves.
  struct Flood {
    float error = 0, photograph = 0, variance = 0;
    bool invalid = false;
  };
  /// Of a sample of a photograph.
  struct Sample {
    double error = 0, photograph = 0, variance = 0;
    bool valid = false;
  };
  void add_sample(std::size_t at, std::span<const Sample> set, std::span<const std::vector<char>> dark);
  double sparse_energy(double lit) const;

  const CameraTransport& camera_;
  const SeenCells& seen_;
  const PhotographLog& log_;
  Work work_;
  ErrorSums sums_;
  std::vector<std::int32_t> place_;  // of a cell in the tree
  std::vector<Flood> flood_;
  std::vector<float> squares_;         // of each sample: sum of error² / variance
  std::vector<std::uint16_t> judged_;  // photographs in that sum
  bool first_ = true;
};

void HeldOutSums::add_sample(std::size_t at, std::span<const Sample> set,
                             std::span<const std::vector<char>> dark) {
  const std::size_t pixels = camera_.camera_grid().size();
  const std::int32_t cell =
      place_[seen_.cell(static_cast<std::int32_t>(at / pixels), static_cast<std::int64_t>(at % pixels))];
  const auto one = [&](std::size_t k, EnergySums& to) {
    const Sample& s = set[k];
    if (s.valid) to.add(cell, s.error, s.photograph, s.photograph - s.error, s.variance);
  };
  const auto less = [&](std::size_t k, std::size_t other, EnergySums& to) {
    const Sample &a = set[k], &b = set[other];
    if (!a.valid || !b.valid) return;
    const double e = a.error - b.error, y = a.photograph - b.photograph;
    to.add(cell, e, y, y - e, a.variance + b.variance);
  };
  less(Order::kHalf, Order::kOtherHalf, sums_.halves);
  if (dark[Order::kSparse][at] != 0 && dark[Order::kOtherSparse][at] != 0)
    less(Order::kSparse, Order::kOtherSparse, sums_.sparse_pairs);
  const auto weight = static_cast<float>(1 / static_cast<double>(sums_.sets));
  for (const std::size_t k : {Order::kHalf, Order::kOtherHalf}) {
    if (dark[k][at] != 0) one(k, sums_.dark_halves);
    Flood& flood = flood_[at];
    flood.invalid = flood.invalid || !set[k].valid;
    flood.error += weight * static_cast<float>(set[k].error);
    flood.photograph += weight * static_cast<float>(set[k].photograph);
    flood.variance += weight * weight * static_cast<float>(set[k].variance);
  }
  if (!first_) return;
  one(Order::kHalf, sums_.half);
  one(Order::kNatural, sums_.natural);
  one(Order::kBar, sums_.bar);
  if (dark[Order::kBar][at] != 0) one(Order::kBar, sums_.outside_bar);
}

Result<void> HeldOutSums::add(std::span<const std::int64_t> photographs) {
  std::vector<Pattern> patterns;
  std::vector<std::vector<char>> dark;
  for (const std::int64_t k : photographs) {
    SYMRIG_TRY(Pattern pattern, log_.pattern(k));
    dark.push_back(seen_.dark(pattern));
    patterns.push_back(std::move(pattern));
  }
  for (const std::size_t k : {Order::kSparse, Order::kOtherSparse})
    for (const float v : patterns[k].values()) sums_.lit += v != 0 ? 1 : 0;
  SYMRIG_TRY(const std::vector<Image<float>> told, camera_.apply_batch(patterns));
  const Grid grid = camera_.camera_grid();
  std::vector<Radiance> rows(photographs.size());
  std::vector<Sample> set(photographs.size());
  for (int first = 0, strip = 0; first < grid.rows; first += kLogStripRows, ++strip) {
    for (std::size_t k = 0; k < rows.size(); ++k) SYMRIG_CHECK(log_.rows(photographs[k], strip, rows[k]));
    const std::size_t begin = std::size_t{1} * first * grid.cols;
    const std::size_t pixels = std::size_t{1} * std::min(kLogStripRows, grid.rows - first) * grid.cols;
    for (int channel = 0; channel < camera_.channels(); ++channel) {
      const int plane = rows[0].mean.channels() == 1 ? 0 : channel;  // of a mosaic
      for (std::size_t i = 0; i < pixels; ++i) {
        const std::size_t at = std::size_t{1} * channel * grid.size() + begin + i;
        for (std::size_t k = 0; k < set.size(); ++k) {
          const double y = rows[k].mean.plane(plane)[i];
          set[k] = {y - static_cast<double>(told[k].values()[at]), y,
                    static_cast<double>(rows[k].variance.plane(plane)[i]),
                    rows[k].valid.plane(plane)[i] != 0};
          if (!set[k].valid || !(set[k].variance > 0)) continue;
          squares_[at] += static_cast<float>(set[k].error * set[k].error / set[k].variance);
          ++judged_[at];
        }
        if (seen_.counted()[at] != 0) add_sample(at, set, dark);
      }
    }
    work_.add(static_cast<std::int64_t>(64 * pixels * set.size()));
  }
  first_ = false;
  return {};
}

/// As for cells: some dozen random patterns as sparse as the pairs.
double HeldOutSums::sparse_energy(double lit) const {
  constexpr int kPatterns = 32, kTogether = 16;
  constexpr std::uint64_t kSeed = 0x5EA4C;
  Random random(kSeed);
  double energy = 0, samples = 0;
  for (int taken = 0; taken < kPatterns; taken += kTogether) {
    std::vector<Image<float>> signs(kTogether, Image<float>(camera_.projector_grid()));
    for (Image<float>& z : signs)
      for (float& v : z.values()) {
        const float sign = random.sign();
        v = random.uniform() < lit ? sign : 0.F;
      }
    const auto photographs = camera_.apply_batch(signs);
    if (!photographs) return 0;
    work_.add(kTogether * camera_.coefficients());
    for (std::size_t k = 0; k < signs.size(); ++k) {
      const std::vector<char> dark = seen_.dark(signs[k]);
      for (std::size_t at = 0; at < dark.size(); ++at) {
        if (dark[at] == 0) continue;
        const double y = (*photographs)[k].values()[at];
        energy += y * y;
        ++samples;
      }
    }
  }
  return samples > 0 ? energy / samples : 0;
}

ErrorSums& HeldOutSums::finish() {
  const std::size_t pixels = camera_.camera_grid().size();
  for (std::size_t at = 0; at < flood_.size(); ++at) {
    if (seen_.counted()[at] == 0 || flood_[at].invalid) continue;
    const std::int32_t cell =
        place_[seen_.cell(static_cast<std::int32_t>(at / pixels), static_cast<std::int64_t>(at % pixels))];
    const double e = flood_[at].error, y = flood_[at].photograph;
    sums_.flood.add(cell, e, y, y - e, flood_[at].variance);
  }
  sums_.lit /= static_cast<double>(place_.size() * sums_.sets);
  const auto dark = static_cast<double>(sums_.dark_halves.samples());
  sums_.dark_share = dark > 0 ? static_cast<double>(sums_.sparse_pairs.samples()) / dark : 1;
  sums_.mean_sparse_energy = [this](double lit) { return sparse_energy(lit); };
  return sums_;
}

/// Pixels that see something beside the cells have one too.
std::vector<float> HeldOutSums::chi_square() const {
  std::vector<float> of_rows;
  of_rows.reserve(camera_.rows());
  const std::size_t pixels = camera_.camera_grid().size();
  for (const CameraTransport::Group& group : camera_.parts().groups)
    for (std::int32_t k = 0; k < group.pixels; ++k) {
      const std::size_t at = group.channel * pixels + camera_.parts().pixels[of_rows.size()];
      of_rows.push_back(judged_[at] > 0 ? squares_[at] / static_cast<float>(judged_[at]) : 0);
    }
  return of_rows;
}

/// Scatter between flood-lit photographs that were taken one after the other, over their stated variances.
/// The level of the lamp is taken out.
Result<double> variance_ratio(const SeenCells& seen, const CameraTransport& camera,
                              const PhotographLog& log) {
  const auto all_lit = [&](std::int64_t k) -> Result<bool> {
    SYMRIG_TRY(const Pattern pattern, log.pattern(k));
    return std::ranges::all_of(pattern.values(), [](float v) { return v == 1; });
  };
  double squares = 0, samples = 0;
  const Grid grid = camera.camera_grid();
  Radiance first, second;
  for (std::int64_t k = log.size() - 1; k > 0; --k) {
    SYMRIG_TRY(const bool one, all_lit(k));
    SYMRIG_TRY(const bool other, all_lit(k - 1));
    if (!one || !other) continue;
    for (int strip = 0; strip * kLogStripRows < grid.rows; ++strip) {
      SYMRIG_CHECK(log.rows(k, strip, first));
      SYMRIG_CHECK(log.rows(k - 1, strip, second));
      const std::size_t begin = std::size_t{1} * strip * kLogStripRows * grid.cols;
      const auto a = first.mean.plane(0), b = second.mean.plane(0);
      const auto counts = [&](std::size_t i) {
        return seen.counted()[begin + i] != 0 && first.valid.plane(0)[i] != 0 &&
               second.valid.plane(0)[i] != 0;
      };
      double both = 0, square = 0;
      for (std::size_t i = 0; i < a.size(); ++i)
        if (counts(i)) both += double{a[i]} * double{b[i]}, square += double{b[i]} * double{b[i]};
      const double level = square > 0 ? both / square : 1;
      for (std::size_t i = 0; i < a.size(); ++i) {
        const double v = double{first.variance.plane(0)[i]} + double{second.variance.plane(0)[i]};
        if (!counts(i) || !(v > 0)) continue;
        squares += std::pow(double{a[i]} - level * double{b[i]}, 2) / v;
        ++samples;
      }
    }
    if (samples > 0) break;
  }
  return samples > 0 ? squares / samples : NoiseCheck::kUnknown;
}

/// What no scatter shows: light that held-out photographs see through the same rows, pixels without a valid
/// photograph, and noise that is stated to some per cent. Without it, 21 of 25 intervals of the flood-lit
/// scene held on bench A (docs/research/camera-pixels.md).
void widen(const TransportErrors& value, TransportErrors& half_width) {
  constexpr double kSystematic = 0.125;
  using E = TransportErrors;
  for (const auto field : {&E::frobenius, &E::indirect, &E::flood, &E::relight_bar, &E::relight_random,
                           &E::relight_natural, &E::bar_indirect})
    half_width.*field = std::hypot(half_width.*field, kSystematic * value.*field);
}

}  // namespace

Result<CameraErrors> estimate_camera_errors(const CameraTransport& camera, const SeenCells& seen,
                                            const PhotographLog& log, std::span<const std::int64_t> held_out,
                                            const NoiseCheck& noise, const Progress& progress) {
  const Work work(progress);
  return stoppable(work, [&]() -> Result<CameraErrors> {
    work.begin("errors on the camera's pixels", 0, log.size());
    const std::size_t further = (held_out.size() - Order::kCount) / Order::kFurther;
    HeldOutSums sums(camera, seen, log, 1 + further, work);
    SYMRIG_CHECK(sums.add(held_out.first(Order::kCount)));
    for (std::size_t k = 0; k < further; ++k)
      SYMRIG_CHECK(sums.add(held_out.subspan(Order::kCount + k * Order::kFurther, Order::kFurther)));
    // What cells do not add up to is what their model of the borders leaves, and the noise of cells is that
    // of pixels after blur was taken out. Pixels have neither.
    NoiseCheck of_pixels = noise;
    of_pixels.shared_ratio = NoiseCheck::kUnknown;
    SYMRIG_TRY(of_pixels.variance_ratio, variance_ratio(seen, camera, log));
    ErrorEstimate estimate = acquisition::estimate_errors(sums.finish(), of_pixels);
    widen(estimate.value, estimate.half_width);
    return CameraErrors{std::move(estimate), sums.chi_square(), sums.unjudged()};
  });
}

}  // namespace symrig
