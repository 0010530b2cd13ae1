// SPDX-License-Identifier: Apache-2.0
#include "calibration/stripe_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace symrig::calibration {
namespace {

constexpr int kSteps = StripeLight::kSteps;
constexpr int kDoubtful = 3;  // bits that are tried both ways
constexpr float kApart = 2;   // pixels: positions further than this are rivals

float dot(const Bits& a, const Bits& b) {
  float sum = 0;
  for (std::size_t k = 0; k < kMaxBits; ++k) sum += a[k] * b[k];
  return sum;
}

/// The bits with the smallest differences.
std::array<int, kDoubtful> doubtful_bits(const Differences& seen, int bits, std::optional<int> left_out) {
  std::array<int, kDoubtful> least{-1, -1, -1};
  for (int bit = 0; bit < bits; ++bit) {
    if (bit == left_out) continue;
    int mine = bit;
    for (int& other : least)
      if (other < 0 || std::abs(seen.value[static_cast<std::size_t>(mine)]) <
                           std::abs(seen.value[static_cast<std::size_t>(other)]))
        std::swap(mine, other);
      else
        continue;
  }
  return least;
}

/// The position that Gray bits spell.
int spelt(unsigned gray, int bits) {
  unsigned value = gray;
  for (int shift = 1; shift < bits; shift *= 2) value ^= value >> shift;
  return static_cast<int>(value);
}

unsigned mask_of(int bit, int bits) {
  return bit < 0 ? 0U : 1U << (bits - 1 - bit);
}

/// All positions worth a look, in order, without repetition.
std::vector<int>& candidates(const Differences& seen, int bits, int size, std::optional<int> left_out,
                             bool bit_value) {
  thread_local std::vector<int> found;
  found.clear();
  unsigned gray = 0;
  for (int bit = 0; bit < bits; ++bit) {
    const bool set = bit == left_out ? bit_value : seen.value[static_cast<std::size_t>(bit)] > 0;
    if (set) gray |= mask_of(bit, bits);
  }
  const auto doubtful = doubtful_bits(seen, bits, left_out);
  for (unsigned flips = 0; flips < 1U << kDoubtful; ++flips) {
    unsigned flipped = gray;
    for (std::size_t k = 0; k < kDoubtful; ++k)
      if (flips >> k & 1U) flipped ^= mask_of(doubtful[k], bits);
    if (const int at = spelt(flipped, bits); at < size) found.push_back(at);
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

/// Σ (D − a m)² / V with the best a ≥ 0.
float chi_squared(const Differences& seen, float square, const Bits& m) {
  const float dm = dot(seen.value, m), mm = dot(m, m);
  const float explained = dm > 0 && mm > 0 ? dm * dm / mm : 0;
  return (square - explained) / seen.variance;
}

/// A minimum of χ² over a range of steps.
struct Valley {
  int index = 0;
  float chi2 = std::numeric_limits<float>::infinity();
};

/// Vertex of the parabola through three equidistant values, in steps from the middle one.
float vertex(float left, float middle, float right) {
  const float bend = left - 2 * middle + right;
  return bend > 0 ? std::clamp((left - right) / (2 * bend), -0.5F, 0.5F) : 0;
}

/// Standard deviation of the position: 1 / √(a² (Σ m'² − (Σ m m')² / Σ m²) / V).
float deviation(ShapedLight& light, const Differences& seen, int index) {
  const int last = light.light().positions() - 1;
  const int low = std::max(index - 1, 0), high = std::min(index + 1, last);
  const Bits before = light.at(low), after = light.at(high), m = light.at(index);
  Bits slope{};
  const float per_pixel = static_cast<float>(kSteps) / static_cast<float>(high - low);
  for (std::size_t k = 0; k < kMaxBits; ++k) slope[k] = (after[k] - before[k]) * per_pixel;
  const float mm = dot(m, m), ms = dot(m, slope);
  if (!(mm > 0)) return std::numeric_limits<float>::infinity();
  const float a = std::max(dot(seen.value, m) / mm, 0.0F);
  const float information = a * a * (dot(slope, slope) - ms * ms / mm) / seen.variance;
  return information > 0 ? 1 / std::sqrt(information) : std::numeric_limits<float>::infinity();
}

}  // namespace

ShapedLight::ShapedLight(const StripeLight& light, std::optional<int> left_out)
    : light_(light),
      left_out_(left_out),
      known_(static_cast<std::size_t>(light.positions())),
      stamp_(known_.size(), 0) {}

void ShapedLight::set_shape(const Shape& shape) {
  shape_ = shape;
  ++now_;
}

const Bits& ShapedLight::at(int index) {
  const auto i = static_cast<std::size_t>(index);
  if (stamp_[i] != now_) {
    known_[i] = light_.contrast(index, shape_);
    if (left_out_) known_[i][static_cast<std::size_t>(*left_out_)] = 0;
    stamp_[i] = now_;
  }
  return known_[i];
}

std::optional<Sighting> find_position(ShapedLight& light, const Differences& seen, bool bit_value) {
  const StripeLight& table = light.light();
  const auto& tried = candidates(seen, table.bits(), table.size(), light.left_out(), bit_value);
  if (tried.empty()) return std::nullopt;
  const float square = dot(seen.value, seen.value);
  const auto chi2_at = [&](int index) { return chi_squared(seen, square, light.at(index)); };
  const int last = table.positions() - 1;
  thread_local std::vector<Valley> valleys;
  valleys.clear();
  for (const int at : tried) {
    Valley best;
    for (int i = std::max((at - 1) * kSteps, 0); i <= std::min((at + 1) * kSteps, last); ++i)
      if (const float chi2 = chi2_at(i); chi2 < best.chi2) best = {i, chi2};
    valleys.push_back(best);
  }
  const Valley best = *std::min_element(valleys.begin(), valleys.end(),
                                        [](const Valley& a, const Valley& b) { return a.chi2 < b.chi2; });
  Sighting found;
  found.chi2 = best.chi2;
  found.rival = std::numeric_limits<float>::infinity();
  for (const Valley& v : valleys)
    if (std::abs(v.index - best.index) > static_cast<int>(kApart * kSteps))
      found.rival = std::min(found.rival, v.chi2);
  float offset = 0;
  if (best.index > 0 && best.index < last)
    offset = vertex(chi2_at(best.index - 1), best.chi2, chi2_at(best.index + 1));
  found.position = (static_cast<float>(best.index) + offset) / kSteps;
  found.sigma = deviation(light, seen, best.index);
  return found;
}

}  // namespace symrig::calibration
