// SPDX-License-Identifier: Apache-2.0
#include "board_file.hpp"

#include "assert_ok.hpp"
#include "kept_files.hpp"

#include <array>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

namespace symrig::board_linux::test::board_file_test {
namespace {

Result<BoardFile> parse(std::string_view text) {
  return parse_board_file(text, "board.toml");
}

TEST(BoardFile, AnEmptyOneIsTheDefaultBoard) {
  const auto file = parse("");
  ASSERT_OK(file);
  EXPECT_EQ(file->lines.size(), 12U);
  EXPECT_EQ(file->links.unix_socket, "/run/symrig/board.sock");
  EXPECT_EQ(file->links.tcp_port, 0) << "no network unless asked for";
}

TEST(BoardFile, ReadsEverything) {
  const auto file = parse(R"(
[board]
name = "left"
id = "00ff10"
led = "/sys/class/leds/ACT/brightness"
[[output]]
name = "camera_trigger"
gpio = "GPIO17"
pin = "header 11"
[[input]]
name = "vsync"
[[input]]
name = "interlock"
bias = "up"
[[input]]
name = "in_a"
bias = "down"
[[input]]
name = "in_b"
bias = "off"
[link]
usb = "/dev/ffs-symrig"
tcp = "127.0.0.1:7700"
serial = "/dev/ttyS0"
baud = 921600
[realtime]
priority = 0
awake = false
lock_memory = false
lateness_us = 500
[folder]
state = "/tmp/state"
run = "/tmp/run"
)");
  ASSERT_OK(file);
  EXPECT_EQ(file->name, "left");
  EXPECT_EQ(file->lines.at(0).gpio, "GPIO17");
  EXPECT_EQ(file->lines.at(0).pin, "header 11");
  EXPECT_TRUE(file->lines.at(0).output);
  EXPECT_EQ(file->lines.at(1).gpio, "vsync") << "the GPIO line's name is the board's, unless told";
  EXPECT_FALSE(file->lines.at(1).output);
  EXPECT_EQ(file->lines.at(1).bias, Bias::as_is);
  EXPECT_EQ(file->lines.at(2).bias, Bias::up);
  EXPECT_EQ(file->lines.at(3).bias, Bias::down);
  EXPECT_EQ(file->lines.at(4).bias, Bias::off);
  EXPECT_EQ(file->links.tcp_host, "127.0.0.1");
  EXPECT_EQ(file->links.tcp_port, 7700);
  EXPECT_TRUE(file->links.unix_socket.empty()) << "what is not named is not offered";
  EXPECT_EQ(file->priority, 0);
  EXPECT_FALSE(file->awake);
  EXPECT_EQ(file->lateness_us, 500U);
  const auto id = unique_id(*file);
  ASSERT_OK(id);
  EXPECT_EQ(hexadecimal(*id), "00ff10");
}

struct Wrong {
  const char* text;
  const char* says;
};

class WrongBoardFile : public testing::TestWithParam<Wrong> {};

TEST_P(WrongBoardFile, IsRefusedInOneLine) {
  const auto file = parse(GetParam().text);
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::bad_format);
  EXPECT_NE(file.error().line().find(GetParam().says), std::string::npos) << file.error().line();
  EXPECT_EQ(file.error().line().find('\n'), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    All, WrongBoardFile,
    testing::Values(
        Wrong{"[", "board.toml:1"}, Wrong{"[bord]", "unknown key 'bord'"},
        Wrong{"[link]\nuxix = \"x\"", "unknown key 'uxix'"}, Wrong{"board = 3", "'board' is not a table"},
        Wrong{"[board]\nname = 3", "'name' is not a text"},
        Wrong{"[board]\nid = \"xy\"", "'id' is not hexadecimal"},
        Wrong{"[board]\nname = \"a name that is much too long for it\"", "longer than 23"},
        Wrong{"[link]\ntcp = \"here\"", "not ADDRESS:PORT"},
        Wrong{"[link]\ntcp = \"a:0\"", "not ADDRESS:PORT"}, Wrong{"[link]\nbaud = 5", "not within 1200 to"},
        Wrong{"[realtime]\npriority = 99", "not within 0 to 98"}, Wrong{"output = 3", "write [[output]]"},
        Wrong{"[[output]]\npin = \"1\"", "without a name"}, Wrong{"[[input]]\nname = \"a\"", "0 outputs"},
        Wrong{"[[output]]\nname = \"a\"\n[[input]]\nname = \"b\"\nbias = \"pull-up\"",
              "'bias' is 'pull-up'; legal values: as-is, up, down, off"},
        Wrong{"[[output]]\nname = \"a\"\nbias = \"up\"", "unknown key 'bias'"},
        Wrong{"[[output]]\nname = \"a\"\n[[input]]\nname = \"a\"", "two lines are called 'a'"},
        Wrong{"[[output]]\nname = \"a\"\ngpio = \"x\"\n[[input]]\nname = \"b\"\ngpio = \"x\"",
              "'x' appears twice"}));

TEST(BoardFile, TooManyLines) {
  std::string text;
  for (int k = 0; k < 29; ++k) text += "[[output]]\nname = \"o" + std::to_string(k) + "\"\n";
  const auto file = parse(text);
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().line().find("29 outputs"), std::string::npos) << file.error().line();
}

TEST(BoardFile, AMissingOneIsNamed) {
  const auto file = read_board_file("/nonexistent/board.toml");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::not_found);
}

