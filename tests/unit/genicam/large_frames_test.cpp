// SPDX-License-Identifier: Apache-2.0
// Frames larger than the socket that a distribution allows: 640x512 Mono16, sent as fast as the machine can.
#include "assert_ok.hpp"
#include "gige/gige_camera.hpp"
#include "symrig/camera/internal/genicam_camera.hpp"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

namespace symrig::large_frames_test {
namespace {

using namespace std::chrono_literals;
using camera::GenicamCamera;
using camera::GenicamSettings;
using gige::CameraTraits;
using gige::GigeCamera;

constexpr std::size_t kDebianLimit = 212'992;  // net.core.rmem_max of Debian 12
constexpr std::size_t kFrame = std::size_t{512} * 640 * 2;

/// few: each lost frame takes 0.1 s, until Aravis gives it up.
std::uint64_t pulses(bool few) {
  if (std::getenv("SYMRIG_LONG") == nullptr) return 40;
  return few ? 400 : 10'000;
}

CameraTraits large() {
  CameraTraits traits;
  traits.rows = 512;
  traits.cols = 640;
  return traits;
}

struct Outcome {
  StreamReport report;
  std::uint64_t exposed = 0, right = 0, wrong = 0;
  std::string words;  // of the socket
};

/// Each frame is taken before the next pulse. The last pulse is repeated until its frame arrives, whole or
/// not: then a frame that is lost has left a gap.
void take_all(const GenicamSettings& settings, GigeCamera& device, Outcome& outcome) {
  auto opened = GenicamCamera::open(settings);
  ASSERT_OK(opened);
  GenicamCamera& camera = **opened;
  const std::uint64_t count = pulses(settings.socket_limit.has_value());
  for (bool last = false; outcome.exposed < count || !last;) {
    ASSERT_LT(outcome.exposed, count + 50) << camera.report().to_string();
    device.pulse(300us);
    ++outcome.exposed;
    const auto frames = camera.take(1, 500ms);
    ASSERT_OK(frames);
    for (const CameraFrame& frame : *frames) {
      last = frame.sequence == outcome.exposed;
      if (frame.damaged) continue;
      const std::uint32_t counter = frame.raw[0];  // 16 bits are enough
      (gige::shows(frame.raw, counter, 300us) ? outcome.right : outcome.wrong) += 1;
    }
  }
  outcome.report = camera.report();
  for (const std::string& note : outcome.report.notes)
    if (note.find("found this computer's socket full") != std::string::npos) outcome.words = note;
}

void print(const char* what, const Outcome& outcome, const GigeCamera& device) {
  std::printf("%s: %d exposed, %d right; %s; %d packets sent again. %s\n", what,
              static_cast<int>(outcome.exposed), static_cast<int>(outcome.right),
              outcome.report.to_string().c_str(), static_cast<int>(device.packets_resent()),
              outcome.words.c_str());
}

void expect_each_named(const Outcome& outcome) {
  const StreamReport& report = outcome.report;
  EXPECT_EQ(outcome.wrong, 0U);
  EXPECT_EQ(report.delivered + report.missing + report.overflowed, outcome.exposed) << report.to_string();
  EXPECT_EQ(report.delivered, outcome.right + report.damaged);
}

GenicamSettings settings_of(const GigeCamera& device) {
  GenicamSettings settings;
  settings.device = device.address();
  settings.format = "Mono16";
  return settings;
}

// The socket holds about 180 packets of the 450 of a frame.
TEST(LargeFrames, losses_in_a_small_socket_are_named_with_their_cure) {
  CameraTraits traits = large();
  traits.resends = false;
  GigeCamera device(traits, gige::numbered_scene);
  GenicamSettings settings = settings_of(device);
  settings.socket_limit = kDebianLimit;
  Outcome outcome;
  take_all(settings, device, outcome);
  print("small socket", outcome, device);
  expect_each_named(outcome);
  if (outcome.report.damaged + outcome.report.missing == 0) return;
  EXPECT_NE(outcome.words.find("sudo sysctl -w net.core.rmem_max=33554432"), std::string::npos)
      << outcome.words;
}

TEST(LargeFrames, resent_packets_make_up_for_a_small_socket_or_the_loss_is_named) {
  GigeCamera device(large(), gige::numbered_scene);
  GenicamSettings settings = settings_of(device);
  settings.socket_limit = kDebianLimit;
  Outcome outcome;
  take_all(settings, device, outcome);
  print("small socket, packets sent again", outcome, device);
  expect_each_named(outcome);
}

TEST(LargeFrames, nothing_is_lost_in_a_socket_that_holds_them) {
  std::size_t allowed = 0;
  // In the kernel, packets of 1.5 KB need up to 2.3 KB, and the socket may hold twice its size.
  if (!(std::ifstream("/proc/sys/net/core/rmem_max") >> allowed) || allowed < 4 * kFrame)
    GTEST_SKIP() << "net.core.rmem_max is " << allowed << ": sudo sysctl -w net.core.rmem_max=33554432";
  GigeCamera device(large(), gige::numbered_scene);
  const GenicamSettings settings = settings_of(device);
  Outcome outcome;
  take_all(settings, device, outcome);
  print("large socket", outcome, device);
  expect_each_named(outcome);
  EXPECT_EQ(outcome.right, outcome.exposed) << outcome.report.to_string();
  EXPECT_EQ(outcome.words, "");
}

}  // namespace
}  // namespace symrig::large_frames_test
