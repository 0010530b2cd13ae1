// SPDX-License-Identifier: Apache-2.0
// The rules of the file refuse nothing that a capture makes: every algorithm, noise, optics out of line,
// views.
#include "scratch.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/tensor/file.hpp"

#include <string>
#include <string_view>
#include <utility>

#include <gtest/gtest.h>

namespace symrig::structured::captured_scenes_test {
namespace {

CaptureOptions options_of(Algorithm algorithm, int polish) {
  CaptureOptions options;
  options.algorithm = algorithm;
  options.rule = default_rule(algorithm);
  options.economy = default_economy(algorithm);
  options.economy->polish = polish;
  return options;
}

class CapturedScenes : public testing::TestWithParam<std::pair<const char*, Algorithm>> {};

TEST_P(CapturedScenes, are_read_again) {
  const auto& [rig, algorithm] = GetParam();
  const test::Scratch folder;
  for (const int polish : {0, 2}) {
    auto probe = open_virtual_rig(rig);
    ASSERT_TRUE(probe.ok()) << probe.error().line();
    CaptureOptions options = options_of(algorithm, polish);
    // Optics that are this far out of line are refused otherwise.
    options.unchecked = std::string_view(rig).find("misalign") != std::string_view::npos;
    auto captured = capture(**probe, options);
    ASSERT_TRUE(captured.ok()) << captured.error().line();
    ASSERT_TRUE(save_scene(folder / "scene.h5", {captured->tensor, "{}", captured->held_out}).ok());
    const auto read = load_scene(folder / "scene.h5");
    EXPECT_TRUE(read.ok()) << read.error().line();
  }
}

INSTANTIATE_TEST_SUITE_P(Rigs, CapturedScenes,
                         testing::Values(std::pair{"sim:vgroove-textured?size=24x20", Algorithm::symrig},
                                         std::pair{"sim:gummy?size=20x24&noise=off", Algorithm::symrig},
                                         std::pair{"sim:gummy?size=16x16&misalign=0.7", Algorithm::symrig},
                                         std::pair{"sim:vgroove-textured?size=16x16&psf=0.2",
                                                   Algorithm::symrig},
                                         std::pair{"sim:views2?size=24x24", Algorithm::symrig},
                                         std::pair{"sim:vgroove-white?size=16x16", Algorithm::paper},
                                         std::pair{"sim:vgroove-white?size=8x8", Algorithm::brute},
                                         std::pair{"sim:vgroove-white?size=8x8", Algorithm::dual}));

}  // namespace
}  // namespace symrig::structured::captured_scenes_test
