// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace symrig::sim {

/// One sample of kFftLanes signals that are transformed together.
inline constexpr std::size_t kFftLanes = 8;
using FftLane = std::array<float, kFftLanes>;

/// kFftLanes complex signals: re[n], im[n].
struct LaneSignal {
  explicit LaneSignal(std::size_t length) : re(length), im(length) {}
  std::vector<FftLane> re, im;
};

/// X(k) = Σ_n x(n) e^{−2πi kn/N} of kFftLanes signals at once; N is a power of two. For the inverse (times
/// N), exchange re and im before and after.
/// error: about 6e-8 · log2 N of the signal's norm.
/// source: the self-sorting radix-2 scheme of Stockham, [VanLoan92 §1.7].
/// [VanLoan92 §1.7].
class LaneFft {
 public:
  explicit LaneFft(std::size_t length);
  std::size_t length() const { return length_; }
  /// In place. scratch has the same length.
  void forward(LaneSignal& signal, LaneSignal& scratch) const;

 private:
  std::size_t length_;
  std::vector<float> cos_, sin_;  // of 2πk/N, k < N/2
};

}  // namespace symrig::sim
