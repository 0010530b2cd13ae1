// SPDX-License-Identifier: Apache-2.0
#include "hdr/merge_checks.hpp"
#include "hdr/merge_kernel.hpp"
#include "symrig/hdr/merge.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig {
namespace {

constexpr std::size_t kStreamGrain = std::size_t{1} << 14;  // values of one task
/// Exposures with a smaller relative difference count as equal: the board's clock and the camera's jitter
/// cause it.
constexpr double kSame = 1e-3;

/// Σ count tᵏ over the shortest groups. The weights of a pixel need only these sums of its exposures.
struct Moments {
  double t0 = 0, t1 = 0, t2 = 0, t3 = 0;
  double total = 0;  // Σ t of the frames that such a pixel can use

  Moments with(const MergeStream::Group& group) const {
    const double t = group.time, n = group.count;
    return {t0 + n, t1 + n * t, t2 + n * t * t, t3 + n * t * t * t, group.total};
  }
};

/// Converts one pixel's sums to radiance and variance.
struct Weigher {
  double gain, floor;  // of one sample: Var[d] = gain μ t + floor [DN²]
  double unit;         // radiance per DN and unit of time
  double lowest;       // of μ; keeps every variance positive
  std::vector<Moments> shortest;

  void add(std::span<const MergeStream::Group> groups) {
    for (const MergeStream::Group& group : groups)
      shortest.push_back((shortest.empty() ? Moments{} : shortest.back()).with(group));
  }
  /// The number of groups that a pixel can use, from its total time: the longest exposures saturate.
  std::size_t usable(double time) const {
    std::size_t n = shortest.size();
    while (n > 1 && shortest[n - 1].total > time * (1 + kSame)) --n;
    return n - 1;
  }
  struct Estimate {
    double mean, variance;
  };
  /// The pixel must have at least one sample. a + b t is fitted to h(t) = t / v(t) with weights n v(t): the
  /// variance that an error of the weights costs. v(t) is a line in t, so all sums are moments.
  Estimate operator()(double s0, double t0, double s1, double t1) const {
    const double rate = gain * std::max(s0 / t0, lowest);
    const std::size_t n = usable(t0);
    const Moments& m = shortest[n];
    const double w = rate * m.t1 + floor * m.t0, wt = rate * m.t2 + floor * m.t1,
                 wtt = rate * m.t3 + floor * m.t2;
    const double determinant = w * wtt - wt * wt;
    const bool line = n > 0 && determinant > 1e-12 * w * wtt;
    const double b = line ? (w * m.t2 - wt * m.t1) / determinant : 0;
    const double a = line ? (wtt * m.t1 - wt * m.t2) / determinant : m.t1 / w;
    // Σ count (a + b t)² v(t) and Σ count (a + b t) t.
    const double noise = a * a * w + 2 * a * b * wt + b * b * wtt, weight = a * m.t1 + b * m.t2;
    return {unit * (a * s0 + b * s1) / (a * t0 + b * t1), unit * unit * noise / (weight * weight)};
  }
};

}  // namespace

MergeStream::MergeStream(Grid grid, int channels, const NoiseModel& noise)
    : grid_(grid),
      channels_(channels),
      noise_(noise),
      sum_(grid, channels),
      time_(grid, channels),
      weighted_sum_(grid, channels),
      weighted_time_(grid, channels) {}

Result<MergeStream> MergeStream::begin(Grid grid, int channels, const NoiseModel& noise,
                                       std::span<const Nanoseconds> exposures) {
  SYMRIG_CHECK(hdr::check_sensor(grid, channels, noise));
  std::vector<Nanoseconds> sorted(exposures.begin(), exposures.end());
  std::sort(sorted.begin(), sorted.end());
  if (sorted.empty() || sorted.front() <= Nanoseconds{0})
    return hdr::bad_argument("a bracket needs exposures, all above 0", "give the planned exposures");
  MergeStream stream(grid, channels, noise);
  stream.unit_ = seconds(sorted.back());
  double total = 0;
  for (const Nanoseconds exposure : sorted) {
    const double t = seconds(exposure) / stream.unit_;
    total += t;
    if (stream.groups_.empty() || t > stream.groups_.back().time * (1 + kSame))
      stream.groups_.push_back({t, 0, 0});
    stream.groups_.back().count += 1;
    stream.groups_.back().total = total;
  }
  return stream;
}

Result<void> MergeStream::add(const Frame& frame) {
  const std::size_t values = sum_.values().size();
  if (frame.raw.size() != values)
    return Error{ErrorCode::size_mismatch, fmt::format("frame {} has {} samples; the grid needs {}", frames_,
                                                       frame.raw.size(), values)};
  if (frame.exposure <= Nanoseconds{0})
    return hdr::bad_argument(
        fmt::format("the exposure of frame {} is {} ns; it must be above 0", frames_, frame.exposure.count()),
        "give the shutter time measured from the pulse");
  const auto t = static_cast<float>(seconds(frame.exposure) / unit_);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, values, kStreamGrain), [&](const auto& range) {
    const std::size_t at = range.begin();
    hdr::add_frame(frame.raw.data() + at, range.size(), static_cast<float>(noise_.pedestal()),
                   static_cast<float>(noise_.saturation_code()), t,
                   {sum_.values().data() + at, time_.values().data() + at, weighted_sum_.values().data() + at,
                    weighted_time_.values().data() + at});
  });
  ++frames_;
  return {};
}

Result<Radiance> MergeStream::finish(const MergeOptions& options) const {
  SYMRIG_CHECK(hdr::check_options(options, grid_, channels_));
  const double floor = noise_.gain() * noise_.gain() * noise_.floor_variance();
  Weigher weigh{noise_.gain(),
                floor,
                options.scale / (noise_.gain() * unit_),
                -noise_.gain() * noise_.floor_variance() / 2,
                {}};
  weigh.add(groups_);
  Radiance out{Image<float>(grid_, channels_), Image<float>(grid_, channels_),
               Image<std::uint8_t>(grid_, channels_)};
  const std::size_t pixels = grid_.size();
  std::atomic<bool> finite = true;
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, sum_.values().size(), kStreamGrain), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          const std::size_t channel =
              options.dead != nullptr && options.dead->channels() > 1 ? i / pixels : 0;
          const bool dead =
              options.dead != nullptr && options.dead->values()[channel * pixels + i % pixels] != 0;
          const bool black = options.black == nullptr || options.black->valid.values()[i] != 0;
          if (time_.values()[i] <= 0 || dead || !black) continue;
          const auto [mean, variance] =
              weigh(static_cast<double>(sum_.values()[i]), static_cast<double>(time_.values()[i]),
                    static_cast<double>(weighted_sum_.values()[i]),
                    static_cast<double>(weighted_time_.values()[i]));
          const double dark =
              options.black == nullptr ? 0 : static_cast<double>(options.black->mean.values()[i]);
          const double dark_variance =
              options.black == nullptr ? 0 : static_cast<double>(options.black->variance.values()[i]);
          if (!std::isfinite(dark) || !std::isfinite(dark_variance)) finite = false;
          out.mean.values()[i] = static_cast<float>(mean - dark);
          out.variance.values()[i] = static_cast<float>(variance + dark_variance);
          out.valid.values()[i] = 1;
        }
      });
  if (!finite) return Error{ErrorCode::bad_value, "the black photograph contains NaN or infinity"};
  return out;
}

}  // namespace symrig
