// SPDX-License-Identifier: Apache-2.0
#include "hdr/merge_checks.hpp"
#include "symrig/hdr/response.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

namespace symrig {
namespace {

constexpr double kLeastCodeVariance = 1.0 / 12;  // [DN²] rounding to whole codes
constexpr std::int64_t kFewestDepartures = 256;
constexpr int kCodeBins = 32;
constexpr int kNoiseRounds = 4;
/// Noise and ratios need no more pixels than this.
constexpr std::size_t kPixelsLookedAt = 400'000;

/// Every so many pixels are looked at. Odd, so that no column is left out of a picture of even width.
std::size_t stride_of(std::size_t samples) {
  return samples / kPixelsLookedAt | std::size_t{1};
}

/// A response curve with its slope, and which codes count.
class CurvedCodes {
 public:
  CurvedCodes(const ResponseCurve& curve, const ResponseOptions& usable) : curve_(curve) {
    const int last = static_cast<int>(curve.light.size()) - 1;
    low_ = usable.low;
    high_ = usable.high < 0 ? last : usable.high;
    // Over five codes: a recovered curve is not smooth from code to code.
    for (int c = 0; c <= last; ++c) {
      const int from = std::max(0, c - 2), to = std::min(last, c + 2);
      slope_.push_back((curve.light[to] - curve.light[from]) / (to - from));
    }
  }

  bool usable(int code) const { return code > low_ && code < high_; }
  double light(int code) const { return curve_.light[code]; }
  /// The code that this light is expected at.
  std::size_t code_of(double light) const {
    return static_cast<std::size_t>(std::lround(curve_.code_of(std::clamp(light, 0.0, 1.0))));
  }
  double slope(std::size_t code) const { return slope_[code]; }
  /// Of a sample's light, where its code is expected. variance: of codes.
  double variance_of_light(double light, std::span<const double> variance) const {
    const std::size_t code = code_of(light);
    return slope_[code] * slope_[code] * variance[code];
  }
  std::size_t count() const { return slope_.size(); }

 private:
  const ResponseCurve& curve_;
  int low_ = 0, high_ = 0;
  std::vector<double> slope_;
};

/// One sample of a pixel.
struct CurvedSample {
  double light, time;  ///< of its code, and its exposure [s]
  double weight;       ///< of light / time; estimate() sets it
};

/// The samples of one pixel that count, and their common estimate.
struct CurvedPixel {
  std::array<CurvedSample, 64> samples;
  std::size_t count = 0;
  double rate = 0, weights = 0;  ///< light per second

