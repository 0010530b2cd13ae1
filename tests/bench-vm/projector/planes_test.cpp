// SPDX-License-Identifier: Apache-2.0
// Bit planes on a real kernel: an emulated DLPC350 behind USB/IP, met by hidraw, and vkms as its screen. The
// pixels are read from the memory that vkms scans out.
#include "bench-vm/projector/expected_screens.hpp"
#include "dlpc/controller_on_usb.hpp"
#include "dlpc/emulated_dlpc350.hpp"
#include "projector/dlp/find_controllers.hpp"
#include "projector/dlp/plane_projector.hpp"
#include "projector/dlpc350/video_patterns.hpp"
#include "symrig/base/random.hpp"
#include "symrig/projector/dlp_controller.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <thread>

namespace symrig::bench_vm::planes_test {
namespace {

using namespace projector::dlp;

/// Waits until the kernel has bound the device to hidraw.
bool attached() {
  for (const char* const command :
       {"modprobe usbhid", "modprobe hid-generic", "ip link set lo up", "usbip attach -r 127.0.0.1 -b 1-1"})
    if (std::system(command) != 0) return false;  // NOLINT(concurrency-mt-unsafe,cert-env33-c)
  for (int tries = 0; tries < 300 && find_controllers().empty(); ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return !find_controllers().empty();
}

/// A thread shows one picture in each refresh of a real kernel. The machine is emulated, so some come late.
/// What was told of them must fit together, and the last one must be on the screen.
void expect_played(PlaneProjector& projector, const std::string& card) {
  const std::vector<Pattern> patterns{Pattern(projector.grid()), Pattern(projector.grid(), 1, 1.F)};
  const std::vector<PlanePlan> plans{PlanePlan(24, 0), PlanePlan(24, 1)};
  ASSERT_TRUE(projector.load_planes(patterns, plans).ok());
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < 121; ++k) order.push_back(k % 2);
  const auto first = projector.play(order);
  ASSERT_TRUE(first.ok()) << first.error().line();
  const auto shown = projector.played();
  ASSERT_TRUE(shown.ok()) << shown.error().line();
  ASSERT_GE(shown->size(), 2U);
  EXPECT_EQ(shown->front().shown.refresh, first->refresh);
  std::size_t in_time = 0;
  for (std::size_t k = 1; k < shown->size(); ++k) {
    const auto &before = (*shown)[k - 1].shown, &now = (*shown)[k].shown;
    ASSERT_GT(now.refresh, before.refresh);
    // vkms stamps by a timer of 60 Hz: 1 us and 1 ns a refresh, as refreshes_test.cpp has it.
    const auto refreshes = static_cast<std::int64_t>(now.refresh - before.refresh);
    const Nanoseconds off = now.since - before.since - refreshes * projector.refresh_period();
    EXPECT_LE(std::max(off, -off).count(), 1000 + refreshes);
    in_time += (*shown)[k].picture == order[std::min<std::uint64_t>(now.refresh - first->refresh, 120)];
  }
  std::cout << in_time << " of " << order.size() - 1 << " pictures in their own refresh\n";
  const auto seen = read_screen(card);
  ASSERT_TRUE(seen.ok()) << seen.error().line();
  EXPECT_EQ(seen->rgb[0], shown->back().picture == 1 ? 0xFFFFFFU : 0U);
}

TEST(Planes, of_a_real_screen_are_the_planned_patterns_and_the_controller_is_left_as_it_was) {
  const auto device = std::make_shared<symrig::test::EmulatedDlpc350>();
  symrig::test::UsbIpServer server(symrig::test::on_usb(device));
  ASSERT_TRUE(attached());
  const auto state = [&] {
    const std::scoped_lock lock(server.mutex());
    return device->state();
  };
  const std::string before = state();
  const auto found = find_dlp_controllers();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].error, "");
  EXPECT_EQ(found[0].product, "DLPC350");
  EXPECT_EQ(found[0].firmware, "3.1.0");

  const GuestDisplay display = display_of("BENCH_VKMS");
  DrmProjectorOptions wanted;
  wanted.connector = display.connector;
  wanted.mode = "912x1140R@60";
  wanted.placement = {.cell = 57};
  {
    auto transport = open_transport(kDlpc350, "");
    ASSERT_TRUE(transport.ok()) << transport.error().line();
    EXPECT_EQ(open_transport(kDlpc350, "").error().code, ErrorCode::device_lost) << "one program at a time";
    auto screen = open_projector(wanted);
    ASSERT_TRUE(screen);
    auto opened = PlaneProjector::open(
        std::move(screen), {}, [&](const PictureSource& source) -> Result<std::unique_ptr<PlaneSequence>> {
          SYMRIG_TRY(auto begun, projector::dlpc350::VideoPatterns::begin(
                                     projector::dlpc350::Controller(*std::move(transport)), source, {}));
          return std::unique_ptr<PlaneSequence>(std::move(begun));
        });
    ASSERT_TRUE(opened.ok()) << opened.error().line();
    PlaneProjector& projector = **opened;
    Random random(5);
    std::vector<Pattern> patterns(30, Pattern(projector.grid()));
    for (Pattern& pattern : patterns)
      for (float& value : pattern.values()) value = random.uniform() < 0.5 ? 0.F : 1.F;
    PlanePlan plan;
    for (int k = 0; k < 24; ++k) plan.push_back((7 * k) % 30);
    ASSERT_TRUE(projector.load_planes(patterns, {&plan, 1}).ok());
    ASSERT_TRUE(projector.show(0).ok());
    ASSERT_TRUE(projector.check().ok());
    const auto seen = read_screen(display.card);
    ASSERT_TRUE(seen.ok()) << seen.error().line();
    std::size_t differing = 0;
    for (int row = 0; row < 1140; ++row)
      for (int col = 0; col < 912; ++col)
        for (int k = 0; k < 24; ++k) {
          const int shift = k < 8 ? 8 + k : k < 16 ? k + 8 : k - 16;
          const std::uint32_t word =
              seen->rgb[static_cast<std::size_t>(row) * 912 + static_cast<std::size_t>(col)];
          const float lit =
              patterns[static_cast<std::size_t>(plan[static_cast<std::size_t>(k)])].at(row / 57, col / 57);
          differing += (word >> static_cast<unsigned>(shift) & 1U) != (lit > 0 ? 1U : 0U);
        }
    EXPECT_EQ(differing, 0U);
    expect_played(projector, display.card);
    const std::scoped_lock lock(server.mutex());
    EXPECT_TRUE(device->shows_sequence());
  }
  EXPECT_EQ(state(), before);
}

}  // namespace
}  // namespace symrig::bench_vm::planes_test
