// SPDX-License-Identifier: Apache-2.0
// The screen is restored: afterwards it shows what it showed before (the kernel's console).
#include "bench-vm/projector/expected_screens.hpp"

namespace symrig::bench_vm::restore_test {
namespace {

class Restore : public ::testing::TestWithParam<std::pair<const char*, bool>> {};

TEST_P(Restore, the_console_comes_back_in_its_mode) {
  const GuestDisplay display = display_of(GetParam().first);
  const auto before = read_screen(display.card);
  ASSERT_TRUE(before.ok()) << before.error().line();
  DrmProjectorOptions options;
  options.connector = display.connector;
  options.mode = "640x480@60";
  options.legacy = GetParam().second;
  {
    const auto projector = open_projector(options);
    ASSERT_TRUE(projector);
    const auto during = read_screen(display.card);
    ASSERT_TRUE(during.ok()) << during.error().line();
    EXPECT_EQ(during->cols, 640);
    EXPECT_EQ(differing_pixels(*during, expected_screen(Pattern(projector->grid()), {}, projector->screen())),
              0U)
        << "black until the first pattern";
  }
  const auto after = read_screen(display.card);
  ASSERT_TRUE(after.ok()) << after.error().line();
  EXPECT_EQ(after->framebuffer, before->framebuffer);
  EXPECT_EQ(after->cols, before->cols);
  EXPECT_EQ(after->rows, before->rows);
}

INSTANTIATE_TEST_SUITE_P(All, Restore,
                         ::testing::Values(std::pair("BENCH_VKMS", false), std::pair("BENCH_VKMS", true),
                                           std::pair("BENCH_VGA", false), std::pair("BENCH_VGA", true)));

}  // namespace
}  // namespace symrig::bench_vm::restore_test