  /// Weights by the codes that a common rate expects; with the measured codes the first time.
  void estimate(const CurvedCodes& codes, std::span<const double> variance, bool first) {
    double sum = 0;
    const double common = rate;
    weights = 0;
    for (CurvedSample& s : std::span(samples).first(count)) {
      s.weight = s.time * s.time / codes.variance_of_light(first ? s.light : common * s.time, variance);
      weights += s.weight;
      sum += s.weight * s.light / s.time;
    }
    if (weights > 0) rate = sum / weights;
  }
};

CurvedPixel curved_pixel_at(std::span<const Frame> frames, std::size_t at, const CurvedCodes& codes) {
  CurvedPixel pixel;
  for (const Frame& frame : frames) {
    const int code = frame.raw[at];
    if (!codes.usable(code)) continue;
    CurvedSample& sample = pixel.samples[pixel.count++];
    sample.light = codes.light(code);
    sample.time = seconds(frame.exposure);
  }
  return pixel;
}

CurvedPixel estimated_at(std::span<const Frame> frames, std::size_t at, const CurvedCodes& codes,
                         std::span<const double> variance) {
  CurvedPixel pixel = curved_pixel_at(frames, at, codes);
  pixel.estimate(codes, variance, true);
  pixel.estimate(codes, variance, false);
  return pixel;
}

/// What a code differs by from the one that the pixel's other samples expect, squared and less their own
/// noise: an estimate of its variance. share: of the pixel's weight that is not its own.
struct Departure {
  double square, share;
};

/// The variance of bins of codes, from departures. Things that move are far out, so only departures within
/// four deviations count, by their median.
double variance_of(std::vector<Departure>& bin) {
  constexpr double kMedian = 0.4549;  // of the square of a normal quantity of variance 1
  constexpr double kDeviations = 4;
  const auto middle = bin.begin() + static_cast<std::ptrdiff_t>(bin.size() / 2);
  std::nth_element(bin.begin(), middle, bin.end(), [](const Departure& a, const Departure& b) {
    return a.square * b.share < b.square * a.share;
  });
  const double most =
      kDeviations * kDeviations * std::max(kLeastCodeVariance, middle->square / middle->share / kMedian);
  double squares = 0, shares = 0;
  for (const Departure& one : bin) {
    if (one.square > most * one.share) continue;
    squares += one.square;
    shares += one.share;
  }
  return std::max(kLeastCodeVariance, squares / shares);
}

/// Values at centres of bins, linear between them.
std::vector<double> spread_over_codes(const std::vector<double>& centres, const std::vector<double>& values,
                                      std::size_t codes) {
  std::vector<double> all(codes, values.front());
  std::size_t next = 0;
  for (std::size_t c = 0; c < codes; ++c) {
    const auto code = static_cast<double>(c);
    while (next < centres.size() && centres[next] <= code) ++next;
    if (next == centres.size()) {
      all[c] = values.back();
    } else if (next > 0) {
      const double part = (code - centres[next - 1]) / (centres[next] - centres[next - 1]);
      all[c] = values[next - 1] + part * (values[next] - values[next - 1]);
    }
  }
  return all;
}

/// Departures of all samples, by bins of the expected code.
std::vector<std::vector<Departure>> departures(std::span<const Frame> frames, const CurvedCodes& codes,
                                               std::span<const double> variance) {
  constexpr double kLeastShare = 0.1;  // a sample that decides its pixel tells nothing of its own noise
  std::vector<std::vector<Departure>> bins(kCodeBins);
  for (std::size_t at = 0; at < frames[0].raw.size(); at += stride_of(frames[0].raw.size())) {
    const CurvedPixel pixel = estimated_at(frames, at, codes, variance);
    for (const CurvedSample& s : std::span(pixel.samples).first(pixel.count)) {
      const double share = 1 - s.weight / pixel.weights;
      if (share < kLeastShare) continue;
      const std::size_t expected = codes.code_of(pixel.rate * s.time);
      const double departure = (s.light - pixel.rate * s.time) / codes.slope(expected);
      bins[expected * kCodeBins / codes.count()].push_back({departure * departure, share});
    }
  }
  return bins;
}

/// The variance of each code, in a few rounds: weights need it, and it needs weights.
Result<std::vector<double>> code_variance(std::span<const Frame> frames, const CurvedCodes& codes) {
  std::vector<double> variance(codes.count(), 1.0);
  for (int round = 0; round < kNoiseRounds; ++round) {
    std::vector<double> centres, values;
    std::vector<Departure> gathered;
    const auto width = static_cast<double>(codes.count()) / kCodeBins;
    auto bins = departures(frames, codes, variance);
    double from = 0;
    for (int b = 0; b < kCodeBins; ++b) {
      gathered.insert(gathered.end(), bins[b].begin(), bins[b].end());
      if (std::ssize(gathered) < kFewestDepartures) continue;
      centres.push_back((from + (b + 1) * width) / 2);
      values.push_back(variance_of(gathered));
      gathered.clear();
      from = (b + 1) * width;
    }
    if (values.empty())
      return Error{ErrorCode::bad_value, "too few pixels are well exposed in two frames",
                   "take more exposures, each 1.5 to 4 times as long as the one before"};
    variance = spread_over_codes(centres, values, codes.count());
  }
  return variance;
}

/// As exposure_ratios(), with the noise of codes. A curve is known to a few per cent only.
ExposureRatio curved_ratio_of(const Frame& shorter, const Frame& longer, const CurvedCodes& codes,
                              std::span<const double> variance) {
  constexpr double kCurveKnown = 0.05, kWellSeen = 5;  // standard deviations
  ExposureRatio ratio;
  ratio.stated = seconds(longer.exposure) / seconds(shorter.exposure);
  ratio.imperfect = kCurveKnown;
  hdr::fit_ratio(ratio, [&](double r, const auto& use) {
    for (std::size_t at = 0; at < shorter.raw.size(); at += stride_of(shorter.raw.size())) {
      const int cs = shorter.raw[at], cl = longer.raw[at];
      if (!codes.usable(cs) || !codes.usable(cl)) continue;
      const double ls = codes.light(cs), ll = codes.light(cl);
      // The light by both frames, then both variances there.
      const double light = (ls + ll) / (1 + r);
      const double vs = codes.variance_of_light(light, variance);
      if (light < kWellSeen * std::sqrt(vs)) continue;
      use({ls, ll, vs, codes.variance_of_light(r * light, variance)});
    }
  });
  return ratio;
}

Result<void> check_bracket(std::span<const Frame> frames, Grid grid, int channels, const ResponseCurve& curve,
                           const ResponseOptions& usable) {
  constexpr std::size_t kMost = std::tuple_size_v<decltype(CurvedPixel::samples)>;
  if (!grid.valid() || channels < 1) return hdr::bad_argument("the grid is empty");
  if (frames.size() < 2 || frames.size() > kMost)
    return hdr::bad_argument(fmt::format("{} frames: a bracket has 2 to {}", frames.size(), kMost));
  if (curve.light.size() != std::size_t{1} << static_cast<unsigned>(usable.bits))
    return hdr::bad_argument(
        fmt::format("the response curve has {} codes, the frames {} bits", curve.light.size(), usable.bits));
  const std::size_t samples = grid.size() * channels;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (frames[k].exposure <= Nanoseconds{0})
      return hdr::bad_argument(fmt::format("exposure of frame {} is not above 0", k));
    if (frames[k].raw.size() != samples)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("frame {} has {} samples, not {}", k, frames[k].raw.size(), samples)};
    if (*std::max_element(frames[k].raw.begin(), frames[k].raw.end()) >= curve.light.size())
      return Error{ErrorCode::bad_value,
                   fmt::format("frame {} has a code that does not fit in {} bits", k, usable.bits)};
  }
  if (std::all_of(frames.begin(), frames.end(),
                  [&](const Frame& f) { return f.exposure == frames[0].exposure; }))
    return hdr::bad_argument("all frames have one exposure");
  return {};
}

}  // namespace

Result<ResponseMerge> merge_by_response(std::span<const Frame> frames, Grid grid, int channels,
                                        const ResponseCurve& curve, const ResponseOptions& usable) {
  SYMRIG_CHECK(check_bracket(frames, grid, channels, curve, usable));
  const CurvedCodes codes(curve, usable);
  ResponseMerge merged{
      {Image<float>(grid, channels), Image<float>(grid, channels), Image<std::uint8_t>(grid, channels)},
      {},
      {}};
  SYMRIG_TRY(merged.code_variance, code_variance(frames, codes));
  tbb::parallel_for(std::size_t{0}, frames[0].raw.size(), [&](std::size_t at) {
    const CurvedPixel pixel = estimated_at(frames, at, codes, merged.code_variance);
    if (pixel.count == 0) return;
    merged.radiance.mean.values()[at] = static_cast<float>(pixel.rate);
    merged.radiance.variance.values()[at] = static_cast<float>(1 / pixel.weights);
    merged.radiance.valid.values()[at] = 1;
  });
  merged.ratios = hdr::neighbouring_ratios(frames, [&](const Frame& shorter, const Frame& longer) {
    return curved_ratio_of(shorter, longer, codes, merged.code_variance);
  });
  return merged;
}

}  // namespace symrig
