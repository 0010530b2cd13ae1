// SPDX-License-Identifier: Apache-2.0
// Displays: the bench reads back exactly what a program shows, on vkms and on QEMU's adapter.
#include "assert_ok.hpp"
#include "bench-vm/scanout/scanout.hpp"
#include "bench-vm/selftest/guest.hpp"
#include "bench-vm/selftest/screen.hpp"

#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

namespace symrig::bench_vm::screens_test {
namespace {

std::vector<std::uint32_t> random_pixels(std::size_t count) {
  std::mt19937 random(7);
  std::vector<std::uint32_t> rgb(count);
  for (std::uint32_t& pixel : rgb) pixel = random() & 0x00ff'ffffU;
  return rgb;
}

/// Shows `rgb` and expects to read back the same.
void expect_read_back(Screen& screen, const std::string& card, std::vector<std::uint32_t> rgb) {
  ASSERT_EQ(screen.show(rgb), "");
  const auto seen = read_screen(card);
  ASSERT_OK(seen);
  EXPECT_EQ(differing_pixels(*seen, {0, screen.rows(), screen.cols(), std::move(rgb)}), 0U);
}

TEST(Vkms, shows_what_can_be_read_back) {
  const std::string card = place("BENCH_VKMS");
  for (const auto& [cols, rows] : {std::pair{1024, 768}, std::pair{1920, 1080}}) {
    Screen screen(card, cols, rows);
    ASSERT_EQ(screen.error(), "");
    const auto random = random_pixels(static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols));
    expect_read_back(screen, card, random);
    std::vector<std::uint32_t> other = random;
    other[12345] ^= 1U;
    expect_read_back(screen, card, other);
    const auto seen = read_screen(card);
    ASSERT_OK(seen);
    EXPECT_EQ(differing_pixels(*seen, {0, rows, cols, random}), 1U);
  }
}

TEST(Screens, that_are_not_there_are_named) {
  const auto seen = read_screen("/dev/dri/card7");
  ASSERT_FALSE(seen);
  EXPECT_EQ(seen.error().code, ErrorCode::not_found);
  EXPECT_NE(seen.error().what.find("card7"), std::string::npos);
}

TEST(Vga, shows_what_can_be_read_back_and_photographed_from_outside) {
  const std::string card = place("BENCH_VGA");
  Screen screen(card, 912, 1140);
  ASSERT_EQ(screen.error(), "");
  const auto random = random_pixels(std::size_t{912} * 1140);
  expect_read_back(screen, card, random);
  ASSERT_EQ(std::system("bench-screendump shot"), 0);  // NOLINT(*-mt-unsafe,cert-env33-c)
  const std::string file = read_text(place("BENCH_OUT") + "/shot.ppm");
  const auto shot = parse_ppm(std::as_bytes(std::span(file)));
  ASSERT_OK(shot);
  EXPECT_EQ(differing_pixels(*shot, {0, 1140, 912, random}), 0U);
}

TEST(Screendump, of_a_bad_name_is_refused) {
  EXPECT_NE(std::system("bench-screendump ../shot 2>/dev/null"), 0);  // NOLINT(*-mt-unsafe,cert-env33-c)
}

}  // namespace
}  // namespace symrig::bench_vm::screens_test
