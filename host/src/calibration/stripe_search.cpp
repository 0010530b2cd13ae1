// SPDX-License-Identifier: Apache-2.0
#include "calibration/stripe_search.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace symrig::calibration {
namespace {

constexpr int kDoubtful = 3;         // bits of which both values are tried
constexpr float kRivalDistance = 2;  // pixels; positions further away than this are rivals

float dot(const Bits& a, const Bits& b) {
  float sum = 0;
  for (std::size_t k = 0; k < kMaxBits; ++k) sum += a[k] * b[k];
  return sum;
}

/// The bits with the smallest |D|, the smallest first; −1 beyond the last bit. Without branches: which bit is
/// smallest cannot be predicted.
std::array<int, kDoubtful> doubtful_bits(const Differences& seen, int bits, std::optional<int> left_out) {
  // Positive floats are in the order of their bits. The last four, which matter to no one, hold the bit's
  // number.
  static_assert(kMaxBits == 16);
  constexpr std::uint32_t kNone = 0xFFFFFFFF, kNumber = 15;
  std::array<std::uint32_t, kDoubtful> least;
  least.fill(kNone);
  for (int bit = 0; bit < bits; ++bit) {
    const auto size = std::bit_cast<std::uint32_t>(std::abs(seen.value[bit]));
    std::uint32_t mine = bit == left_out ? kNone : (size & ~kNumber) | static_cast<std::uint32_t>(bit);
    for (std::uint32_t& other : least) {
      const std::uint32_t smaller = std::min(other, mine);
      mine = std::max(other, mine);
      other = smaller;
    }
  }
  std::array<int, kDoubtful> found;
  for (std::size_t k = 0; k < kDoubtful; ++k)
    found[k] = least[k] == kNone ? -1 : static_cast<int>(least[k] & kNumber);
  return found;
}

/// The position of a Gray code.
int spelt(unsigned gray, int bits) {
  unsigned value = gray;
  for (int shift = 1; shift < bits; shift *= 2) value ^= value >> shift;
  return static_cast<int>(value);
}

unsigned mask_of(int bit, int bits) {
  return bit < 0 ? 0U : 1U << (bits - 1 - bit);
}

/// The positions that a pixel may see: as its signs say, or with doubtful bits reversed.
class Candidates {
 public:
  Candidates(const Differences& seen, int bits, std::optional<int> left_out, bool bit_value) {
    unsigned gray = 0;
    for (int bit = 0; bit < bits; ++bit) {
      const bool set = bit == left_out ? bit_value : seen.value[bit] > 0;
      if (set) gray |= mask_of(bit, bits);
    }
    // The position is linear in the bits, modulo 2.
    as_seen_ = spelt(gray, bits);
    for (const int bit : doubtful_bits(seen, bits, left_out)) {
      if (bit < 0) continue;
      turned_[count_] = spelt(mask_of(bit, bits), bits);
      price_[count_++] = seen.value[bit] * seen.value[bit] / seen.variance;
    }
  }

  /// Candidate 0 is as seen. Bit k of a number says whether the doubtful bit k is reversed.
  unsigned size() const { return 1U << count_; }
  int position(unsigned number) const {
    int at = as_seen_;
    for (std::size_t k = 0; k < count_; ++k)
      if (number >> k & 1U) at ^= turned_[k];
    return at;
  }
  /// The least χ² of a candidate: all of its reversed differences are left.
  float least_chi2(unsigned number) const {
    float sum = 0;
    for (std::size_t k = 0; k < count_; ++k)
      if (number >> k & 1U) sum += price_[k];
    return sum;
  }

 private:
  int as_seen_ = 0;
  std::size_t count_ = 0;
  std::array<int, kDoubtful> turned_{};
  std::array<float, kDoubtful> price_{};
};

/// A minimum of χ² over a range of steps.
struct Valley {
  int index = 0;
  float explained = -1;  ///< of Σ D²
};

/// χ² of one pixel's differences at any position, from the part of them that the position explains.
class Explained {
 public:
  Explained(ShapedLight& light, const Differences& seen)
      : light_(light), seen_(seen), square_(dot(seen.value, seen.value)) {}

  float operator()(int index) { return at(index / kSteps).explained[index % kSteps]; }
  /// Σ (D − a m)² / V.
  float chi2(float explained) const { return (square_ - explained) / seen_.variance; }

