// SPDX-License-Identifier: Apache-2.0
// The kernel of the page, compiled for this machine, against the library; and pages of lower resolution.
#include "assert_ok.hpp"
#include "relight_kernel.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/tensor/internal/half.hpp"
#include "viewer/page_tensor.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::kernel_test {
namespace {

using viewer::PageTensor;

constexpr float kEps = 0x1p-24F;

std::vector<float> random_values(std::mt19937& rng, std::size_t count) {
  std::uniform_real_distribution<float> values(0.1F, 1.0F);
  std::vector<float> out(count);
  for (float& value : out) value = values(rng);
  return out;
}

/// A leaf of every kind on a grid that is no power of two: between blocks, on the diagonal, scalars, a band.
TransportTensor symmetric_tensor(Grid grid, int channels) {
  std::mt19937 rng(3);
  const BlockTree tree(grid);
  TensorBuilder builder(tree, channels);
  const auto blocks = tree.level(1);
  const auto factors = [&](const Block& a, const Block& b, int rank) {
    return random_values(rng, static_cast<std::size_t>(a.size() + b.size()) * rank * channels);
  };
  for (int k = 0; k < 2; ++k)
    builder.add_leaf(blocks[k].begin, blocks[k].end, blocks[k + 1].begin, blocks[k + 1].end, 3, 1,
                     factors(blocks[k], blocks[k + 1], 3));
  std::vector<float> own;
  for (int c = 0; c < channels; ++c) {
    const std::vector<float> a = random_values(rng, blocks[0].size());
    own.insert(own.end(), a.begin(), a.end());
    own.insert(own.end(), a.begin(), a.end());
  }
  builder.add_leaf(blocks[0].begin, blocks[0].end, blocks[0].begin, blocks[0].end, 1, 1, own);
  const auto pixels = static_cast<std::int32_t>(grid.size());
  for (std::int32_t i = 0; i < pixels; ++i) builder.add_scalar(i, i, random_values(rng, channels));
  for (std::int32_t i = 3; i < pixels; i += 2) builder.add_scalar(i, i - 3, random_values(rng, channels));
  builder.add_band(1, random_values(rng, band_offsets(1).size() * grid.size() * channels));
  return std::move(builder).finish();
}

TransportTensor general_tensor(bool columns) {
  std::mt19937 rng(4);
  const BlockTree camera(Grid{7, 9}), projector(Grid{4, 6});
  TensorBuilder builder(camera, projector, 1);
  if (!columns) {
    builder.add_leaf(0, 63, 0, 24, 2, 0, random_values(rng, std::size_t{63 + 24} * 2));
    builder.add_scalar(5, 20, random_values(rng, 1));
    builder.add_scalar(60, 2, random_values(rng, 1));
    return std::move(builder).finish();
  }
  const std::vector<std::int32_t> rows{1, 7, 40};
  builder.add_column(0, 1, rows, random_values(rng, 3));
  builder.add_column(4, 9, rows, random_values(rng, 3));
  return std::move(builder).finish();
}

/// The lists of a page in the form in which its script hands them to the kernel (engine_kernel.js).
std::vector<float> plane_of(const std::vector<float>& values, int channels, int channel) {
  std::vector<float> plane;
  for (std::size_t k = channel; k < values.size(); k += channels) plane.push_back(values[k]);
  return plane;
}

void add_entries(const PageTensor& page, int channel, bool transposed, const std::vector<float>& p,
                 std::vector<float>& y) {
  std::vector<U32> starts(page.camera.order.size() + 1), cols;
  for (const ScalarLeaf& entry : page.entries) {
    ++starts[entry.row + 1];
    cols.push_back(entry.col);
  }
  for (std::size_t r = 1; r < starts.size(); ++r) starts[r] += starts[r - 1];
  const std::vector<float> values = plane_of(page.entry_values, page.channels, channel);
  symrig_add_entries(starts.data(), static_cast<U32>(page.camera.order.size()), cols.data(), values.data(),
                     page.symmetric ? 2
                     : transposed   ? 1
                                    : 0,
                     p.data(), y.data());
}

void add_bands(const PageTensor& page, int channel, const Image<float>& light, std::span<float> picture) {
  const Grid grid = page.camera.grid;
  for (const BandLeaf& band : page.bands) {
    const auto offsets = band_offsets(band.radius);
    for (std::size_t k = 0; k < offsets.size(); ++k)
      symrig_add_band(band.values.data() + (channel * offsets.size() + k) * grid.size(), offsets[k].dy,
                      offsets[k].dx, grid.rows, grid.cols, light.values().data(), picture.data());
  }
}

/// photograph = T · light by the kernel; Tᵀ if transposed.
Image<float> by_kernel(const PageTensor& page, const Image<float>& light, bool transposed) {
  const auto& from = transposed ? page.camera : page.projector;
  const auto& to = transposed ? page.projector : page.camera;
  Image<float> picture(to.grid, page.channels);
  std::vector<float> p(from.order.size());
  for (std::size_t t = 0; t < p.size(); ++t) p[t] = light.values()[from.order[t]];
  std::vector<U32> lit(p.size() + 1);
  symrig_count_lit(p.data(), static_cast<U32>(p.size()), lit.data());
  std::vector<I32> columns;
  for (const SparseColumn& one : page.columns)
    columns.insert(columns.end(),
                   {one.col_begin, one.col_end, static_cast<I32>(one.first), static_cast<I32>(one.last)});
  for (int c = 0; c < page.channels; ++c) {
    std::vector<float> y(to.order.size());
    if (!page.diagonal.empty())
      symrig_add_products(page.diagonal.data() + c * p.size(), p.data(), y.data(),
                          static_cast<U32>(p.size()));
    add_entries(page, c, transposed, p, y);
    const std::vector<float> values = plane_of(page.column_values, page.channels, c);
    symrig_add_columns(columns.data(), static_cast<U32>(page.columns.size()), page.column_rows.data(),
                       values.data(), transposed ? 1 : 0, p.data(), y.data());
    symrig_add_leaves(reinterpret_cast<const I32*>(page.leaves.data()), static_cast<U32>(page.leaves.size()),
                      page.channels, c, page.factors.data(), transposed && !page.symmetric ? 1 : 0,
                      lit.data(), p.data(), y.data());
    for (std::size_t t = 0; t < y.size(); ++t)
      picture.plane(c)[to.order[t]] = y[t] / (to.areas.empty() ? 1.0F : to.areas[t]);
    add_bands(page, c, light, picture.plane(c));
  }
  return picture;
}

Image<float> random_light(Grid grid, bool half_dark) {
  std::mt19937 rng(5);
  Image<float> light(grid);
  const std::vector<float> values = random_values(rng, grid.size());
  for (std::size_t i = half_dark ? values.size() / 2 : 0; i < values.size(); ++i)
    light.values()[i] = values[i];
  return light;
}

/// All numbers are positive, so a sum of n terms has a relative error of at most n ε whatever its order; a
/// pixel sums at most the grid's pixels for each leaf. Both sides err, so twice that.
void expect_same(const Image<float>& ours, const Image<float>& library, std::int64_t pixels) {
  ASSERT_EQ(ours.values().size(), library.values().size());
  const float bound = 2 * kEps * static_cast<float>(2 * pixels + 32);
  for (std::size_t k = 0; k < ours.values().size(); ++k)
    ASSERT_NEAR(ours.values()[k], library.values()[k], bound * library.values()[k]) << k;
}

TEST(ViewerKernel, applies_what_the_library_applies) {
  for (const bool half_dark : {false, true})
    for (const TransportTensor& tensor : {symmetric_tensor({13, 10}, 1), symmetric_tensor({6, 11}, 3),
                                          general_tensor(false), general_tensor(true)}) {
      const PageTensor page = *viewer::page_tensor(tensor);
      const Image<float> light = random_light(tensor.projector_grid(), half_dark);
      const Image<float> back = random_light(tensor.camera_grid(), half_dark);
      const std::int64_t most = tensor.camera_grid().size();
      expect_same(by_kernel(page, light, false), *tensor.apply(light), most);
      expect_same(by_kernel(page, back, true), *tensor.apply_transposed(back), most);
    }
}

TEST(ViewerKernel, widens_every_finite_half) {
  for (std::uint32_t bits = 0; bits < 65536; ++bits) {
    if ((bits & 0x7C00U) == 0x7C00U) continue;
    const auto half = static_cast<U16>(bits);
    float wide = NAN;
    symrig_widen(&half, &wide, 1, -3);
    ASSERT_EQ(wide, std::ldexp(tensor::from_half(half), -3)) << bits;
  }
}

/// Each pixel of a page of lower resolution lights its pixels of the scene, and shows their mean.
TEST(ReducedTensor, lights_whole_blocks_and_shows_their_means) {
  for (const Grid grid : {Grid{8, 8}, Grid{13, 10}, Grid{6, 11}})
    for (int levels = 1; levels <= 2; ++levels) {
      const TransportTensor tensor = symmetric_tensor(grid, 1);
      const auto page = viewer::reduced_tensor(tensor, levels);
      ASSERT_OK(page);
      const BlockTree& tree = tensor.camera_tree();
      const auto blocks = tree.level(tree.levels() - 1 - levels);
      ASSERT_EQ(page->camera.pixels(), std::ssize(blocks));
      const Image<float> light = random_light(page->projector.grid, true);
      Image<float> fine(grid);
      for (std::size_t b = 0; b < blocks.size(); ++b)
        for (std::int32_t t = blocks[b].begin; t < blocks[b].end; ++t)
          fine.values()[tree.order()[t]] = light.values()[page->projector.order[b]];
      const auto seen = tensor.apply(fine);
      Image<float> means(page->camera.grid);
      for (std::size_t b = 0; b < blocks.size(); ++b)
        for (std::int32_t t = blocks[b].begin; t < blocks[b].end; ++t)
          means.values()[page->camera.order[b]] +=
              seen->values()[tree.order()[t]] / static_cast<float>(blocks[b].size());
      expect_same(by_kernel(*page, light, false), means, 2 * grid.size());
    }
}

TEST(ReducedTensor, refuses_what_it_cannot_reduce) {
  EXPECT_FALSE(viewer::reduced_tensor(general_tensor(true), 1).ok());
  EXPECT_FALSE(viewer::reduced_tensor(symmetric_tensor({4, 4}, 1), 9).ok());
}

}  // namespace
}  // namespace symrig::kernel_test
