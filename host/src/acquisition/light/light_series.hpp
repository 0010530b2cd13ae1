// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "symrig/base/paged_vector.hpp"
#include "symrig/image/image.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace symrig::acquisition {

/// A photograph with what was lit, all channels added, in raster order.
struct LightPhotograph {
  std::string name;               ///< "a random half"
  std::vector<std::uint8_t> lit;  ///< 1 where the pattern is white
  PagedVector<float> mean, variance;
};

/// Fewer pixels tell nothing.
inline constexpr std::int64_t kFewestPixels = 16;

/// The first photographs of a capture: flood-lit, then those of Checks, in the order in which they were
/// taken.
class LightSeries {
 public:
  /// Their places. The first four patterns after the flood-lit one are random.
  enum Place : std::size_t { kFlood, kHalf, kOtherHalf, kSparse, kOtherSparse, kBar, kPicture, kCount };

  /// checks: may be missing; then only the flood-lit photograph is known.
  LightSeries(const BlockTree& tree, const TreePhotograph& flood, const Checks* checks);

  Grid grid() const { return grid_; }
  std::size_t size() const { return photographs_.size(); }
  const LightPhotograph& operator[](std::size_t k) const { return photographs_[k]; }
  /// 1 where every photograph can be trusted.
  std::span<const std::uint8_t> valid() const { return valid_; }
  std::int64_t pixels() const { return pixels_; }  ///< valid ones

  /// A sum over pixels, and its standard deviation by the variances that are stated.
  struct Sum {
    double value = 0, sigma = 0;
    bool above(double sigmas) const { return value > sigmas * sigma && value > 0; }
    bool below(double sigmas) const { return value < -sigmas * sigma && value < 0; }
  };
  Sum sum(std::size_t k) const;

 private:
  void add(std::string name, const BlockTree& tree, const TreePhotograph& photograph);

  Grid grid_;
  std::vector<LightPhotograph> photographs_;
  std::vector<std::uint8_t> valid_;
  std::int64_t pixels_ = 0;
};

}  // namespace symrig::acquisition
