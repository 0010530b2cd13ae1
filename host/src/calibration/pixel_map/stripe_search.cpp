// SPDX-License-Identifier: Apache-2.0
// Compiled for every instruction set that Highway supports, and chosen at run time: most of the decoding time
// is spent here.
#include "calibration/pixel_map/stripe_search.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "calibration/pixel_map/stripe_search.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace symrig::calibration::HWY_NAMESPACE {
namespace {
namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::CappedTag<float, kSteps>;

constexpr int kDoubtful = 3;         // bits of which both values are tried
constexpr float kRivalDistance = 2;  // pixels; positions further away than this are rivals

/// A minimum of χ² over a range of steps. Comparing two takes no branch, because which one is smaller cannot
/// be predicted.
class Valley {
 public:
  Valley() = default;
  /// explained: of Σ D², never negative. Such floats are in the order of their bits.
  Valley(int index, float explained)
      : key_(std::int64_t{std::bit_cast<std::int32_t>(explained)} << 32 |
             (std::numeric_limits<std::int32_t>::max() - index)) {}

  int index() const { return std::numeric_limits<std::int32_t>::max() - static_cast<std::int32_t>(key_); }
  float explained() const { return std::bit_cast<float>(static_cast<std::int32_t>(key_ >> 32)); }
  /// Explains less, or as much further right.
  friend bool operator<(const Valley& a, const Valley& b) { return a.key_ < b.key_; }

 private:
  std::int64_t key_ = -1;
};

/// first: the index of the pixel's first step.
HWY_INLINE Valley best_of(const Steps& explained, int first) {
  const Lanes d;
  auto most = hn::LoadU(d, explained.data());
  for (std::size_t part = hn::Lanes(d); part < kSteps; part += hn::Lanes(d))
    most = hn::Max(most, hn::LoadU(d, explained.data() + part));
  most = hn::MaxOfLanes(d, most);
  for (std::size_t part = 0; part < kSteps; part += hn::Lanes(d)) {
    const auto at = hn::FindFirstTrue(d, hn::Eq(hn::LoadU(d, explained.data() + part), most));
    if (at >= 0) return {first + static_cast<int>(part) + static_cast<int>(at), hn::GetLane(most)};
  }
  return {first, 0};  // not a number
}

HWY_INLINE void explain_all(const Bits& seen, const ShapedPixel& light, std::size_t bits, Steps& to) {
  const Lanes d;
  for (std::size_t part = 0; part < kSteps; part += hn::Lanes(d)) {
    auto along = hn::Zero(d);
    for (std::size_t bit = 0; bit < bits; ++bit)
      along = hn::MulAdd(hn::Set(d, seen[bit]), hn::LoadU(d, light.contrast[bit].data() + part), along);
    along = hn::Max(along, hn::Zero(d));
    hn::StoreU(hn::Div(hn::Mul(along, along), hn::LoadU(d, light.square.data() + part)), d, to.data() + part);
  }
}

/// The bits with the smallest |D|, the smallest first; −1 beyond the last bit. Without branches: which bit is
/// smallest cannot be predicted.
HWY_INLINE std::array<int, kDoubtful> doubtful_bits(const Bits& seen, int bits, int left_out) {
  // Positive floats are in the order of their bits. The last four, which matter to no one, hold the bit's
  // number.
  static_assert(kMaxBits == 16);
  constexpr std::uint32_t kNone = 0xFFFFFFFF, kNumber = 15;
  HWY_ALIGN std::array<std::uint32_t, kMaxBits> sizes;
  for (int bit = 0; bit < kMaxBits; ++bit) {
    const auto size = std::bit_cast<std::uint32_t>(std::abs(seen[bit]));
    sizes[bit] = bit >= bits || bit == left_out ? kNone : (size & ~kNumber) | static_cast<std::uint32_t>(bit);
  }
  const hn::CappedTag<std::uint32_t, kMaxBits> d;
  std::array<int, kDoubtful> found;
  for (int& number : found) {
    auto least = hn::Set(d, kNone);
    for (std::size_t k = 0; k < kMaxBits; k += hn::Lanes(d)) least = hn::Min(least, hn::Load(d, &sizes[k]));
    least = hn::MinOfLanes(d, least);
    number = hn::GetLane(least) == kNone ? -1 : static_cast<int>(hn::GetLane(least) & kNumber);
    for (std::size_t k = 0; k < kMaxBits; k += hn::Lanes(d)) {
      const auto size = hn::Load(d, &sizes[k]);
      hn::Store(hn::IfThenElse(hn::Eq(size, least), hn::Set(d, kNone), size), d, &sizes[k]);
    }
  }
  return found;
}

/// The position of a Gray code of at most kMaxBits.
HWY_INLINE int spelt(unsigned gray) {
  static_assert(kMaxBits == 16);
  for (const int shift : {1, 2, 4, 8}) gray ^= gray >> shift;
  return static_cast<int>(gray);
}

/// The positions that a pixel may see: as its signs say, or with doubtful bits reversed.
class Candidates {
 public:
  Candidates(const Differences& seen, int bits, int left_out, bool bit_value) {
    unsigned gray = 0;
    for (int bit = 0; bit < bits; ++bit) {
      const bool set = bit == left_out ? bit_value : seen.value[bit] > 0;
      gray = 2 * gray + (set ? 1 : 0);
    }
    // The position is linear in the bits, modulo 2.
    as_seen_ = spelt(gray);
    for (const int bit : doubtful_bits(seen.value, bits, left_out)) {
      if (bit < 0) continue;
      turned_[count_] = spelt(1U << (bits - 1 - bit));
      price_[count_++] = seen.value[bit] * seen.value[bit] / seen.variance;
    }
  }

