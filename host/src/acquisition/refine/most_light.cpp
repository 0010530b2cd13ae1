// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/most_light.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig::acquisition {
namespace {

double sum_of_magnitudes(const float* values, std::size_t n) {
  double sum = 0;
  for (std::size_t k = 0; k < n; ++k) sum += std::abs(static_cast<double>(values[k]));
  return sum;
}

/// Σ over leaves of what each may add to a pixel, in one channel.
class Most {
 public:
  explicit Most(std::size_t pixels) : pixels_(pixels) {}

  /// The leaf a b' and its mirror image.
  void add(const LeafNumbers& at, const float* a, const float* b, bool mirrored) {
    add_side(at.row_begin, a, at.rows, sum_of_magnitudes(b, at.cols));
    if (mirrored) add_side(at.col_begin, b, at.cols, sum_of_magnitudes(a, at.rows));
  }
  void add(const ScalarLeaf& scalar, float value) {
    const double magnitude = std::abs(static_cast<double>(value));
    pixels_[static_cast<std::size_t>(scalar.row)] += magnitude;
    if (scalar.row != scalar.col) pixels_[static_cast<std::size_t>(scalar.col)] += magnitude;
  }
  double largest() const { return *std::max_element(pixels_.begin(), pixels_.end()); }

 private:
  void add_side(std::size_t begin, const float* values, std::size_t n, double light) {
    for (std::size_t k = 0; k < n; ++k)
      pixels_[begin + k] += std::abs(static_cast<double>(values[k])) * light;
  }

  std::vector<double> pixels_;
};

/// add_leaf(most, leaf, its numbers) for the leaves, scalar_values: [scalar][channel].
template <class AddLeaf>
double most_of(const KnownTransport& known, int channels, std::size_t pixels, const AddLeaf& add_leaf,
               const float* scalar_values) {
  double largest = 0;
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels); ++channel) {
    Most most(pixels);
    for (const KnownLeaf& leaf : known.leaves())
      if (!leaf.removed) add_leaf(most, leaf, numbers_of(leaf, channel));
    const auto scalars = known.scalars();
    for (std::size_t k = 0; k < scalars.size(); ++k)
      most.add(scalars[k], scalar_values[k * static_cast<std::size_t>(channels) + channel]);
    largest = std::max(largest, most.largest());
  }
  return largest;
}

}  // namespace

double most_light(const KnownTransport& known, int channels, std::size_t pixels) {
  const float* const value = known.factors().data();
  return most_of(
      known, channels, pixels,
      [&](Most& most, const KnownLeaf& leaf, const LeafNumbers& at) {
        most.add(at, value + at.a, value + at.b, !leaf.diagonal());
      },
      known.scalar_values().data());
}

double most_change(const KnownTransport& known, int channels, std::size_t pixels,
                   const PolishNumbers& direction) {
  const float* const value = known.factors().data();
  return most_of(
      known, channels, pixels,
      [&](Most& most, const KnownLeaf& leaf, const LeafNumbers& at) {
        if (!polished(leaf)) return;
        most.add(at, value + at.a, direction.data() + at.b, true);
        most.add(at, direction.data() + at.a, value + at.b, true);
      },
      direction.data() + known.factors().size());
}

}  // namespace symrig::acquisition
