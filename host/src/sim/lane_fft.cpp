// SPDX-License-Identifier: Apache-2.0
#include "sim/lane_fft.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace symrig::sim {

namespace {

/// top = a + b, low = (a − b) e^{−iφ}, with cos φ = c and sin φ = s.
struct Butterfly {
  float c, s;

  void operator()(const FftLane& a_re, const FftLane& a_im, const FftLane& b_re, const FftLane& b_im,
                  FftLane& top_re, FftLane& top_im, FftLane& low_re, FftLane& low_im) const {
    for (std::size_t k = 0; k < kFftLanes; ++k) {
      const float re = a_re[k] - b_re[k];
      const float im = a_im[k] - b_im[k];
      top_re[k] = a_re[k] + b_re[k];
      top_im[k] = a_im[k] + b_im[k];
      low_re[k] = re * c + im * s;
      low_im[k] = im * c - re * s;
    }
  }
};

}  // namespace

LaneFft::LaneFft(std::size_t length) : length_(length) {
  for (std::size_t k = 0; k < length / 2; ++k) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(length);
    cos_.push_back(static_cast<float>(std::cos(angle)));
    sin_.push_back(static_cast<float>(std::sin(angle)));
  }
}

void LaneFft::forward(LaneSignal& signal, LaneSignal& scratch) const {
  LaneSignal* from = &signal;
  LaneSignal* to = &scratch;
  const std::size_t half = length_ / 2;
  for (std::size_t stride = 1; stride < length_; stride *= 2) {
    for (std::size_t first = 0; first < half; first += stride) {
      const Butterfly butterfly{cos_[first], sin_[first]};
      for (std::size_t at = first; at < first + stride; ++at)
        butterfly(from->re[at], from->im[at], from->re[at + half], from->im[at + half], to->re[at + first],
                  to->im[at + first], to->re[at + first + stride], to->im[at + first + stride]);
    }
    std::swap(from, to);
  }
  if (from != &signal) std::swap(signal, scratch);
}

}  // namespace symrig::sim
