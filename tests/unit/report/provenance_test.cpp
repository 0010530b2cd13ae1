// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/provenance.hpp"

#include <gtest/gtest.h>

namespace symrig::provenance_test {
namespace {

constexpr const char* kFile = "sim:vgroove-textured?size=12x17&seed=2";

TEST(Provenance, the_same_scene_may_be_photographed_in_other_ways) {
  EXPECT_TRUE(differences_of_scene(kFile, kFile).empty());
  for (const char* keys : {"&noise=off", "&misalign=0.3", "&flare=0.1", "&dead=0.1", "&exposures=2",
                           "&drift=0.1", "&gamma=2", "&light=0.5", "&black=0.01"})
    EXPECT_TRUE(differences_of_scene(kFile, std::string(kFile) + keys).empty()) << keys;
  // No texture: the seed is that of the noise.
  EXPECT_TRUE(
      differences_of_scene("sim:vgroove-white?size=12x17", "sim:vgroove-white?size=12x17&seed=5").empty());
}

TEST(Provenance, what_makes_it_another_scene_is_named) {
  const auto one = [](const std::string& rig) {
    const auto all = differences_of_scene(kFile, rig);
    EXPECT_EQ(all.size(), 1U) << rig;
    return all.empty() ? std::string() : all[0];
  };
  EXPECT_NE(one("sim:vgroove-textured?size=12x17&seed=3").find("seed"), std::string::npos);
  EXPECT_NE(one("sim:gummy?size=12x17&seed=2").find("gummy"), std::string::npos);
  EXPECT_NE(one("sim:vgroove-textured?size=12x17&seed=2&psf=0.1").find("psf"), std::string::npos);
  EXPECT_NE(one("sim:vgroove-textured?size=12x17&seed=2&indirect=0.5").find("indirect"), std::string::npos);
  EXPECT_NE(one("sim:vgroove-textured?size=12x18&seed=2").find("12x18"), std::string::npos);
  EXPECT_NE(one("a bench").find("a bench"), std::string::npos);
}

TEST(Provenance, a_file_that_does_not_say_is_not_doubted) {
  EXPECT_TRUE(differences_of_scene("", kFile).empty());
}

}  // namespace
}  // namespace symrig::provenance_test
