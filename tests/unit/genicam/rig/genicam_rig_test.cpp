// SPDX-License-Identifier: Apache-2.0
// Whole rigs in virtual time with a GenICam camera: firmware, projector, scene, and the camera's own driver.
#include "assert_ok.hpp"
#include "gige/gige_rig.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/hdr/sensor.hpp"
#include "symrig/rig/frame_taker.hpp"
#include "symrig/testing/probe_laws.hpp"
#include "unit/rig/faulty_devices.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace symrig::genicam_rig_test {
namespace {
using namespace probe_laws;  // NOLINT(google-build-using-namespace)
using namespace std::chrono_literals;

using gige::CameraTraits;
using gige::GigeRig;
using gige::Mishap;
using test::misfit;

constexpr const char* kScene = "sim:vgroove-textured?size=64x64";

/// As long exposures as the simulated camera, so that both rigs plan alike.
CameraTraits traits() {
  CameraTraits traits;
  traits.longest_exposure = 30s;
  return traits;
}

TrueTransport truth_of(const VirtualRig& rig) {
  return [&rig](const Image<float>& pattern) -> Result<Image<float>> { return rig.truth().apply(pattern); };
}

/// The errors of a capture against the simulated truth.
Result<TransportErrors> captured_errors(Probe& probe, const VirtualRig& rig) {
  SYMRIG_TRY(const CaptureResult result, capture(probe, CaptureOptions{}));
  return evaluate(result.tensor, truth_of(rig));
}

std::array<std::pair<const char*, double>, 4> named(const TransportErrors& errors) {
  return {{{"frobenius", errors.frobenius},
           {"flood", errors.flood},
           {"indirect", errors.indirect},
           {"bar_indirect", errors.bar_indirect}}};
}

/// Passes a rig's photographs on, and remembers how far the worst one is from what it should show.
class JudgedRig final : public Probe {
 public:
  explicit JudgedRig(VirtualRig& rig) : rig_(rig) {}