  /// Candidate 0 is as seen. Bit k of a number says whether the doubtful bit k is reversed.
  unsigned size() const { return 1U << count_; }
  int position(unsigned number) const {
    int at = as_seen_;
    for (std::size_t k = 0; k < kDoubtful; ++k) at ^= number >> k & 1U ? turned_[k] : 0;
    return at;
  }
  /// The least χ² of a candidate: all of its reversed differences are left.
  float least_chi2(unsigned number) const {
    float sum = 0;
    for (std::size_t k = 0; k < kDoubtful; ++k) sum += number >> k & 1U ? price_[k] : 0;
    return sum;
  }

 private:
  int as_seen_ = 0;
  std::size_t count_ = 0;
  std::array<int, kDoubtful> turned_{};
  std::array<float, kDoubtful> price_{};
};

/// χ² of one pixel's differences at any position, from the part of them that the position explains.
class Explained {
 public:
  Explained(ShapedLight& light, const Differences& seen) : light_(light), seen_(seen) {
    for (const float value : seen.value) square_ += value * value;
    number_.fill(-1);
  }

  float operator()(int index) { return at(index / kSteps).explained[index % kSteps]; }
  /// Σ (D − a m)² / V.
  float chi2(float explained) const { return (square_ - explained) / seen_.variance; }

  /// The best step within a pixel of `position`.
  Valley valley(int position) {
    const int size = light_.light().size();
    const Valley before = position > 0 ? at(position - 1).best : Valley();
    if (position + 1 == size) return std::max(before, first_of(position));
    return std::max({before, at(position).best, first_of(position + 1)});
  }

 private:
  struct Pixel {
    Steps explained;
    Valley best;
  };

  const Pixel& at(int number) {
    const std::size_t slot = static_cast<std::size_t>(number) % remembered_.size();
    Pixel& pixel = remembered_[slot];
    if (number_[slot] == number) return pixel;
    explain_all(seen_.value, light_.pixel(number), static_cast<std::size_t>(light_.light().bits()),
                pixel.explained);
    number_[slot] = number;
    pixel.best = best_of(pixel.explained, number * kSteps);
    return pixel;
  }
  /// The last position is the first step of the last pixel.
  Valley first_of(int number) { return {number * kSteps, at(number).explained.front()}; }

  ShapedLight& light_;
  const Differences& seen_;
  float square_ = 0;
  // Candidates are often neighbours, so the same pixels are needed again soon.
  std::array<int, 8> number_;
  std::array<Pixel, 8> remembered_;
};

/// Vertex of the parabola through three equidistant values, in steps from the middle one.
HWY_INLINE float vertex(float left, float middle, float right) {
  const float bend = left - 2 * middle + right;
  return bend > 0 ? std::clamp((left - right) / (2 * bend), -0.5F, 0.5F) : 0;
}

}  // namespace

void explain(const Bits& seen, const ShapedPixel& light, std::size_t bits, Steps& to) {
  explain_all(seen, light, bits, to);
}

