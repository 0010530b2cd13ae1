// SPDX-License-Identifier: Apache-2.0
#include "hdr/response_samples.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

namespace symrig {
namespace hdr {

Result<void> check_frames(std::span<const Frame> frames) {
  const auto bad = [](std::string what) {
    return Error{ErrorCode::bad_argument, std::move(what), "give at least two exposures of one still scene"};
  };
  if (frames.size() < 2)
    return bad(fmt::format("a response needs at least two frames; {} given", frames.size()));
  Nanoseconds shortest = frames.front().exposure, longest = shortest;
  for (const Frame& frame : frames) {
    if (frame.raw.size() != frames.front().raw.size() || frame.raw.empty())
      return Error{ErrorCode::size_mismatch,
                   fmt::format("frames have {} and {} samples", frames.front().raw.size(), frame.raw.size()),
                   "give frames of one camera"};
    if (frame.exposure <= Nanoseconds{0}) return bad("an exposure is not above 0");
    shortest = std::min(shortest, frame.exposure);
    longest = std::max(longest, frame.exposure);
  }
  if (seconds(longest) < 1.1 * seconds(shortest)) return bad("all exposures are almost equal");
  return {};
}

UsableCodes usable_codes(const ResponseOptions& options) {
  const int codes = 1 << std::clamp(options.bits, 1, 16);
  return {codes, std::clamp(options.low, 0, codes - 2),
          options.high < 0 ? codes - 1 : std::min(options.high, codes - 1)};
}

double UsableCodes::weight(int code) const {
  if (!usable(code)) return 0;
  const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
  return std::max(0.02, 1 - std::abs(code - middle) / half);
}

std::vector<std::size_t> choose_pixels(std::span<const Frame> frames, const UsableCodes& codes,
                                       std::size_t most) {
  constexpr std::size_t kBins = 64;
  const std::size_t pixels = frames.front().raw.size();
  const std::size_t each = std::max<std::size_t>(1, most / (kBins * frames.size()));
  std::vector<std::size_t> chosen, filled(kBins * frames.size());
  // A stride without a common factor with usual widths covers the whole picture.
  const std::size_t stride = pixels > 7919 ? 7919 : 1;
  for (std::size_t n = 0; n < pixels && chosen.size() < most; ++n) {
    const std::size_t i = pixels % stride == 0 ? n : n * stride % pixels;
    std::size_t usable = 0, place = 0;
    for (std::size_t k = 0; k < frames.size(); ++k)
      if (codes.usable(frames[k].raw[i])) {
        ++usable;
        place = k * kBins + frames[k].raw[i] * kBins / static_cast<std::size_t>(codes.codes);
      }
    if (usable < 2 || filled[place] >= each) continue;
    ++filled[place];
    chosen.push_back(i);
  }
  return chosen;
}

}  // namespace hdr

namespace {

constexpr int kNodes = 256;  // a curve with more codes is interpolated between this many nodes
constexpr std::size_t kPixels = 16384;
constexpr int kRecoveryRounds = 60;
constexpr double kSettled = 1e-6;  // relative change of a light at which the iteration ends

Error too_few(std::size_t pixels) {
  return {ErrorCode::bad_value, fmt::format("only {} pixels are well exposed in two frames", pixels),
          "take exposures two to four times apart, of a scene with dark, medium and bright parts"};
}

/// The unknowns of the curve: codes in at most kNodes groups.
struct Nodes {
  int count, codes_each;
  std::size_t of(int code) const { return static_cast<std::size_t>(std::min(count - 1, code / codes_each)); }
};
Nodes nodes_of(const hdr::UsableCodes& codes) {
  const int each = std::max(1, codes.codes / kNodes);
  return {codes.codes / each, each};
}

/// Interpolates from nodes to codes, with straight lines between the middles of the nodes.
std::vector<double> to_codes(const std::vector<double>& at_nodes, const Nodes& nodes, int codes) {
  std::vector<double> all;
  all.reserve(codes);
  for (int c = 0; c < codes; ++c) {
    const double at = (c + 0.5) / nodes.codes_each - 0.5;
    const double inside = std::clamp(at, 0.0, static_cast<double>(nodes.count - 1));
    const auto below = static_cast<std::size_t>(inside);
    const std::size_t above = std::min(below + 1, at_nodes.size() - 1);
    all.push_back(at_nodes[below] +
                  (inside - static_cast<double>(below)) * (at_nodes[above] - at_nodes[below]));
  }
  return all;
}

/// The same for weights. Codes without samples get no weight.
std::vector<double> weights_of_codes(const std::vector<double>& at_nodes, const Nodes& nodes,
                                     const hdr::UsableCodes& codes) {
  std::vector<double> all;
  all.reserve(codes.codes);
  for (int c = 0; c < codes.codes; ++c) all.push_back(codes.usable(c) ? at_nodes[nodes.of(c)] : 0);
  return all;
}

}  // namespace

/// Eliminates the unknown ln E_i pixel by pixel, so that only the nodes of the curve remain unknown.
Result<ResponseCurve> recover_debevec(std::span<const Frame> frames, const ResponseOptions& options) {
  SYMRIG_CHECK(hdr::check_frames(frames));
  const hdr::UsableCodes codes = hdr::usable_codes(options);
  const Nodes nodes = nodes_of(codes);
  const auto pixels = hdr::choose_pixels(frames, codes, kPixels);
  if (pixels.size() < 16) return too_few(pixels.size());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(nodes.count, nodes.count);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(nodes.count);
  std::vector<double> weights(nodes.count);
  std::int64_t samples = 0;
  for (const std::size_t i : pixels) {
    double total = 0, times = 0;
    for (const Frame& f : frames) {
      const double w = codes.weight(f.raw[i]) * codes.weight(f.raw[i]);
      total += w;
      times += w * std::log(seconds(f.exposure));
    }
    for (const Frame& f : frames) {
      const double w = codes.weight(f.raw[i]) * codes.weight(f.raw[i]);
      if (w <= 0) continue;
      const auto z = static_cast<Eigen::Index>(nodes.of(f.raw[i]));
      a(z, z) += w;
      b(z) += w * (std::log(seconds(f.exposure)) - times / total);
      for (const Frame& g : frames) {
        const double v = codes.weight(g.raw[i]) * codes.weight(g.raw[i]);
        if (v > 0) a(z, static_cast<Eigen::Index>(nodes.of(g.raw[i]))) -= w * v / total;
      }
      weights[z] += w;
      ++samples;
    }
  }
  const double curvature = options.smoothness * static_cast<double>(samples) / nodes.count / 10;
  for (int z = 1; z + 1 < nodes.count; ++z) {
    const Eigen::Vector3d second(1, -2, 1);
    a.block<3, 3>(z - 1, z - 1) += curvature * second * second.transpose();
  }
  // ln light is known up to a constant.
  const int middle = nodes.count / 2;
  a(middle, middle) += static_cast<double>(samples);
  const Eigen::VectorXd g = a.ldlt().solve(b);
  if (!g.allFinite()) return too_few(pixels.size());
  const std::vector<double> log_light(g.data(), g.data() + g.size());
  return hdr::finish_curve(to_codes(log_light, nodes, codes.codes), weights_of_codes(weights, nodes, codes),
                           samples);
}

/// Alternates E_i = Σ w t I(z) / Σ w t² and I(z) = mean of t E over the samples of z. Starts with a straight
/// line.
Result<ResponseCurve> recover_robertson(std::span<const Frame> frames, const ResponseOptions& options) {
  SYMRIG_CHECK(hdr::check_frames(frames));
  const hdr::UsableCodes codes = hdr::usable_codes(options);
  const Nodes nodes = nodes_of(codes);
  const auto pixels = hdr::choose_pixels(frames, codes, kPixels);
  if (pixels.size() < 16) return too_few(pixels.size());
  double longest = 0;
  for (const Frame& f : frames) longest = std::max(longest, seconds(f.exposure));
  std::vector<double> light, sums(static_cast<std::size_t>(nodes.count)), weights(sums.size());
  for (int n = 0; n < nodes.count; ++n) light.push_back((n + 0.5) / nodes.count);
  std::int64_t samples = 0;
  for (int round = 0; round < kRecoveryRounds; ++round) {
    std::fill(sums.begin(), sums.end(), 0);
    std::fill(weights.begin(), weights.end(), 0);
    samples = 0;
    for (const std::size_t i : pixels) {
      double above = 0, below = 0;
      for (const Frame& f : frames) {
        const double t = seconds(f.exposure) / longest, w = codes.weight(f.raw[i]);
        above += w * t * light[nodes.of(f.raw[i])];
        below += w * t * t;
      }
      for (const Frame& f : frames) {
        if (!codes.usable(f.raw[i])) continue;
        const std::size_t z = nodes.of(f.raw[i]);
        sums[z] += seconds(f.exposure) / longest * above / below;
        weights[z] += 1;
        ++samples;
      }
    }
    double change = 0;
    std::vector<double> next = light;
    for (std::size_t z = 0; z < light.size(); ++z)
      if (weights[z] > 0) next[z] = sums[z] / weights[z];
    next = isotonic(next, weights);
    const double scale = next[next.size() / 2];
    if (!(scale > 0)) return too_few(pixels.size());
    for (std::size_t z = 0; z < light.size(); ++z) {
      next[z] = std::max(next[z] / scale, 1e-9);
      change = std::max(change, std::abs(next[z] - light[z]) / (next[z] + light[z]));
    }
    light = std::move(next);
    if (change < kSettled) break;
  }
  for (double& v : light) v = std::log(v);
  return hdr::finish_curve(to_codes(light, nodes, codes.codes), weights_of_codes(weights, nodes, codes),
                           samples);
}

Result<RecoveredResponse> recover_response(std::span<const Frame> frames, const ResponseOptions& options) {
  RecoveredResponse recovered;
  SYMRIG_TRY(recovered.curve, recover_debevec(frames, options));
  SYMRIG_TRY(const ResponseCurve robertson, recover_robertson(frames, options));
  for (std::size_t code = 0; code < robertson.light.size(); ++code)
    recovered.doubt =
        std::max(recovered.doubt, std::abs(recovered.curve.light[code] - robertson.light[code]));
  return recovered;
}

}  // namespace symrig
