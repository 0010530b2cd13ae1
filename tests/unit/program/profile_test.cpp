// SPDX-License-Identifier: Apache-2.0
#include "workshop.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

namespace symrig::profile_test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

/// A profile in a file of its own.
class Profile : public ::testing::Test {
 protected:
  Profile() : file_(fs::temp_directory_path() / ("symrig-profile-" + std::to_string(getpid()) + ".toml")) {}
  ~Profile() override {
    std::error_code ignored;
    fs::remove(file_, ignored);
  }
  Error refusal_of(const std::string& text) const {
    std::ofstream(file_) << text;
    const auto profile = load_camera_profile(file_.string(), "");
    EXPECT_FALSE(profile.ok());
    return profile.ok() ? Error{} : profile.error();
  }
  void expect_refusal(const std::string& text, const std::string& where, const std::string& what) const {
    const Error error = refusal_of(text);
    EXPECT_EQ(error.code, ErrorCode::bad_format);
    EXPECT_NE(error.what.find(file_.filename().string() + ":" + where), std::string::npos) << error.line();
    EXPECT_NE(error.line().find(what), std::string::npos) << error.line();
  }

  static constexpr const char* kHead = "symrig = 1\nkind = \"camera\"\nname = \"mine\"\n";

 private:
  fs::path file_;
};

TEST_F(Profile, every_one_in_the_tree_is_built_in_and_loads) {
  const auto names = builtin_profiles();
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(SYMRIG_PROFILE_FOLDER)) {
    const std::string name = entry.path().stem().string();
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
    const bool either = load_camera_profile(name, "").ok() != load_projector_profile(name, "").ok();
    EXPECT_TRUE(either) << name;
    ++files;
  }
  EXPECT_EQ(files, names.size());
  EXPECT_GE(files, 6U);
}

// The numbers that the device documents give (sources stand in the files).
TEST_F(Profile, numbers_of_the_known_devices) {
  const auto camera = load_camera_profile("raspberry-pi-global-shutter", "");
  ASSERT_OK(camera);
  EXPECT_EQ(camera->mode, ExposureMode::trigger_width);
  EXPECT_TRUE(camera->active_low);
  EXPECT_EQ(camera->exposure_offset, 14'260ns);
  EXPECT_FALSE(camera->notes.empty());
  const auto dlp = load_projector_profile("dlpc900", "");
  ASSERT_OK(dlp);
  EXPECT_EQ(dlp->sync, PatternSync::trigger);
  EXPECT_EQ(dlp->limit_for(1)->time, 105us);
  EXPECT_EQ(dlp->limit_for(8)->time, 4046us);
  EXPECT_EQ(dlp->limit_for(3)->bits, 8);  // nothing between: the next known depth
  EXPECT_FALSE(dlp->limit_for(9).has_value());
  EXPECT_EQ(dlp->trigger_delay, 105us);
  EXPECT_EQ(dlp->black_insertion, 105us);
  EXPECT_EQ(load_projector_profile("hdmi-60", "")->refresh, 16'666'667ns);
}

TEST_F(Profile, unknown_name_lists_the_known) {
  const auto profile = load_camera_profile("kodak", "");
  ASSERT_FALSE(profile.ok());
  EXPECT_EQ(profile.error().code, ErrorCode::not_found);
  EXPECT_NE(profile.error().hint.find("raspberry-pi-global-shutter"), std::string::npos);
}

TEST_F(Profile, faults_name_file_line_key_and_what_is_legal) {
  expect_refusal(std::string(kHead) + "shutter = 3\n", "4", "known:");
  expect_refusal(std::string(kHead) + "exposure = \"long\"\n", "4", R"("trigger-width", "timed")");
  expect_refusal(std::string(kHead) + "readout = 4\n", "4", "is a whole number, not a duration");
  expect_refusal(std::string(kHead) + "readout = \"4\"\n", "4", "\"1.5 ms\"");
  expect_refusal(std::string(kHead) + "readout = \"-4 ms\"\n", "4", "not a duration");
  expect_refusal(std::string(kHead) + "\nassumptions = [\"readout\"]\n", "5", "not a key of this file");
  expect_refusal("symrig = 1\nkind = \"projector\"\nname = \"x\"\n", "2", "a profile of a camera");
  expect_refusal("symrig = 2\nkind = \"camera\"\nname = \"x\"\n", "1", "out of range");
  expect_refusal("kind = \"camera\"\nname = \"x\"\n", "1", "symrig is missing");
  expect_refusal(std::string(kHead) + "exposure = [\n", "4", "TOML");
}

TEST_F(Profile, a_program_overrides_single_numbers_which_are_no_assumptions_then) {
  const auto file = parse_program_file(
      "symrig = 1\n[rig.camera]\nprofile = \"generic-strobed\"\nreadout = \"7 ms\"\n"
      "[program]\npatterns = 1\nbracket = [\"1 ms\"]\n",
      "scan.toml", "");
  ASSERT_OK(file);
  EXPECT_EQ(file->rig.camera.readout, 7ms);
  EXPECT_EQ(file->rig.camera.min_exposure, 20us);
  EXPECT_EQ(file->rig.camera.assumptions, std::vector<std::string>{"min_exposure"});
}

}  // namespace
}  // namespace symrig::profile_test
