// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/tree_photograph.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

/// Samples of one channel in tree order. No branches: this runs over every sample of every photograph.
struct ChannelSamples {
  std::span<float> mean, variance;
  std::span<std::uint8_t> valid;

  bool finite() const {
    constexpr std::uint32_t kMagnitude = 0x7FFF'FFFF, kInfinity = 0x7F80'0000;
    std::uint32_t wrong = 0;
    for (std::size_t t = 0; t < mean.size(); ++t) {
      const auto m = std::bit_cast<std::uint32_t>(mean[t]);
      const auto v = std::bit_cast<std::uint32_t>(variance[t] + 0.0F);  // −0 is 0
      // The top bit of |x| − ∞ is set below infinity, clear from there on and for NaN; of v − ∞ it is clear
      // for negative numbers too.
      wrong |= ~((m & kMagnitude) - kInfinity) | ~((v & kMagnitude) - kInfinity) | ~(v - kInfinity);
    }
    return wrong >> 31 == 0;
  }
  void clear_invalid() const {
    for (std::size_t t = 0; t < mean.size(); ++t) {
      mean[t] = valid[t] != 0 ? mean[t] : 0;
      variance[t] = valid[t] != 0 ? variance[t] : 0;
    }
  }
};

}  // namespace

bool to_tree(const BlockTree& tree, const Radiance& from, TreePhotograph& to) {
  const std::size_t pixels = tree.order().size();
  const std::size_t channels = from.mean.channels();
  to.mean.resize(channels * pixels);
  to.variance.resize(channels * pixels);
  to.valid.resize(channels * pixels);
  bool finite = true;
  for (std::size_t channel = 0; channel < channels; ++channel) {
    const auto plane = static_cast<int>(channel);
    const ChannelSamples samples{std::span(to.mean).subspan(channel * pixels, pixels),
                                 std::span(to.variance).subspan(channel * pixels, pixels),
                                 std::span(to.valid).subspan(channel * pixels, pixels)};
    tree.to_tree(from.mean.plane(plane), samples.mean);
    tree.to_tree(from.variance.plane(plane), samples.variance);
    const auto valid = from.valid.plane(plane);
    if (std::memchr(valid.data(), 0, valid.size()) == nullptr) {
      std::fill(samples.valid.begin(), samples.valid.end(), std::uint8_t{1});
    } else {
      for (std::size_t t = 0; t < pixels; ++t) samples.valid[t] = valid[tree.order()[t]] != 0 ? 1 : 0;
      samples.clear_invalid();
    }
    finite = samples.finite() && finite;
  }
  return finite;
}

namespace {

/// One channel of a photograph in raster order.
struct Raster {
  std::vector<float> mean, variance;
  std::vector<std::uint8_t> valid;
};

/// The squared contrast of each pixel of a view to its neighbours, times `share`.
void contrast(const Tile& view, int stride, float share, Raster& raster) {
  for (int row = 0; row < view.grid.rows; ++row)
    for (int col = 0; col < view.grid.cols; ++col) {
      const std::size_t i = static_cast<std::size_t>(view.row + row) * stride + view.col + col;
      float squares = 0;
      const auto add = [&](bool has_neighbour, std::size_t n) {
        if (!has_neighbour || raster.valid[n] == 0) return;
        const float difference = raster.mean[i] - raster.mean[n];
        squares += difference * difference;
      };
      add(row > 0, i - stride);
      add(row + 1 < view.grid.rows, i + stride);
      add(col > 0, i - 1);
      add(col + 1 < view.grid.cols, i + 1);
      raster.variance[i] = raster.valid[i] != 0 ? share * squares : 0;
    }
}

void add_to(TreePhotograph& photograph, const BlockTree& tree, float share) {
  const std::size_t pixels = tree.order().size();
  const Grid grid = tree.grid();
  const ViewLayout views = tree.views();
  Raster raster{std::vector<float>(pixels), std::vector<float>(pixels), std::vector<std::uint8_t>(pixels)};
  for (std::size_t begin = 0; begin < photograph.mean.size(); begin += pixels) {
    for (std::size_t t = 0; t < pixels; ++t) {
      raster.mean[tree.order()[t]] = photograph.mean[begin + t];
      raster.valid[tree.order()[t]] = photograph.valid[begin + t];
    }
    for (int row = 0; row < views.rows; ++row)
      for (int col = 0; col < views.cols; ++col)
        contrast(views.tile(grid, {row, col}), grid.cols, share, raster);
    for (std::size_t t = 0; t < pixels; ++t)
      photograph.variance[begin + t] += raster.variance[tree.order()[t]];
  }
}

}  // namespace

void add_shift_variance(const BlockTree& tree, double sigma, std::span<TreePhotograph> photographs) {
  if (!(sigma > 0)) return;
  const auto share = static_cast<float>(sigma * sigma / 2);
  tbb::parallel_for(std::size_t{0}, photographs.size(),
                    [&](std::size_t k) { add_to(photographs[k], tree, share); });
}

BlockColumn significant_column(const TreePhotograph& photograph, const PixelSet& seen, int channels) {
  const std::size_t pixels = photograph.pattern.size();
  const std::size_t samples = pixels * static_cast<std::size_t>(channels);
  BlockColumn out;
  for (const std::int32_t p : seen.pixels) {
    bool significant = false;
    for (auto at = static_cast<std::size_t>(p); at < samples; at += pixels)
      significant =
          significant || (photograph.valid[at] != 0 &&
                          std::abs(photograph.mean[at]) > kGateSigmas * std::sqrt(photograph.variance[at]));
    if (!significant) continue;
    out.pixels.push_back(p);
    for (auto at = static_cast<std::size_t>(p); at < samples; at += pixels)
      out.values.push_back(photograph.mean[at]);
  }
  return out;
}

}  // namespace symrig::acquisition
