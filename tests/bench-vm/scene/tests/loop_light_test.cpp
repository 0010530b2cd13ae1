// SPDX-License-Identifier: Apache-2.0
// The loop that is closed outside the product makes the frames that the product's own virtual rig makes.
#include "bench-vm/scene/screen_timeline.hpp"
#include "sim/simulated_camera.hpp"
#include "sim/simulated_projector.hpp"
#include "sim/studio.hpp"
#include "symrig/base/random.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/device/link.hpp"
#include "symrig/rig/rig.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm {
namespace {

constexpr std::int64_t kTickNs = 8;  // boards::SimBoard runs at 125 MHz

/// The virtual rig's board, projector and camera, but the light goes by way of the screen's timeline.
class LoopedRig {
 public:
  explicit LoopedRig(const std::string& text)
      : uri_(*sim::parse_scene_uri(text)), scene_(*sim::make_scene(uri_)), studio_(uri_, *scene_) {
    board_.attach(raster_);
    board_.attach(shutter_);
  }

  Result<std::unique_ptr<Rig>> open() {
    RigOptions options;
    options.scale = 1 / sim::kSensitivity;
    auto projector =
        std::make_unique<sim::SimulatedProjector>(uri_.size, raster_, options.profile.refresh_period);
    const sim::SimulatedProjector* screen = projector.get();
    sim::SimulatedCameraSpec spec{uri_.size, 1, {}, studio_.noise(), {}};
    auto camera = std::make_unique<sim::SimulatedCamera>(
        spec, shutter_, [this, screen](auto exposures) { return develop(*screen, exposures); });
    SYMRIG_TRY(auto board, device::Board::connect(device::make_sim_link(board_)));
    return Rig::open(std::move(board), std::move(projector), std::move(camera), options);
  }

 private:
  static Nanoseconds time(std::uint64_t tick) {
    return Nanoseconds{static_cast<std::int64_t>(tick) * kTickNs};
  }

  /// What the screen's watcher would have seen.
  ScreenTimeline timeline(const sim::SimulatedProjector& screen) const {
    ScreenTimeline timeline;
    for (const auto& change : raster_.changes())
      timeline.change(time(change.tick), std::make_shared<const Image<float>>(
                                             screen.pattern(static_cast<std::size_t>(change.index))));
    return timeline;
  }

  std::vector<CameraFrame> develop(const sim::SimulatedProjector& screen,
                                   std::span<const sim::SimulatedExposure> exposures) {
    const ScreenTimeline shown = timeline(screen);
    std::vector<CameraFrame> frames;
    for (const auto& exposure : exposures) {
      std::vector<sim::Studio::Share> shares;
      for (const auto& lit : shown.during(time(exposure.begin), time(exposure.end)))
        shares.push_back({studio_.light_of(*lit.pattern, lit.number), lit.share});
      const Nanoseconds open = time(exposure.end) - time(exposure.begin);
      CameraFrame frame;
      frame.sequence = exposure.sequence;
      frame.raw = studio_.expose(*studio_.during(shares), seconds(open), exposure.sequence);
      frames.push_back(std::move(frame));
    }
    return frames;
  }

  sim::SceneUri uri_;
  std::unique_ptr<sim::Scene> scene_;
  sim::Studio studio_;
  boards::SimBoard board_;
  boards::SimProjector raster_{board_};
  boards::SimCamera shutter_{board_};
};

Pattern random_pattern(Grid grid, std::uint64_t seed) {
  Random random(seed);
  Pattern pattern(grid);
  for (float& value : pattern.values()) value = random.uniform() < 0.5 ? 0.F : 1.F;
  return pattern;
}

// Same patterns, same times, same frame numbers: the same photographs, bit for bit, noise and all.
TEST(LoopLight, makes_the_frames_of_the_virtual_rig) {
  for (const std::string uri : {"sim:vgroove-textured?size=20x24", "sim:gummy?size=17x13&seed=4&black=0.01",
                                "sim:mirror?size=24x20&flare=0.1&misalign=0.5"}) {
    const auto virtual_rig = sim::open_virtual_rig(uri);
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
      EXPECT_EQ((*seen)[i].mean, (*expected)[i].mean) << uri << " " << i;
      EXPECT_EQ((*seen)[i].variance, (*expected)[i].variance) << uri << " " << i;
    }
  }
}

// An exposure over a change of the picture sees both, each for its time, as one of the sum of both would.
TEST(LoopLight, mixes_light_by_time) {
  const auto uri = *sim::parse_scene_uri("sim:vgroove-textured?size=20x24&black=0");
  const auto scene = *sim::make_scene(uri);
  const sim::Studio studio(uri, *scene);
  const Pattern a = random_pattern(uri.size, 1), b = random_pattern(uri.size, 2);
  Pattern mixed(uri.size);
  for (std::size_t i = 0; i < mixed.values().size(); ++i)
    mixed.values()[i] = 0.25F * a.values()[i] + 0.5F * b.values()[i];
  const sim::Studio::Share shares[] = {{studio.light_of(a, 0), 0.25}, {studio.light_of(b, 1), 0.5}};
  const auto seen = studio.during(shares);
  const auto expected = studio.light_of(mixed, 0);
  for (std::size_t i = 0; i < mixed.values().size(); ++i)  // sums of a few hundred terms below 1 in float
    EXPECT_NEAR(seen->values()[i], expected->values()[i], 1e-5) << i;
}

}  // namespace
}  // namespace symrig::bench_vm
