// SPDX-License-Identifier: Apache-2.0
#include "kept_files.hpp"

#include <array>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

namespace symrig::board_linux::test::kept_files_test {
namespace {

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
}  // namespace symrig::board_linux::test::kept_files_test
