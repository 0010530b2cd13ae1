// SPDX-License-Identifier: Apache-2.0
#include "symrig/sim/scene.hpp"

#include <algorithm>

#include <gtest/gtest.h>

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