  /// The best step within a pixel of `position`.
  Valley valley(int position) {
    const int size = light_.light().size();
    Valley best = position > 0 ? at(position - 1).best : Valley{};
    const auto take = [&](const Valley& other) {
      if (other.explained > best.explained) best = other;
    };
    take(position + 1 < size ? at(position).best : first_of(position));
    if (position + 1 < size) take(first_of(position + 1));
    return best;
  }

 private:
  struct Pixel {
    int number = -1;
    Steps explained;
    Valley best;
  };

  const Pixel& at(int number) {
    Pixel& pixel = remembered_[static_cast<std::size_t>(number) % remembered_.size()];
    if (pixel.number == number) return pixel;
    explain(seen_.value, light_.pixel(number), light_.light().bits(), pixel.explained);
    pixel.number = number;
    const float* const first = pixel.explained.data();
    const float* const best = std::max_element(first, first + kSteps);
    pixel.best = {number * kSteps + static_cast<int>(best - first), *best};
    return pixel;
  }
  /// The last position is the first step of the last pixel.
  Valley first_of(int number) { return {number * kSteps, at(number).explained.front()}; }

  ShapedLight& light_;
  const Differences& seen_;
  float square_;
  // Candidates are often neighbours, so the same pixels are needed again soon.
  std::array<Pixel, 8> remembered_;
};

/// Vertex of the parabola through three equidistant values, in steps from the middle one.
float vertex(float left, float middle, float right) {
  const float bend = left - 2 * middle + right;
  return bend > 0 ? std::clamp((left - right) / (2 * bend), -0.5F, 0.5F) : 0;
}

}  // namespace

/// 1 / √(a² (Σ m'² − (Σ m m')² / Σ m²) / V)
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

ShapedLight::ShapedLight(const StripeLight& light, std::optional<int> left_out)
    : light_(light),
      left_out_(left_out),
      known_(static_cast<std::size_t>(light.size())),
      stamp_(known_.size(), 0) {}

void ShapedLight::set_shape(const Shape& shape) {
  shape_ = shape;
  ++now_;
}

void ShapedLight::compute(std::size_t pixel) {
  shape_pixel(light_.at(static_cast<int>(pixel)), light_.bits(), shape_, left_out_, known_[pixel]);
  stamp_[pixel] = now_;
}

Bits ShapedLight::at(int index) {
  const ShapedPixel& known = pixel(index / kSteps);
  Bits all{};
  for (std::size_t bit = 0; bit < static_cast<std::size_t>(light_.bits()); ++bit)
    all[bit] = known.contrast[bit][index % kSteps];
  return all;
}

std::optional<Sighting> find_position(ShapedLight& light, const Differences& seen, float evidence,
                                      bool bit_value) {
  const StripeLight& table = light.light();
  const Candidates candidates(seen, table.bits(), light.left_out(), bit_value);
  Explained explains(light, seen);
  // The best step of each candidate that can still matter.
  std::array<Valley, 1U << kDoubtful> valleys;
  std::size_t count = 0;
  Valley best;
  for (unsigned number = 0; number < candidates.size(); ++number) {
    const int at = candidates.position(number);
    if (at >= table.size()) continue;
    if (count > 0 && candidates.least_chi2(number) > explains.chi2(best.explained) + evidence) continue;
    valleys[count] = explains.valley(at);
    if (count == 0 || valleys[count].explained > best.explained) best = valleys[count];
    ++count;
  }
  if (count == 0) return std::nullopt;

  Sighting found;
  found.index = best.index;
  found.bit_value = bit_value;
  found.chi2 = explains.chi2(best.explained);
  found.rival = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < count; ++i)
    if (std::abs(valleys[i].index - best.index) > static_cast<int>(kRivalDistance * kSteps))
      found.rival = std::min(found.rival, explains.chi2(valleys[i].explained));
  float offset = 0;
  if (best.index > 0 && best.index < table.positions() - 1)
    offset =
        vertex(explains.chi2(explains(best.index - 1)), found.chi2, explains.chi2(explains(best.index + 1)));
  found.position = (static_cast<float>(best.index) + offset) / kSteps;
  return found;
}

}  // namespace symrig::calibration
