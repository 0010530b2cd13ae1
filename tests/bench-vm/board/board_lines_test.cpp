// SPDX-License-Identifier: Apache-2.0
// What libgpiod tells of a real kernel's lines, by the version that this program was built with: 1.6 or 2.
#include "daemon_process.hpp"
#include "libgpiod/chip_lines.hpp"

#include <cerrno>

namespace symrig::bench::board_lines_test {
namespace {

using board_linux::chip_lines;

std::vector<board_linux::LineInfo> lines_now() {
  return chip_lines(bench_vm::place("BENCH_GPIO_CHIP")).value_or(std::vector<board_linux::LineInfo>());
}

TEST(BoardLines, HaveTheirNamesInOrder) {
  const auto lines = lines_now();
  std::istringstream names(bench_vm::place("BENCH_GPIO_LINES"));
  std::size_t offset = 0;
  for (std::string name; names >> name; ++offset) {
    ASSERT_LT(offset, lines.size());
    EXPECT_EQ(lines[offset].name, name);
    EXPECT_FALSE(lines[offset].used) << name;
    EXPECT_EQ(lines[offset].consumer, "") << name;
  }
  EXPECT_EQ(lines.size(), offset);
}

TEST(BoardLines, TellWhoHoldsThem) {
  const DaemonProcess daemon;
  ASSERT_NE(daemon.log().find("serves"), std::string::npos) << daemon.log();
  const auto lines = lines_now();
  ASSERT_EQ(lines.size(), 16U);
  for (std::size_t k = 0; k < 12; ++k) {  // the lines of boards/linux/board.toml
    EXPECT_TRUE(lines[k].used) << lines[k].name;
    EXPECT_EQ(lines[k].consumer, "symrigd") << lines[k].name;
  }
  for (std::size_t k = 12; k < 16; ++k) EXPECT_FALSE(lines[k].used) << lines[k].name;
}

/// The chip's own resistor holds an input that nothing drives.
TEST(BoardLines, InputsHaveTheirBias) {
  const GpioChip chip;
  const auto input = [](const std::string& name, const std::string& rest) {
    return "[[input]]\nname = \"" + name + "\"\n" + rest;
  };
  chip.pull("interlock", false);
  chip.pull("in_a", true);
  chip.pull("in_b", true);
  {
    const DaemonProcess daemon("", "[[output]]\nname = \"aux0\"\n" + input("interlock", "bias = \"up\"\n") +
                                       input("in_a", "bias = \"down\"\n") + input("in_b", ""));
    ASSERT_NE(daemon.log().find("serves"), std::string::npos) << daemon.log();
    EXPECT_TRUE(chip.value("interlock"));
    EXPECT_FALSE(chip.value("in_a"));
    EXPECT_TRUE(chip.value("in_b"));
  }
  for (const char* line : {"interlock", "in_a", "in_b"}) chip.pull(line, false);
}

/// Another program has a line: the daemon names the line and that program.
TEST(BoardLines, ALineInUseIsRefusedWithItsUser) {
  DaemonProcess first;
  EXPECT_EQ(first.once("--safe"), 3);
  EXPECT_NE(first.log().find("is in use by 'symrigd'"), std::string::npos) << first.log();
}

TEST(BoardLines, AChipThatCannotBeOpenedLeavesItsCause) {
  errno = 0;
  EXPECT_FALSE(chip_lines("/dev/gpiochip99"));
  EXPECT_EQ(errno, ENOENT);
  ASSERT_EQ(::seteuid(65534), 0);
  const auto shut = chip_lines(bench_vm::place("BENCH_GPIO_CHIP"));
  const int cause = errno;
  ASSERT_EQ(::seteuid(0), 0);
  EXPECT_FALSE(shut);
  EXPECT_EQ(cause, EACCES);
}

}  // namespace
}  // namespace symrig::bench::board_lines_test