namespace fs = std::filesystem;

class KeptFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("symrig-kept-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const char* name, const std::string& text) const { std::ofstream(folder_ / name) << text; }

  fs::path folder_;
};

TEST_F(KeptFiles, SettingsComeBackWhole) {
  int calls = 0;
  SettingsFile settings(
      folder_ / "settings", [&] { ++calls; }, [&] { calls += 10; });
  std::array<std::uint8_t, hal::Settings::kRoom> room{};
  EXPECT_EQ(settings.load(room.data(), room.size()), 0U);
  const std::array<std::uint8_t, 3> bytes{1, 0, 255};
  EXPECT_TRUE(settings.save(bytes.data(), bytes.size()));
  EXPECT_EQ(calls, 11) << "the dead man is told before and after";
  ASSERT_EQ(settings.load(room.data(), room.size()), 3U);
  EXPECT_EQ(room[2], 255);
  EXPECT_EQ(settings.load(room.data(), 2), 0U) << "half a record is none";
}

TEST_F(KeptFiles, SettingsThatCannotBeWrittenAreNotKept) {
  SettingsFile settings(folder_ / "no-such-folder" / "settings");
  const std::array<std::uint8_t, 1> bytes{1};
  EXPECT_FALSE(settings.save(bytes.data(), bytes.size()));
}

TEST_F(KeptFiles, AFaultSurvives) {
  FaultFile faults(folder_ / "fault");
  EXPECT_EQ(faults.load().code, 0U);
  faults.save({});
  EXPECT_FALSE(fs::exists(folder_ / "fault")) << "no file for no fault";
  faults.save({9, 123'456'789'012, 4});
  EXPECT_EQ(faults.load().code, 9U);
  EXPECT_EQ(faults.load().tick, 123'456'789'012U);
  EXPECT_EQ(faults.load().arg, 4U);
  faults.save({});
  EXPECT_EQ(faults.load().code, 0U);
}

TEST_F(KeptFiles, RubbishIsNoFaultAndNoLevels) {
  write("fault", "nine lives");
  write("levels", "zz");
  EXPECT_EQ(FaultFile(folder_ / "fault").load().code, 0U);
  EXPECT_FALSE(SafeLevelsFile(folder_ / "levels").load());
}

TEST_F(KeptFiles, TellsHowTheLastDaemonEnded) {
  EXPECT_EQ(RunMark(folder_ / "run").begin(), hal::ResetCause::power);
  EXPECT_EQ(RunMark(folder_ / "run").begin(), hal::ResetCause::watchdog) << "it was cut off";
  RunMark mark(folder_ / "run");
  mark.begin();
  mark.end_well();
  EXPECT_EQ(RunMark(folder_ / "run").begin(), hal::ResetCause::power);
}

TEST_F(KeptFiles, SafeLevelsComeBack) {
  const SafeLevelsFile file(folder_ / "levels");
  EXPECT_FALSE(file.load());
  EXPECT_TRUE(file.save(0x80000001));
  EXPECT_EQ(file.load(), 0x80000001);
}

}  // namespace
}  // namespace symrig::board_linux::test::board_file_test
