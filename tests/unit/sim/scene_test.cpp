// SPDX-License-Identifier: Apache-2.0
#include "unit/sim/dense.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace symrig::sim::scene_test {
namespace {

double norm(const DenseTransport& t) {
  return std::sqrt(std::inner_product(t.columns.begin(), t.columns.end(), t.columns.begin(), 0.0));
}

double asymmetry(const DenseTransport& t) {
  double sum = 0;
  for (std::size_t i = 0; i < t.n; ++i)
    for (std::size_t j = 0; j < t.n; ++j) sum += std::pow(double(t.entry(i, j)) - t.entry(j, i), 2);
  return std::sqrt(sum) / norm(t);
}

double largest_row_sum(const DenseTransport& t) {
  double largest = 0;
  for (std::size_t i = 0; i < t.n; ++i) {
    double sum = 0;
    for (std::size_t j = 0; j < t.n; ++j) sum += t.entry(i, j);
    largest = std::max(largest, sum);
  }
  return largest;
}

class EveryScene : public testing::TestWithParam<std::string> {
 protected:
  static std::string uri(const std::string& keys) { return "sim:" + GetParam() + "?" + keys; }
};

std::vector<std::string> all_names() {
  return {scene_names().begin(), scene_names().end()};
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene, testing::ValuesIn(all_names()), [](const auto& scene) {
  std::string name = scene.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

const std::vector<std::string> kSmallGrids{"12x17", "17x12", "21x10", "1x97", "97x1", "2x3", "1x2", "1x1"};

// T = Tᵀ by construction; float rounding of sums of a few hundred terms leaves about 1e-7 (the contract:
// 1e-6).
TEST_P(EveryScene, is_symmetric_on_small_grids) {
  for (const std::string& size : kSmallGrids) EXPECT_LE(asymmetry(form(uri("size=" + size))), 1e-6) << size;
}

TEST_P(EveryScene, is_symmetric_with_blur_and_strong_indirect_light) {
  for (const std::string& size : kSmallGrids)
    EXPECT_LE(asymmetry(form(uri("seed=5&psf=0.11&indirect=3&size=" + size))), 1e-6) << size;
}

// Light is never negative. The occluder's exchange goes through a Fourier transform, which leaves entries of
// F below zero by 3e-6 of the largest, 0.23, and 2e-8 at most (exchange.hpp), times cos 45° and two
// albedos.
TEST_P(EveryScene, has_no_negative_entry) {
  const float floor = GetParam() == "occluder" ? -4e-7F : 0.F;
  for (const std::string& size : kSmallGrids) {
    const DenseTransport t = form(uri("psf=0.05&size=" + size));
    EXPECT_GE(*std::min_element(t.columns.begin(), t.columns.end()), floor) << size;
  }
}

TEST_P(EveryScene, is_linear_for_signed_light) {
  const auto scene = scene_of(uri("size=13x22&psf=0.1"));
  const std::size_t n = scene->grid().size();
  std::vector<float> a(n), b(n), sum(n), ta(n), tb(n), tsum(n);
  for (std::size_t i = 0; i < n; ++i) {
    a[i] = static_cast<float>(i % 7) - 3;
    b[i] = static_cast<float>(i % 5) / 4;
    sum[i] = a[i] - 2 * b[i];
  }
  scene->apply(a, ta, 0);
  scene->apply(b, tb, 0);
  scene->apply(sum, tsum, 0);
  const float largest = *std::max_element(tb.begin(), tb.end());
  for (std::size_t i = 0; i < n; ++i)
    ASSERT_NEAR(tsum[i], ta[i] - 2 * tb[i], 1e-4F * (largest + std::abs(ta[i]))) << i;
}

// Albedo is at most 0.8 and a plane fills at most half the sky of a point of the other, so no row exceeds 1.
// A curved mirror focuses: there only the sum over the picture is bounded.
TEST_P(EveryScene, returns_less_light_than_it_gets) {
  for (const std::string& size : kSmallGrids) {
    const auto scene = scene_of(uri("size=" + size));
    const Image<float> flood = scene->apply(Image<float>(scene->grid(), 1, 1.F));
    const double total = std::accumulate(flood.values().begin(), flood.values().end(), 0.0);
    EXPECT_LE(total, static_cast<double>(scene->grid().size())) << size;
    EXPECT_GT(total, 0) << size;
    if (GetParam() != "mirror") {
      EXPECT_LE(largest_row_sum(form(*scene)), 1) << size;
    }
  }
}

TEST_P(EveryScene, differs_with_its_seed_but_not_between_runs) {
  const auto flood = [](const std::string& text) {
    const auto scene = scene_of(text);
    return scene->apply(Image<float>(scene->grid(), 1, 1.F));
  };
  EXPECT_EQ(flood(uri("size=15x16&seed=1")), flood(uri("size=15x16&seed=1")));
  if (GetParam() == "vgroove-white") return;  // white has no texture to differ in
  EXPECT_NE(flood(uri("size=15x16&seed=1")), flood(uri("size=15x16&seed=2")));
}

TEST_P(EveryScene, has_three_different_channels_of_which_the_first_is_the_single_one) {
  const auto one = scene_of(uri("size=15x16"));
  const auto three = scene_of(uri("size=15x16&channels=3"));
  ASSERT_EQ(three->channels(), 3);
  const DenseTransport red = form(*three, 0);
  EXPECT_EQ(red.columns, form(*one).columns);
  if (GetParam() == "vgroove-white") return;
  EXPECT_NE(red.columns, form(*three, 1).columns);
  EXPECT_NE(form(*three, 1).columns, form(*three, 2).columns);
}

// T(x) = D + x (T(1) − D), D = T(0): rounding of float sums is 1e-6 of the entries.
TEST_P(EveryScene, scales_all_but_the_direct_bounce_by_indirect) {
  const DenseTransport direct = form(uri("size=11x14&indirect=0"));
  const DenseTransport full = form(uri("size=11x14"));
  const DenseTransport tenth = form(uri("size=11x14&indirect=0.1"));
  for (std::size_t i = 0; i < full.columns.size(); ++i) {
    const double expected = direct.columns[i] + 0.1 * (double(full.columns[i]) - direct.columns[i]);
    ASSERT_NEAR(tenth.columns[i], expected, 1e-6 * full.columns[i] + 1e-9) << i;
  }
}

// B T Bᵀ, formed from T and the 3-tap B by hand.
TEST_P(EveryScene, is_blurred_on_both_sides_by_psf) {
  constexpr double a = 0.12;
  const DenseTransport sharp = form(uri("size=7x8"));
  const DenseTransport blurred = form(uri("size=7x8&psf=0.12"));
  const auto tap = [](int d) { return d == 0 ? 1 - 2 * a : std::abs(d) == 1 ? a : 0.0; };
  const auto blur = [&](std::size_t i, std::size_t j) {
    return tap(static_cast<int>(i / 8) - static_cast<int>(j / 8)) *
           tap(static_cast<int>(i % 8) - static_cast<int>(j % 8));
  };
  for (std::size_t i = 0; i < sharp.n; i += 3) {
    for (std::size_t j = 0; j < sharp.n; j += 5) {
      double expected = 0;
      for (std::size_t k = 0; k < sharp.n; ++k)
        for (std::size_t l = 0; l < sharp.n; ++l) expected += blur(i, k) * sharp.entry(k, l) * blur(j, l);
      ASSERT_NEAR(blurred.entry(i, j), expected, 2e-6 * (expected + 0.01)) << i << "," << j;
    }
  }
}

TEST(PlaneScene, is_diagonal) {
  const DenseTransport t = form("sim:plane?size=9x11");
  for (std::size_t i = 0; i < t.n; ++i)
    for (std::size_t j = 0; j < t.n; ++j) ASSERT_EQ(t.entry(i, j) != 0, i == j);
}

// No light passes the fin across the groove; below it the hovering fin darkens what it hides.
TEST(OccluderScene, blocks_what_its_fins_hide) {
  const auto occluder = scene_of("sim:occluder?size=20x24");
  const auto open = scene_of("sim:vgroove-textured?size=20x24");
  Image<float> light(occluder->grid());
  for (int col = 0; col < 24; ++col) light.at(2, col) = 1;
  const Image<float> seen = occluder->apply(light);
  const int cut = static_cast<int>(0.37 * 20);
  for (int row = cut; row < 20; ++row)
    for (int col = 0; col < 24; ++col) ASSERT_EQ(seen.at(row, col), 0.F);
  const Image<float> flood(occluder->grid(), 1, 1.F);
  const Image<float> shaded = occluder->apply(flood), lit = open->apply(flood);
  int darker = 0;
  for (std::size_t i = 0; i < lit.values().size(); ++i) {
    ASSERT_LE(shaded.values()[i], lit.values()[i] * 1.00001F);
    darker += shaded.values()[i] < 0.99F * lit.values()[i];
  }
  EXPECT_GT(darker, 100);
}

// A lit pixel on the mirror shows where its light lands on the other plane: brighter than any diffuse light.
TEST(MirrorScene, throws_light_on_the_other_plane) {
  const auto scene = scene_of("sim:mirror?size=40x44");
  Image<float> light(scene->grid());
  light.at(23, 33) = 1;
  const Image<float> seen = scene->apply(light);
  float left = 0, elsewhere_right = 0;
  for (int row = 0; row < 40; ++row) {
    for (int col = 0; col < 20; ++col) left = std::max(left, seen.at(row, col));
    elsewhere_right = std::max(elsewhere_right, seen.at(row, 43));
  }
  EXPECT_GT(left, 100 * elsewhere_right);
}

// Each view shows the lit point once more, 2.4 pixels apart: 0.12 (z − mean) with z = 40.9 and a mean of 20.
TEST(ViewsScene, sees_one_point_in_every_view) {
  const auto scene = scene_of("sim:views2?size=120x160&indirect=0");
  Image<float> light(scene->grid());
  light.at(28, 76) = 1;
  const Image<float> seen = scene->apply(light);
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      float largest = 0;
      for (int row = 60 * i; row < 60 * (i + 1); ++row)
        for (int col = 80 * j; col < 80 * (j + 1); ++col) largest = std::max(largest, seen.at(row, col));
      EXPECT_GT(largest, 0.2F * seen.at(28, 76)) << i << j;
    }
  }
  EXPECT_LT(seen.at(28, 156), 0.2F * seen.at(28, 76));
}

TEST(MakeScene, refuses_what_it_cannot_hold) {
  SceneUri uri;
  uri.size = {8192, 8192};
  EXPECT_EQ(make_scene(uri).error().code, ErrorCode::limit);
  uri.size = {0, 5};
  EXPECT_EQ(make_scene(uri).error().code, ErrorCode::bad_argument);
  uri.size = {4, 4};
  uri.name = "groove";
  EXPECT_EQ(make_scene(uri).error().code, ErrorCode::unknown_name);
}

}  // namespace
}  // namespace symrig::sim::scene_test
