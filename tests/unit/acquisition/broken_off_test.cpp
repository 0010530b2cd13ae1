// SPDX-License-Identifier: Apache-2.0
// Captures on rigs with drift, channels and planned exposures, broken off and continued.
#include "broken_off.hpp"

namespace symrig::broken_off_test {
namespace {

class BrokenOff : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Rigs, BrokenOff,
                         testing::Values("sim:vgroove-textured?size=13x17&drift=0.5&dead=0.02&exposures=4",
                                         "sim:gummy?size=12x9&channels=3&exposures=3&flare=0.01",
                                         "sim:gummy?size=12x9&exposures=auto&drift=0.5",
                                         "sim:gummy?size=12x9&exposures=2&profile=dlpc350",
                                         "sim:gummy?size=12x9&exposures=auto&profile=dlpc350"),
                         [](const auto& rig) { return "rig" + std::to_string(rig.index + 1); });

TEST_P(BrokenOff, anywhere_and_continued_a_capture_is_the_same) {
  tests::expect_continued_is_the_same(GetParam());
}

}  // namespace
}  // namespace symrig::broken_off_test
