// SPDX-License-Identifier: Apache-2.0
// When brute force takes over for leaves that the checks find wrong.
#include "acquisition/search/budget.hpp"
#include "dense_scene.hpp"

#include <gtest/gtest.h>

namespace symrig::sparseness_test {
namespace {

using acquisition::Budget;
using acquisition::Photographer;
using acquisition::SceneFacts;
using acquisition::Sparseness;

class WrongLeaves : public testing::Test {
 protected:
  /// Leaves are reopened, and one round would take more photographs than their budget has.
  bool brute_force_takes_over(const Sparseness::Missed& before, double of_all_after_a_level) {
    const BlockTree tree(grid_);
    const CaptureSettings settings = *settings_of({});
    const SceneFacts facts{settings, tree, 1, {1.0}};
    tests::DenseProbe probe(scene_);
    const Photographer photographer(probe, nullptr, tree, {});
    Budget budget(settings, grid_.size(), photographer);
    budget.begin_reopening();
    Sparseness sparseness(facts, photographer, budget);
    sparseness.misses(before);
    sparseness.misses_of_all(of_all_after_a_level);
    const bool goes_on = sparseness.worth_searching(2, 100, 0);
    EXPECT_EQ(goes_on, !sparseness.brute_force_takes_over());
    return sparseness.brute_force_takes_over();
  }

 private:
  Grid grid_{16, 16};
  tests::DenseTransport scene_ = tests::facing_planes(grid_);
};

TEST_F(WrongLeaves, call_brute_force_if_most_light_between_pixels_is_missed) {
  EXPECT_TRUE(brute_force_takes_over({.between_pixels = 0.5, .of_all = 0.1}, 0.1));
}

TEST_F(WrongLeaves, do_not_call_it_if_little_of_all_light_is_missed) {
  EXPECT_FALSE(brute_force_takes_over({.between_pixels = 0.5, .of_all = 0.1}, 0.04));
}

// A level that is searched again measures all light anew. It must not forget that light between pixels is
// known well: on a bench with a camera of its own, the direct light alone errs by a twentieth.
TEST_F(WrongLeaves, do_not_call_it_if_little_light_between_pixels_is_missed) {
  EXPECT_FALSE(brute_force_takes_over({.between_pixels = 0.07, .of_all = 0.06}, 0.06));
}

}  // namespace
}  // namespace symrig::sparseness_test
