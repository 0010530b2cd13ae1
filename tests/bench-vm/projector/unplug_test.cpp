// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/projector/expected_screens.hpp"
#include "bench-vm/projector/guest_plug.hpp"

#include <thread>

namespace symrig::bench_vm::unplug_test {
namespace {

// AddressSanitizer finds leaks in each cycle; without it fewer cycles are enough.
#ifdef __SANITIZE_ADDRESS__
constexpr int kCycles = 200;
#else
constexpr int kCycles = 40;
#endif

class Unplug : public ::testing::Test {
 protected:
  Unplug() {
    options.connector = display.connector;
    options.mode = "640x480@60";
  }
  std::unique_ptr<DrmProjector> open() {
    auto projector = open_projector(options);
    if (projector) {
      const auto loaded = projector->load(
          std::vector<Pattern>{Pattern(projector->grid(), 1, 1.F), Pattern(projector->grid())});
      EXPECT_TRUE(loaded.ok());
    }
    return projector;
  }

  GuestDisplay display = display_of("BENCH_VKMS");
  DrmProjectorOptions options;
};

TEST_F(Unplug, is_told_by_name_each_time_and_the_projector_opens_again) {
  const GuestPlug plug(display.connector);
  open().reset();  // libdrm keeps some objects of the first cycle; they do not count
  const std::size_t files = open_files();
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    options.legacy = cycle % 2 == 1;
    const auto projector = open();
    ASSERT_TRUE(projector) << "cycle " << cycle;
    for (const std::size_t k : {0, 1}) ASSERT_TRUE(projector->show(k).ok()) << "cycle " << cycle;
    plug.out();
    const auto lost = projector->show(0);
    ASSERT_FALSE(lost.ok()) << "cycle " << cycle;
    EXPECT_EQ(lost.error().code, ErrorCode::device_lost);
    EXPECT_NE(lost.error().what.find(display.connector), std::string::npos) << lost.error().line();
    const auto absent = DrmProjector::open(options);
    ASSERT_FALSE(absent.ok());
    EXPECT_EQ(absent.error().code, ErrorCode::device_lost) << absent.error().line();
    plug.in();
    EXPECT_FALSE(projector->show(0).ok()) << "it must be opened anew";
  }
  EXPECT_EQ(open_files(), files);
}

TEST_F(Unplug, at_any_moment_is_told) {
  const GuestPlug plug(display.connector);
  for (int cycle = 0; cycle < 20; ++cycle) {
    const auto projector = open();
    ASSERT_TRUE(projector) << "cycle " << cycle;
    std::thread hand([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(3 + 7 * cycle));
      plug.out();
    });
    Result<Shown> shown = Shown{};
    for (std::size_t k = 0; shown && k < 10'000; ++k) shown = projector->show(k % 2);
    hand.join();
    ASSERT_FALSE(shown.ok());
    EXPECT_EQ(shown.error().code, ErrorCode::device_lost) << shown.error().line();
    plug.in();
  }
}

}  // namespace
}  // namespace symrig::bench_vm::unplug_test