// Maximum likelihood of a position x and a contrast a ≥ 0, with D_k the difference of pattern and
// complement of bit k, m_k(x) the contrast of the stripes in the footprint around x, and V the variance of
// a difference:
//
//   χ²(x) = min over a of Σ_k (D_k − a m_k(x))² / V = (Σ D² − (Σ D m)² / Σ m²) / V
//
// Only the last term depends on x: `Explained` is its part (Σ D m)² / Σ m². The steps:
// 1. The signs of D spell a Gray code, so a position. Where |D_k| is small, the sign may be wrong: the
//    three smallest ones make 2³ candidates. A reversed bit leaves D_k² / V unexplained, so most candidates
//    are dropped unseen.
// 2. Around each candidate, ± 1 pixel in steps of an eighth, the best step. The light of a pixel's steps is
//    computed at once, and kept, because candidates are often neighbours.
// 3. The best of all is the position; the best one more than two pixels away is its rival.
// 4. A parabola through χ² of the best step and its two neighbours gives the place between steps.
std::optional<StripeSighting> find_position(ShapedLight& light, const Differences& seen, float evidence,
                                            bool bit_value) {
  const StripeLight& table = light.light();
  const Candidates candidates(seen, table.bits(), light.left_out().value_or(-1), bit_value);
  Explained explains(light, seen);
  // The best step of each candidate that can still matter.
  std::array<Valley, 1U << kDoubtful> valleys;
  std::size_t count = 0;
  Valley best;
  float most = std::numeric_limits<float>::infinity();  // χ² of a candidate that can matter
  for (unsigned number = 0; number < candidates.size(); ++number) {
    const int at = candidates.position(number);
    if (at >= table.size() || candidates.least_chi2(number) > most) continue;
    valleys[count] = explains.valley(at);
    best = std::max(best, valleys[count++]);
    most = explains.chi2(best.explained()) + evidence;
  }
  if (count == 0) return std::nullopt;

  StripeSighting found;
  found.index = best.index();
  found.bit_value = bit_value;
  found.chi2 = explains.chi2(best.explained());
  found.rival = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < count; ++i)
    if (std::abs(valleys[i].index() - best.index()) > static_cast<int>(kRivalDistance * kSteps))
      found.rival = std::min(found.rival, explains.chi2(valleys[i].explained()));
  float offset = 0;
  if (best.index() > 0 && best.index() < table.positions() - 1)
    offset = vertex(explains.chi2(explains(best.index() - 1)), found.chi2,
                    explains.chi2(explains(best.index() + 1)));
  found.position = (static_cast<float>(best.index()) + offset) / kSteps;
  return found;
}

}  // namespace symrig::calibration::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace symrig::calibration {

HWY_EXPORT(explain);
HWY_EXPORT(find_position);

void explain(const Bits& seen, const ShapedPixel& light, int bits, Steps& to) {
  HWY_DYNAMIC_DISPATCH(explain)(seen, light, static_cast<std::size_t>(bits), to);
}

std::optional<StripeSighting> find_position(ShapedLight& light, const Differences& seen, float evidence,
                                            bool bit_value) {
  return HWY_DYNAMIC_DISPATCH(find_position)(light, seen, evidence, bit_value);
}

/// 1 / √(a² (Σ m'² − (Σ m m')² / Σ m²) / V)
float deviation(ShapedLight& light, const Differences& seen, int index) {
  const int last = light.light().positions() - 1;
  const int low = std::max(index - 1, 0), high = std::min(index + 1, last);
  const ShapedPixel &before = light.pixel(low / kSteps), &after = light.pixel(high / kSteps),
                    &here = light.pixel(index / kSteps);
  const float per_pixel = static_cast<float>(kSteps) / static_cast<float>(high - low);
  float mm = 0, ms = 0, ss = 0, dm = 0;
  for (std::size_t bit = 0; bit < static_cast<std::size_t>(light.light().bits()); ++bit) {
    const float m = here.contrast[bit][index % kSteps];
    const float slope = (after.contrast[bit][high % kSteps] - before.contrast[bit][low % kSteps]) * per_pixel;
    mm += m * m, ms += m * slope, ss += slope * slope, dm += seen.value[bit] * m;
  }
  if (!(mm > 0)) return std::numeric_limits<float>::infinity();
  const float a = std::max(dm / mm, 0.0F);
  const float information = a * a * (ss - ms * ms / mm) / seen.variance;
  return information > 0 ? 1 / std::sqrt(information) : std::numeric_limits<float>::infinity();
}

ShapedLight::ShapedLight(const StripeLight& light, std::optional<int> left_out)
    : light_(light),
      left_out_(left_out),
      known_(std::make_unique_for_overwrite<ShapedPixel[]>(static_cast<std::size_t>(light.size()))),
      stamp_(static_cast<std::size_t>(light.size()), 0) {}

void ShapedLight::set_shape(const Shape& shape) {
  shape_ = shape;
  ++now_;
}

void ShapedLight::compute(std::size_t pixel) {
  shape_pixel(light_.at(static_cast<int>(pixel)), light_.bits(), shape_, left_out_, known_[pixel]);
  stamp_[pixel] = now_;
}

}  // namespace symrig::calibration
#endif  // HWY_ONCE