  Grid grid() const override { return rig_.grid(); }
  int channels() const override { return rig_.channels(); }
  ViewLayout views() const override { return rig_.views(); }
  bool plans_exposures(std::size_t photographs) const override { return rig_.plans_exposures(photographs); }
  std::size_t together() const override { return rig_.together(); }
  bool computes() const override { return rig_.computes(); }
  ProbeCost cost() const override { return rig_.cost(); }
  std::string describe() const override { return rig_.describe(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return measure_expected(patterns, {});
  }
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override {
    SYMRIG_TRY(auto photographs, rig_.measure_expected(patterns, expected));
    for (std::size_t i = 0; i < photographs.size(); ++i)
      worst_ = std::max(worst_, misfit(rig_, patterns[i], photographs[i]));
    return photographs;
  }
  double worst() const { return worst_; }

 private:
  VirtualRig& rig_;
  double worst_ = 0;
};

// The sensor's noise depends on the pattern and on the frame's place in its bracket. So as long as nothing is
// taken again, the camera on the network must deliver the very codes of the camera in the process. Then the
// errors are equal to the last digit. A photograph that is taken again has other noise.
TEST(GenicamRig, captures_what_the_rig_in_the_process_captures) {
  const auto plain = open_virtual_rig(kScene);
  ASSERT_OK(plain);
  const auto expected = captured_errors(**plain, **plain);
  ASSERT_OK(expected);

  GigeRig lab(traits());
  const auto rig = lab.open(kScene);
  ASSERT_OK(rig);
  const auto errors = captured_errors(**rig, **rig);
  ASSERT_OK(errors);
  const RigTrouble& trouble = (*rig)->rig().trouble();
  const double allowed = trouble.retaken == 0 ? 0 : 0.05;
  const auto is = named(*errors), should = named(*expected);
  for (std::size_t k = 0; k < is.size(); ++k) {
    EXPECT_NEAR(is[k].second, should[k].second, allowed * should[k].second) << is[k].first;
    std::printf("%s %.5f, in the process %.5f\n", is[k].first, is[k].second, should[k].second);
  }
  EXPECT_EQ(trouble.frames[Verdict::certain] + trouble.frames[Verdict::guard] + trouble.frames.missing,
            static_cast<std::int64_t>(lab.pulses()));
  std::printf("%d pulses, %d photographs taken again\n", static_cast<int>(lab.pulses()),
              static_cast<int>(trouble.retaken));
}

/// The sensor of the camera on the network, whose driver is told nothing of it.
Result<Sensor> measured_sensor(GigeRig& lab, const char* scene) {
  SYMRIG_TRY(RigParts parts, lab.parts(scene));
  SYMRIG_TRY(const auto frames, FrameTaker::open(std::move(parts)));
  SceneTransfer transfer(frames->camera_grid(), frames->bits());
  const SceneSink sink{[&](const SceneLevel& level) { return transfer.begin(level); },
                       [&](auto first, auto second) { return transfer.add(first, second); }};
  SYMRIG_CHECK(take_sensor_frames(*frames, sink));
  const auto found = transfer.finish();
  if (!found) return found.error();
  if (found->sensor) return *found->sensor;
  return Error{ErrorCode::bad_value, "the camera is not linear"};
}

// Packets are lost on the way, so frames are taken again. The sensor that was measured stands in for the true
// one. The error of its gain scales the whole tensor, so that frobenius is its root sum of squares with that
// of the test above. Exposures differ, too, so each frame has other noise: over eight draws of noise,
// frobenius was within 3 % of that test's, and indirect within 6 %.
TEST(GenicamRig, measures_its_sensor_and_captures_with_it) {
  constexpr const char* kSmall = "sim:vgroove-textured?size=64x64";
  CameraTraits lossy = traits();
  lossy.packet_loss = 0.01;
  GigeRig unknown(lossy);
  const auto sensor = measured_sensor(unknown, kSmall);
  ASSERT_OK(sensor);
  EXPECT_NEAR(sensor->noise.full_well() / 20'000, 1, 5 * sensor->gain_sigma + 1.0 / 4095);
  EXPECT_NEAR(sensor->noise.read_noise() / 6, 1, 5 * sensor->read_noise_sigma);
  EXPECT_LT(sensor->gain_sigma, 0.006);
  EXPECT_NEAR(sensor->noise.pedestal(), 64, 0.05);
  const std::string file = testing::TempDir() + "/genicam_rig_sensor.toml";
  ASSERT_OK(save_sensor(file, *sensor));
  const auto loaded = load_sensor(file);
  ASSERT_OK(loaded);
  GigeRig lab(traits());
  lab.noise = loaded->noise;
  const auto rig = lab.open(kSmall);
  ASSERT_OK(rig);
  const auto errors = captured_errors(**rig, **rig);
  ASSERT_OK(errors);
  const double gain = std::abs(20'000 / sensor->noise.full_well() - 1);
  EXPECT_LT(errors->frobenius, 1.05 * std::hypot(0.00351, gain));
  EXPECT_LT(errors->indirect, 1.08 * std::hypot(0.03035, gain));
  std::printf("gain off by %.2f %%; frobenius %.5f, indirect %.5f\n", 100 * gain, errors->frobenius,
              errors->indirect);
}

// The rig's own description says 4 ms.
TEST(GenicamRig, waits_for_the_readout_that_the_camera_states) {
  CameraTraits slow = traits();
  slow.readout = 11ms;
  GigeRig lab(slow);
  const auto rig = lab.open("sim:vgroove-textured?size=64x64&exposures=4");
  ASSERT_OK(rig);
  ASSERT_OK((*rig)->measure(std::vector<Pattern>{law_pattern((*rig)->grid(), 1)}));
  EXPECT_GE(lab.shortest_gap(), 11ms);
  GigeRig quick(traits());
  const auto other = quick.open("sim:vgroove-textured?size=64x64&exposures=4");
  ASSERT_OK(other);
  EXPECT_LT(quick.shortest_gap(), 11ms);
  EXPECT_GE(quick.shortest_gap(), 4ms);
}

// The camera's own nodes set the delay and the overlap of the shutter. The photographs are those of the rig
// in the process, code by code. Without a strobe, exposures are known from the trigger and the delay only.
TEST(GenicamRig, plans_with_the_delay_and_the_overlap_of_the_cameras_nodes) {
  // Exposures of several milliseconds, so that an overlap saves time.
  constexpr const char* kSmall = "sim:vgroove-textured?size=32x32&exposures=2&light=0.2";
  const std::string late = "[features]\nTriggerDelay = 2500.0\n", overlap = "overlap = true\n";
  std::vector<double> rig_seconds;
  for (const std::string& keys : {std::string(), overlap, late, overlap + late}) {
    GigeRig lab(traits(), keys);
    lab.options = [](RigOptions& set) {
      set.setup = set.setup.without(RigRole::strobe);
      set.ledger.guards = 4;
    };
    const auto rig = lab.open(kSmall);
    ASSERT_OK(rig);
    std::vector<Pattern> patterns;
    for (std::uint64_t k = 0; k < 20; ++k) patterns.push_back(law_pattern((*rig)->grid(), 300 + k));
    const auto seen = (*rig)->measure(patterns);
    ASSERT_OK(seen);
    EXPECT_EQ((*rig)->rig().trouble().retaken, 0) << keys;
    for (std::size_t i = 0; i < patterns.size(); ++i)
      EXPECT_LT(misfit(**rig, patterns[i], (*seen)[i]), 1.6) << keys << " photograph " << i;
    rig_seconds.push_back((*rig)->cost().rig_seconds);
    std::printf("%.3f s of the rig%s\n", rig_seconds.back(), keys.empty() ? "" : (" with " + keys).c_str());
  }
  EXPECT_LT(rig_seconds[1], rig_seconds[0]);
  EXPECT_LT(rig_seconds[3], rig_seconds[2]);
}

/// One mishap in fifty pulses.
std::function<Mishap()> dice() {
  return [random = std::mt19937(5)]() mutable {  // NOLINT: the same faults each time
    constexpr std::array kMishaps{Mishap::trigger_dropped, Mishap::frame_dropped, Mishap::swapped,
                                  Mishap::late};
    const auto roll = static_cast<std::size_t>(random() % 200);
    return roll < kMishaps.size() ? kMishaps[roll] : Mishap::none;
  };
}

// Half the pixels of each pattern are others than of any other pattern, hundreds of sigmas away. The misfit
// of the right one is 1 ± √(2/4096) from noise; black, lamp and merge share the rest of the allowance.
TEST(GenicamRig, takes_only_photographs_of_what_it_was_asked_for) {
  CameraTraits faulty = traits();
  faulty.packet_loss = 0.01;
  GigeRig lab(faulty);
  lab.options = [](RigOptions& options) {
    options.retakes = 60;
    options.frame_patience = 100ms;
  };
  const auto rig = lab.open("sim:vgroove-textured?size=64x64&exposures=4");
  ASSERT_OK(rig);
  std::vector<Pattern> patterns;
  for (std::uint64_t k = 0; k < 60; ++k) patterns.push_back(law_pattern((*rig)->grid(), 1000 + k));
  lab.mishap = dice();
  const auto photographs = (*rig)->measure(patterns);
  ASSERT_OK(photographs);
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    EXPECT_LT(misfit(**rig, patterns[i], (*photographs)[i]), 1.6) << "photograph " << i;
    EXPECT_GT(misfit(**rig, patterns[(i + 1) % patterns.size()], (*photographs)[i]), 100) << "the test sees";
  }
  const RigTrouble& trouble = (*rig)->rig().trouble();
  EXPECT_GT(trouble.retaken, 0);
  EXPECT_GT(trouble.frames.missing, 0);
  std::printf("%d pulses, %d photographs taken again; frames: %s\n", static_cast<int>(lab.pulses()),
              static_cast<int>(trouble.retaken), trouble.frames.trouble().c_str());
}

// The misfit of the right photograph is 1 ± √(2/4096) from noise, as above. A photograph with one frame of
// another pattern is far from it.
TEST(GenicamRig, a_capture_goes_on_through_losses_and_restarts) {
  CameraTraits faulty = traits();
  faulty.packet_loss = 0.01;
  GigeRig lab(faulty);
  lab.options = [](RigOptions& options) { options.retakes = 60; };
  const auto rig = lab.open(kScene);
  ASSERT_OK(rig);
  std::uint64_t restarts = 0;
  lab.mishap = [&lab, &restarts, roll = dice()] {
    if (restarts < 2 && lab.pulses() >= 150 * (restarts + 1)) {
      lab.device().reboot();
      ++restarts;
    }
    return roll();
  };
  JudgedRig judged(**rig);
  const auto errors = captured_errors(judged, **rig);
  ASSERT_OK(errors);
  EXPECT_LT(judged.worst(), 1.6);
  EXPECT_EQ(restarts, 2U);
  const RigTrouble& trouble = (*rig)->rig().trouble();
  EXPECT_EQ(trouble.cameras_reopened, 2);
  EXPECT_GT(trouble.retaken, 0);
  std::printf("frobenius %.5f; %d pulses, %d photographs taken again; worst misfit %.3f; frames: %s\n",
              errors->frobenius, static_cast<int>(lab.pulses()), static_cast<int>(trouble.retaken),
              judged.worst(), trouble.frames.trouble().c_str());
}

}  // namespace
}  // namespace symrig::genicam_rig_test
