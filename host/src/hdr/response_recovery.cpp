// SPDX-License-Identifier: Apache-2.0
#include "hdr/response_samples.hpp"
#include "hdr/straight_camera.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <Eigen/SparseCore>
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

constexpr std::size_t kPixels = 16384;
constexpr int kRecoveryRounds = 60;
constexpr double kSettled = 1e-6;  // relative change of a light at which the iteration ends

Error too_few(std::size_t pixels) {
  return {ErrorCode::bad_value, fmt::format("only {} pixels are well exposed in two frames", pixels),
          "take exposures two to four times apart, of a scene with dark, medium and bright parts"};
}

/// The unknowns of the curve: its values at some codes, with straight lines between them. Light doubles
/// within a few dark codes, so the nodes lie at all codes there, and farther apart at bright ones.
class Nodes {
 public:
  explicit Nodes(const hdr::UsableCodes& codes) : low_(codes.low) {
    constexpr int kCoarsest = 256, kFinest = 16;  // nodes of the whole range, and of a code and what is below
    const int widest = std::max(1, codes.codes / kCoarsest);
    for (int code = codes.low + 1; code < codes.high - 1;
         code += std::clamp((code - codes.low) / kFinest, 1, widest))
      at_.push_back(code);
    at_.push_back(codes.high - 1);
    std::size_t below = 0;
    for (int code = 0; code < codes.codes; ++code) {
      while (below + 2 < at_.size() && code >= at_[below + 1]) ++below;
      if (at_.size() == 1) {
        places_.push_back({0, 0});
        continue;
      }
      const double part = static_cast<double>(code - at_[below]) / (at_[below + 1] - at_[below]);
      places_.push_back({below, std::clamp(part, 0.0, 1.0)});
    }
  }

  /// A code lies between the nodes `below` and `below + 1`.
  struct Place {
    std::size_t below;
    double part;  ///< of the way to the upper one
  };
  /// Codes that the camera does not have are those of its largest one; nothing counts them.
  const Place& of(int code) const {
    return places_[std::min(static_cast<std::size_t>(code), places_.size() - 1)];
  }
  std::size_t count() const { return at_.size(); }
  /// From a node to the next, in ln code.
  double step(std::size_t node) const {
    return std::log(static_cast<double>(at_[node + 1] - low_) / (at_[node] - low_));
  }
  int code(std::size_t node) const { return at_[node]; }

  double value(const std::vector<double>& at_nodes, int code) const {
    const auto [below, part] = of(code);
    return part > 0 ? (1 - part) * at_nodes[below] + part * at_nodes[below + 1] : at_nodes[below];
  }
  void add(std::vector<double>& at_nodes, int code, double value) const {
    const auto [below, part] = of(code);
    at_nodes[below] += (1 - part) * value;
    if (part > 0) at_nodes[below + 1] += part * value;
  }

 private:
  int low_;              ///< the code below the first node
  std::vector<int> at_;  ///< rising
  std::vector<Place> places_;
};

std::vector<double> to_codes(const std::vector<double>& at_nodes, const Nodes& nodes, int codes) {
  std::vector<double> all;
  all.reserve(codes);
  for (int c = 0; c < codes; ++c) all.push_back(nodes.value(at_nodes, c));
  return all;
}

/// The same for weights. Codes without samples get no weight.
std::vector<double> weights_of_codes(const std::vector<double>& at_nodes, const Nodes& nodes,
                                     const hdr::UsableCodes& codes) {
  std::vector<double> all;
  all.reserve(codes.codes);
  for (int c = 0; c < codes.codes; ++c) all.push_back(codes.usable(c) ? nodes.value(at_nodes, c) : 0);
  return all;
}

}  // namespace

