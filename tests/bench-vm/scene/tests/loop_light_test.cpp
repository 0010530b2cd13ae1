// SPDX-License-Identifier: Apache-2.0
// The loop outside the product makes the same frames as the product's virtual rig.
#include "bench-vm/scene/tests/looped_rig.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm::loop_light_test {
namespace {

// Same patterns, times and frame numbers give the same photographs, bit for bit, including noise.
TEST(LoopLight, makes_the_frames_of_the_virtual_rig) {
  for (const std::string uri :
       {"sim:vgroove-textured?size=20x24", "sim:gummy?size=17x13&seed=4&black=0.01",
        "sim:mirror?size=24x20&flare=0.1&misalign=0.5",
        "sim:vgroove-textured?size=16x20&fine=2&camera=48x60&turn=1.5&zoom=0.85&distortion=0.02"}) {
    const auto virtual_rig = open_virtual_rig(uri + "&exposures=4");  // planned, noise has other keys
    ASSERT_TRUE(virtual_rig.ok()) << virtual_rig.error().line();
    LoopedRig looped(uri);
    const auto rig = looped.open();
    ASSERT_TRUE(rig.ok()) << rig.error().line();
    std::vector<Pattern> patterns;
    for (std::uint64_t i = 0; i < 5; ++i) patterns.push_back(random_pattern((*rig)->grid(), i));
    const auto expected = (*virtual_rig)->measure(patterns);
    const auto seen = (*rig)->measure(patterns);
    ASSERT_TRUE(expected.ok() && seen.ok()) << uri;
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      EXPECT_TRUE((*seen)[i].mean == (*expected)[i].mean) << uri << " " << i;
      EXPECT_TRUE((*seen)[i].variance == (*expected)[i].variance) << uri << " " << i;
    }
  }
}

// An exposure during a change of the picture sees both pictures, each for its time.
TEST(LoopLight, mixes_light_by_time) {
  const auto uri = *parse_scene_uri("sim:vgroove-textured?size=20x24&black=0");
  const auto bench = *sim::make_bench(uri);
  const sim::ImageFormation formation(uri, *bench.view);
  const Pattern a = random_pattern(uri.size, 1), b = random_pattern(uri.size, 2);
  Pattern mixed(uri.size);
  for (std::size_t i = 0; i < mixed.values().size(); ++i)
    mixed.values()[i] = 0.25F * a.values()[i] + 0.5F * b.values()[i];
  const sim::ImageFormation::Share shares[] = {{formation.light_of(a, 0), 0.25},
                                               {formation.light_of(b, 1), 0.5}};
  const auto seen = formation.during(shares);
  const auto expected = formation.light_of(mixed, 0);
  for (std::size_t i = 0; i < mixed.values().size(); ++i)  // sums of a few hundred terms below 1 in float
    EXPECT_NEAR(seen->values()[i], expected->values()[i], 1e-5) << i;
}

}  // namespace
}  // namespace symrig::bench_vm::loop_light_test
