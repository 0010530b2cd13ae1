// SPDX-License-Identifier: Apache-2.0
// Bit planes on a real kernel: an emulated controller behind USB/IP, met by hidraw, and vkms as its screen.
// The pixels are read from the memory that vkms scans out.
#include "symrig/projector/internal/planes.hpp"

#include "bench-vm/projector/expected_screens.hpp"
#include "dlpc/controller_on_usb.hpp"
#include "dlpc/emulated_controller.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/projector/find_projectors.hpp"
#include "symrig/projector/internal/dlp_link.hpp"
#include "symrig/projector/internal/dlpc350.hpp"
#include "symrig/projector/internal/dlpc900.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <thread>

namespace symrig::bench_vm::planes_test {
namespace {

using namespace projector::dlp;

bool is_there(const ControllerKind& kind) {
  return std::ranges::any_of(find_controllers(),
                             [&](const FoundController& one) { return one.kind == kind; });
}

/// Waits until the kernel has bound the device to hidraw.
bool attached(const ControllerKind& kind) {
  for (const char* const command :
       {"modprobe usbhid", "modprobe hid-generic", "ip link set lo up", "usbip attach -r 127.0.0.1 -b 1-1"})
    if (std::system(command) != 0) return false;  // NOLINT(concurrency-mt-unsafe,cert-env33-c)
  for (int tries = 0; tries < 300 && !is_there(kind); ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return is_there(kind);
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

/// A controller, the screen that feeds it, and how its driver begins.
struct Rig {
  ControllerKind kind;
  std::shared_ptr<symrig::test::EmulatedController> device;
  std::string firmware, mode;
  Grid screen;
  int cell = 0;
  std::function<Result<std::unique_ptr<PlaneSequence>>(std::unique_ptr<HidTransport>, const PictureSource&)>
      begin;
};

/// How many planes of all screen pixels differ from the planned patterns.
std::size_t differing_planes(const ScreenPixels& seen, const std::vector<Pattern>& patterns,
                             const PlanePlan& plan, const Rig& rig) {
  std::size_t differing = 0;
  for (int row = 0; row < rig.screen.rows; ++row)
    for (int col = 0; col < rig.screen.cols; ++col)
      for (int k = 0; k < 24; ++k) {
        const int shift = k < 8 ? 8 + k : k < 16 ? k + 8 : k - 16;
        const std::uint32_t word = seen.rgb[static_cast<std::size_t>(row) * rig.screen.cols + col];
        const float lit = patterns[static_cast<std::size_t>(plan[static_cast<std::size_t>(k)])].at(
            row / rig.cell, col / rig.cell);
        differing += (word >> static_cast<unsigned>(shift) & 1U) != (lit > 0 ? 1U : 0U);
      }
  return differing;
}

/// Shows 24 random planes and reads each pixel, then plays.
void expect_planes(PlaneProjector& projector, const Rig& rig, const std::string& card) {
  Random random(5);
  std::vector<Pattern> patterns(30, Pattern(projector.grid()));
  for (Pattern& pattern : patterns)
    for (float& value : pattern.values()) value = random.uniform() < 0.5 ? 0.F : 1.F;
  PlanePlan plan;
  for (int k = 0; k < 24; ++k) plan.push_back((7 * k) % 30);
  ASSERT_TRUE(projector.load_planes(patterns, {&plan, 1}).ok());
  ASSERT_TRUE(projector.show(0).ok());
  ASSERT_TRUE(projector.check().ok());
  const auto seen = read_screen(card);
  ASSERT_TRUE(seen.ok()) << seen.error().line();
  EXPECT_EQ(differing_planes(*seen, patterns, plan, rig), 0U);
  expect_played(projector, card);
}

void expect_planes_of(const Rig& rig) {
  symrig::test::UsbIpServer server(symrig::test::on_usb(rig.device));
  ASSERT_TRUE(attached(rig.kind));
  const auto state = [&] {
    const std::scoped_lock lock(server.mutex());
    return rig.device->state();
  };
  const std::string before = state();
  const auto found = find_dlp_controllers();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].error, "");
  EXPECT_EQ(found[0].product, rig.kind.name);
  EXPECT_EQ(found[0].firmware, rig.firmware);

  const GuestDisplay display = display_of("BENCH_VKMS");
  DrmProjectorOptions wanted;
  wanted.connector = display.connector;
  wanted.mode = rig.mode;
  wanted.placement = {.cell = rig.cell};
  {
    auto transport = open_transport(rig.kind, "");
    ASSERT_TRUE(transport.ok()) << transport.error().line();
    EXPECT_EQ(open_transport(rig.kind, "").error().code, ErrorCode::device_lost) << "one program at a time";
    auto screen = open_projector(wanted);
    ASSERT_TRUE(screen);
    auto opened = PlaneProjector::open(std::move(screen), {}, [&](const PictureSource& source) {
      return rig.begin(*std::move(transport), source);
    });
    ASSERT_TRUE(opened.ok()) << opened.error().line();
    expect_planes(**opened, rig, display.card);
    const std::scoped_lock lock(server.mutex());
    EXPECT_TRUE(rig.device->shows_sequence());
  }
  EXPECT_EQ(state(), before);
}

/// What Result's conversions do not do: a driver's sequence as any sequence.
template <class Sequence>
Result<std::unique_ptr<PlaneSequence>> as_planes(Result<std::unique_ptr<Sequence>> begun) {
  if (!begun) return begun.error();
  return std::unique_ptr<PlaneSequence>(*std::move(begun));
}

TEST(Planes, of_a_real_screen_are_the_planned_patterns_and_the_controller_is_left_as_it_was) {
  using namespace projector::dlpc350;
  expect_planes_of({kDlpc350,
                    std::make_shared<symrig::test::EmulatedDlpc350>(),
                    "3.1.0",
                    "912x1140R@60",
                    {1140, 912},
                    57,
                    [](std::unique_ptr<HidTransport> transport, const PictureSource& source) {
                      return as_planes(VideoPatterns::begin(
                          projector::dlpc350::Controller(std::move(transport)), source, {}));
                    }});
}

TEST(Planes, of_a_dlpc900_are_the_planned_patterns_too) {
  using namespace projector::dlpc900;
  expect_planes_of({kDlpc900,
                    std::make_shared<symrig::test::EmulatedDlpc900>(),
                    "6.0.1",
                    "1920x1080@60",
                    {1080, 1920},
                    120,
                    [](std::unique_ptr<HidTransport> transport, const PictureSource& source) {
                      return as_planes(VideoPlanes::begin(
                          projector::dlpc900::Controller(std::move(transport)), source, {}));
                    }});
}

}  // namespace
}  // namespace symrig::bench_vm::planes_test