/// Eliminates the unknown ln E_i pixel by pixel, so that only the nodes of the curve remain unknown.
Result<ResponseCurve> recover_debevec(std::span<const Frame> frames, const ResponseOptions& options) {
  SYMRIG_CHECK(hdr::check_frames(frames));
  const hdr::UsableCodes codes = hdr::usable_codes(options);
  const Nodes nodes(codes);
  const auto pixels = hdr::choose_pixels(frames, codes, kPixels);
  if (pixels.size() < 16) return too_few(pixels.size());
  const auto count = static_cast<Eigen::Index>(nodes.count());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(count);
  std::vector<double> weights(nodes.count());
  std::int64_t samples = 0;
  for (const std::size_t i : pixels) {
    // Each sample asks for its place on the curve minus the mean over the pixel's samples.
    Eigen::SparseVector<double> mean(count);
    double total = 0, times = 0;
    for (const Frame& f : frames) {
      const double w = codes.weight(f.raw[i]) * codes.weight(f.raw[i]);
      if (w <= 0) continue;
      const auto [below, part] = nodes.of(f.raw[i]);
      const auto z = static_cast<Eigen::Index>(below);
      total += w;
      times += w * std::log(seconds(f.exposure));
      mean.coeffRef(z) += w * (1 - part);
      if (part > 0) mean.coeffRef(z + 1) += w * part;
    }
    for (const Frame& f : frames) {
      const double w = codes.weight(f.raw[i]) * codes.weight(f.raw[i]);
      if (w <= 0) continue;
      const auto [below, part] = nodes.of(f.raw[i]);
      const auto z = static_cast<Eigen::Index>(below);
      const double time = w * (std::log(seconds(f.exposure)) - times / total);
      a(z, z) += w * (1 - part) * (1 - part);
      b(z) += (1 - part) * time;
      if (part > 0) {
        a(z + 1, z + 1) += w * part * part;
        a(z, z + 1) += w * part * (1 - part);
        a(z + 1, z) += w * part * (1 - part);
        b(z + 1) += part * time;
      }
      nodes.add(weights, f.raw[i], w);
      ++samples;
    }
    for (Eigen::SparseVector<double>::InnerIterator one(mean); one; ++one)
      for (Eigen::SparseVector<double>::InnerIterator other(mean); other; ++other)
        a(one.index(), other.index()) -= one.value() * other.value() / total;
  }
  const double curvature =
      options.smoothness * static_cast<double>(samples) / static_cast<double>(count) / 10;
  for (Eigen::Index z = 1; z + 1 < count; ++z) {
    const double before = nodes.step(z - 1), after = nodes.step(z), both = (before + after) / 2;
    const Eigen::Vector3d second(both / before, -both / before - both / after, both / after);
    a.block<3, 3>(z - 1, z - 1) += curvature * second * second.transpose();
  }
  // ln light is known up to a constant.
  const Eigen::Index middle = count / 2;
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
  const Nodes nodes(codes);
  const auto pixels = hdr::choose_pixels(frames, codes, kPixels);
  if (pixels.size() < 16) return too_few(pixels.size());
  double longest = 0;
  for (const Frame& f : frames) longest = std::max(longest, seconds(f.exposure));
  std::vector<double> light, sums(nodes.count()), weights(nodes.count());
  for (std::size_t n = 0; n < nodes.count(); ++n) light.push_back((nodes.code(n) + 0.5) / codes.codes);
  std::int64_t samples = 0;
  for (int round = 0; round < kRecoveryRounds; ++round) {
    std::fill(sums.begin(), sums.end(), 0);
    std::fill(weights.begin(), weights.end(), 0);
    samples = 0;
    for (const std::size_t i : pixels) {
      double above = 0, below = 0;
      for (const Frame& f : frames) {
        const double t = seconds(f.exposure) / longest, w = codes.weight(f.raw[i]);
        above += w * t * nodes.value(light, f.raw[i]);
        below += w * t * t;
      }
      for (const Frame& f : frames) {
        if (!codes.usable(f.raw[i])) continue;
        // The mean over a node's samples of what they miss: of their light itself, it would be off where the
        // samples lie to one side of the node.
        const double missing = seconds(f.exposure) / longest * above / below - nodes.value(light, f.raw[i]);
        nodes.add(sums, f.raw[i], missing);
        nodes.add(weights, f.raw[i], 1);
        ++samples;
      }
    }
    double change = 0;
    std::vector<double> next = light;
    for (std::size_t z = 0; z < light.size(); ++z)
      if (weights[z] > 0) next[z] += sums[z] / weights[z];
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

namespace {

/// Where noise of dark pixels is, light goes to 0 at code 0: it must rise, and by no less than noise moves
/// it.
ResponseCurve straight_curve(const NoiseModel& camera, std::int64_t samples) {
  constexpr double kDarkSigmas = 3;
  const double dark = camera.pedestal(), full = camera.max_code() - dark;
  const double knee = kDarkSigmas * camera.gain() * std::sqrt(camera.floor_variance());
  ResponseCurve curve;
  curve.samples = samples;
  for (int code = 0; code <= camera.max_code(); ++code)
    curve.light.push_back(std::max(code - dark, knee * code / (dark + knee)) / full);
  return curve;
}

}  // namespace

Result<RecoveredResponse> recover_response(std::span<const Frame> frames, const ResponseOptions& options) {
  RecoveredResponse recovered;
  SYMRIG_CHECK(hdr::check_frames(frames));
  recovered.straight = hdr::straight_camera(frames, hdr::usable_codes(options));
  if (recovered.straight) {
    recovered.curve = straight_curve(*recovered.straight, std::ssize(frames[0].raw) * std::ssize(frames));
    return recovered;
  }
  SYMRIG_TRY(recovered.curve, recover_debevec(frames, options));
  SYMRIG_TRY(const ResponseCurve robertson, recover_robertson(frames, options));
  for (std::size_t code = 0; code < robertson.light.size(); ++code)
    recovered.doubt =
        std::max(recovered.doubt, std::abs(recovered.curve.light[code] - robertson.light[code]));
  return recovered;
}

}  // namespace symrig
