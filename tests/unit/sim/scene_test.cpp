// SPDX-License-Identifier: Apache-2.0

#include "symrig/sim/scene.hpp"

#include "unit/sim/dense.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

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

namespace symrig::scene_uri_test {

namespace {

TEST(SceneUri, has_the_documented_defaults) {
  const auto uri = parse_scene_uri("sim:plane");
  ASSERT_TRUE(uri.ok());
  EXPECT_EQ(uri->name, "plane");
  EXPECT_EQ(uri->size, (Grid{128, 128}));
  EXPECT_EQ(uri->seed, 1);
  EXPECT_EQ(uri->channels, 1);
  EXPECT_TRUE(uri->camera_noise);
  EXPECT_EQ(uri->black, 0.0005);
  EXPECT_EQ(uri->psf, 0);
  EXPECT_EQ(uri->misalign, 0);
  EXPECT_EQ(uri->flare, 0);
  EXPECT_EQ(uri->dead, 0);
  EXPECT_EQ(uri->indirect, 1);
  EXPECT_EQ(uri->exposures, 0);  // planned
  EXPECT_EQ(uri->ratio, 8);
  EXPECT_EQ(uri->drift, 0);
  EXPECT_EQ(uri->gamma, 1);
  EXPECT_EQ(uri->light, 1);
  EXPECT_EQ(uri->to_string(), "sim:plane?size=128x128");
}

TEST(SceneUri, reads_every_key) {
  const auto uri = parse_scene_uri(
      "sim:gummy?size=31x70&seed=9&channels=3&noise=camera&black=0.002&psf=0.1&misalign=-0.25&flare=0.05&"
      "dead=0.01"
      "&indirect=0.5&exposures=6&ratio=4.5&drift=-0.02&gamma=2.2&light=0.25");
  ASSERT_TRUE(uri.ok()) << uri.error().line();
  EXPECT_EQ(uri->size, (Grid{31, 70}));
  EXPECT_EQ(uri->seed, 9);
  EXPECT_EQ(uri->channels, 3);
  EXPECT_EQ(uri->black, 0.002);
  EXPECT_EQ(uri->psf, 0.1);
  EXPECT_EQ(uri->misalign, -0.25);
  EXPECT_EQ(uri->flare, 0.05);
  EXPECT_EQ(uri->dead, 0.01);
  EXPECT_EQ(uri->indirect, 0.5);
  EXPECT_EQ(uri->exposures, 6);
  EXPECT_EQ(uri->ratio, 4.5);
  EXPECT_EQ(uri->drift, -0.02);
  EXPECT_EQ(uri->gamma, 2.2);
  EXPECT_EQ(uri->light, 0.25);
}

TEST(SceneUri, reads_the_keys_of_a_bench) {
  const std::string text =
      "sim:plane?size=8x9&fine=4&camera=64x72&turn=-1.5&zoom=0.93&shift=7.3,-4&distortion=0.02&parallax=0.3&"
      "vignetting=0.2,0.35&defocus=0.15,0.3&colour=0.1&ghost=0.01@2.5,-3&moves=1";
  const auto uri = parse_scene_uri(text);
  ASSERT_TRUE(uri.ok()) << uri.error().line();
  EXPECT_EQ(uri->fine, 4);
  EXPECT_TRUE(uri->own_camera());
  EXPECT_EQ(uri->camera, (Grid{64, 72}));
  EXPECT_EQ(uri->turn, -1.5);
  EXPECT_EQ(uri->zoom, 0.93);
  EXPECT_EQ(uri->shift, (Offset{7.3, -4}));
  EXPECT_EQ(uri->distortion, 0.02);
  EXPECT_EQ(uri->parallax, 0.3);
  EXPECT_EQ(uri->vignetting, (BothOptics{0.2, 0.35}));
  EXPECT_EQ(uri->defocus, (BothOptics{0.15, 0.3}));
  EXPECT_EQ(uri->colour, 0.1);
  EXPECT_EQ(uri->ghost, (Ghost{0.01, {2.5, -3}}));
  EXPECT_EQ(uri->moves, 1);
  EXPECT_EQ(uri->to_string(), text);
}

TEST(SceneUri, exposures_are_planned_or_fixed) {
  const auto planned = parse_scene_uri("sim:plane?exposures=auto");
  ASSERT_TRUE(planned.ok()) << planned.error().line();
  EXPECT_EQ(planned->exposures, 0);
  EXPECT_EQ(planned->to_string(), "sim:plane?size=128x128");
  const auto fixed = parse_scene_uri("sim:plane?exposures=3");
  ASSERT_TRUE(fixed.ok()) << fixed.error().line();
  EXPECT_EQ(fixed->exposures, 3);
  EXPECT_EQ(fixed->to_string(), "sim:plane?size=128x128&exposures=3");
}

TEST(SceneUri, has_no_black_level_without_noise) {
  const auto uri = parse_scene_uri("sim:plane?noise=off&black=0.01");
  ASSERT_TRUE(uri.ok());
  EXPECT_FALSE(uri->camera_noise);
  EXPECT_EQ(uri->black, 0);
}

TEST(SceneUri, prints_what_it_reads) {
  for (const std::string text : {"sim:views3?size=30x40", "sim:plane?size=1x1&noise=off",
                                 "sim:mirror?size=5x7&seed=3&psf=0.05&ratio=4",
                                 "sim:vgroove-textured?size=310x350&channels=3&indirect=0.001&drift=-0.01"}) {
    const auto uri = parse_scene_uri(text);
    ASSERT_TRUE(uri.ok()) << uri.error().line();
    EXPECT_EQ(uri->to_string(), text);
  }
}

struct Refused {
  std::string_view uri;
  ErrorCode code;
  std::string_view names;  ///< must stand in the line
};

class RefusedUri : public testing::TestWithParam<Refused> {};

TEST_P(RefusedUri, says_why_and_what_next) {
  const auto uri = parse_scene_uri(GetParam().uri);
  ASSERT_FALSE(uri.ok()) << GetParam().uri;
  EXPECT_EQ(uri.error().code, GetParam().code) << uri.error().line();
  EXPECT_NE(uri.error().line().find(GetParam().names), std::string::npos) << uri.error().line();
  EXPECT_EQ(uri.error().line().find('\n'), std::string::npos);
  EXPECT_FALSE(uri.error().hint.empty());
}

constexpr ErrorCode kBad = ErrorCode::bad_argument;
constexpr ErrorCode kUnknown = ErrorCode::unknown_name;
INSTANTIATE_TEST_SUITE_P(
    SceneUri, RefusedUri,
    testing::Values(
        Refused{"plane", kBad, "sim:NAME"}, Refused{"", kBad, "sim:NAME"},
        Refused{"sim:", kUnknown, "known: plane"}, Refused{"sim:gumy", kUnknown, "'gummy'"},
        Refused{"sim:vgroove-textures", kUnknown, "'vgroove-textured'"},
        Refused{"sim:plane?sise=3x3", kUnknown, "'size'"}, Refused{"sim:plane?=3", kBad, "key=value"},
        Refused{"sim:plane?size", kBad, "key=value"}, Refused{"sim:plane?&size=3x3", kBad, "key=value"},
        Refused{"sim:plane?size=3x3&size=3x3", kBad, "twice"},
        Refused{"sim:plane?size=", kBad, "ROWSxCOLUMNS"}, Refused{"sim:plane?size=12", kBad, "'12'"},
        Refused{"sim:plane?size=0x4", kBad, "'0x4'"}, Refused{"sim:plane?size=-3x4", kBad, "'-3x4'"},
        Refused{"sim:plane?size=3x4x5", kBad, "'3x4x5'"},
        Refused{"sim:plane?size=99999x99999", kBad, "'99999x99999'"},
        Refused{"sim:plane?seed=1.5", kBad, "whole number"},
        Refused{"sim:plane?seed=-1", kBad, "whole number"},
        Refused{"sim:plane?seed=99999999999", kBad, "whole number"},
        Refused{"sim:plane?channels=2", kBad, "1 or 3"}, Refused{"sim:plane?noise=on", kBad, "off or camera"},
        Refused{"sim:plane?psf=nan", kBad, "psf"}, Refused{"sim:plane?psf=0.3", kBad, "0.25"},
        Refused{"sim:plane?black=-1", kBad, "black"}, Refused{"sim:plane?flare=1", kBad, "flare"},
        Refused{"sim:plane?dead=0.9", kBad, "dead"}, Refused{"sim:plane?indirect=-1", kBad, "indirect"},
        Refused{"sim:plane?exposures=9", kBad, "exposures"},
        Refused{"sim:plane?exposures=0", kBad, "exposures"}, Refused{"sim:plane?ratio=1", kBad, "ratio"},
        Refused{"sim:plane?ratio=8x", kBad, "'8x'"}, Refused{"sim:plane?drift=inf", kBad, "drift"},
        Refused{"sim:plane?light=0", kBad, "light"}, Refused{"sim:plane?light=2", kBad, "light"},
        Refused{"sim:plane?misalign=1e9", kBad, "misalign"}, Refused{"sim:plane?fine=0", kBad, "fine"},
        Refused{"sim:plane?camera=cell", kBad, "cells, or ROWSxCOLUMNS"},
        Refused{"sim:plane?shift=1", kBad, "ROW,COLUMN"}, Refused{"sim:plane?shift=1,2,3", kBad, "'1,2,3'"},
        Refused{"sim:plane?shift=,", kBad, "','"},
        Refused{"sim:plane?vignetting=0.2,1", kBad, "CAMERA,PROJECTOR"},
        Refused{"sim:plane?defocus=nan,0", kBad, "defocus"}, Refused{"sim:plane?ghost=0.1", kBad, "SHARE@"},
        Refused{"sim:plane?ghost=0.1@1", kBad, "ghost"}, Refused{"sim:plane?ghost=0.6@1,1", kBad, "0.5"},
        Refused{"sim:plane?ghost=0.1@1,1e9", kBad, "1000"},
        Refused{"sim:plane?psf=0.1&zoom=2", kBad, "defocus"}));

TEST(SceneTable, each_row_is_a_scene_with_its_text) {
  ASSERT_EQ(scenes().size(), scene_names().size());
  for (std::size_t k = 0; k < scenes().size(); ++k) {
    const auto [name, about] = scenes()[k];
    EXPECT_EQ(scene_names()[k], name);
    EXPECT_EQ(std::count(scene_names().begin(), scene_names().end(), name), 1) << name;
    EXPECT_FALSE(about.empty()) << name;
    const auto uri = parse_scene_uri("sim:" + std::string(name) + "?size=4x4");
    ASSERT_TRUE(uri.ok()) << name;
    EXPECT_TRUE(make_scene(*uri).ok()) << name;
  }
}

TEST(SceneTable, an_unknown_scene_lists_all) {
  const std::string line = parse_scene_uri("sim:jelly").error().line();
  for (const auto name : scene_names()) EXPECT_NE(line.find(name), std::string::npos) << line;
}

// The default is read back, and an error for a wrong value gives the values of the table.
TEST(KeyTable, each_key_reads_its_default_and_refuses_with_its_values) {
  for (const SceneKey& key : scene_keys()) {
    const std::string uri = "sim:plane?" + std::string(key.name) + "=";
    const auto standard = parse_scene_uri(uri + key.standard);
    ASSERT_TRUE(standard.ok()) << key.name;
    EXPECT_EQ(standard->to_string(), SceneUri().to_string());
    const auto wrong = parse_scene_uri(uri + "?");
    ASSERT_FALSE(wrong.ok()) << key.name;
    EXPECT_EQ(wrong.error().hint, "give " + std::string(key.name) + " as " + key.values);
    EXPECT_FALSE(key.meaning.empty()) << key.name;
  }
}

}  // namespace

}  // namespace symrig::scene_uri_test
