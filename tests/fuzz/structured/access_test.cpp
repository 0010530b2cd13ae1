// SPDX-License-Identifier: Apache-2.0
// Why a file cannot be read: not allowed, a folder, a pipe, empty, cut short, of another format. Each is
// said.
#include "scratch.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/files.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/hdr/sensor.hpp"
#include "symrig/image/file.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/rig/rig_file.hpp"
#include "symrig/tensor/file.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace symrig::structured::access_test {
namespace {

namespace fs = std::filesystem;

/// While it lives, permissions count: root has all of them.
class Nobody {
 public:
  Nobody() : was_root_(geteuid() == 0) {
    if (was_root_) {
      EXPECT_EQ(seteuid(65'534), 0);
    }
  }
  Nobody(const Nobody&) = delete;
  Nobody& operator=(const Nobody&) = delete;
  ~Nobody() {
    if (was_root_) {
      EXPECT_EQ(seteuid(0), 0);
    }
  }

 private:
  bool was_root_;
};

template <class T>
std::string error_of(const Result<T>& result) {
  return result.ok() ? "" : result.error().line();
}

using Reader = std::pair<const char*, std::function<std::string(const fs::path&)>>;

/// Everything that reads a file that a user names.
std::vector<Reader> readers() {
  return {{"scene", [](const fs::path& file) { return error_of(load_scene(file)); }},
          {"log",
           [](const fs::path& file) {
             return error_of(open_photograph_log(file, {{4, 4}, 1, "", ""}));
           }},
          {"receipt or compiled program", [](const fs::path& file) { return error_of(read_file(file)); }},
          {"program", [](const fs::path& file) { return error_of(read_program_file(file)); }},
          {"picture", [](const fs::path& file) { return error_of(read_image(file)); }},
          {"sensor", [](const fs::path& file) { return error_of(load_sensor(file)); }},
          {"response", [](const fs::path& file) { return error_of(load_response(file)); }},
          {"map",
           [](const fs::path& file) {
             return error_of(read_pixel_map(file, {4, 4}));
           }},
          {"rig", [](const fs::path& file) { return error_of(read_rig_file(file)); }}};
}

class Access : public testing::Test {
 protected:
  void SetUp() override { fs::permissions(folder_.folder(), fs::perms(0755)); }
  fs::path file(const char* name, const std::string& text = "x") const {
    EXPECT_TRUE(write_file_atomically(folder_ / name, text).ok());
    return folder_ / name;
  }
  static void expect_all(const fs::path& file, const std::string& word) {
    for (const auto& [name, read] : readers()) {
      const std::string line = read(file);
      EXPECT_NE(line.find(word), std::string::npos) << name << ": " << line;
      EXPECT_EQ(line.find("damaged"), std::string::npos) << name << ": " << line;
    }
  }
  test::Scratch folder_;
};

TEST_F(Access, a_file_that_may_not_be_read_is_not_called_damaged) {
  const fs::path secret = file("secret.h5");
  fs::permissions(secret, fs::perms::none);
  const Nobody nobody;
  expect_all(secret, "Permission denied");
}

TEST_F(Access, a_file_in_a_folder_that_may_not_be_entered_is_not_missing) {
  fs::create_directory(folder_ / "closed");
  const fs::path inside = file("closed/scene.h5");
  fs::permissions(folder_ / "closed", fs::perms::none);
  {
    const Nobody nobody;
    expect_all(inside, "Permission denied");
  }
  fs::permissions(folder_ / "closed", fs::perms::owner_all);
}

TEST_F(Access, a_folder_is_called_a_folder) {
  fs::create_directory(folder_ / "folder.h5");
  expect_all(folder_ / "folder.h5", "is a folder");
}

// Nobody writes to it: opening it the usual way would wait for ever.
TEST_F(Access, a_pipe_is_refused_at_once) {
  ASSERT_EQ(mkfifo((folder_ / "pipe.h5").c_str(), 0644), 0);
  expect_all(folder_ / "pipe.h5", "not a regular file");
}

TEST_F(Access, what_is_not_there_is_missing) {
  expect_all(folder_ / "none.h5", "no such file");
}

TEST_F(Access, a_scene_that_is_empty_cut_or_something_else_is_told_apart) {
  EXPECT_NE(error_of(load_scene(file("empty.h5", ""))).find("is empty"), std::string::npos);
  EXPECT_NE(error_of(load_scene(file("text.h5", "no picture"))).find("is not an HDF5 file"),
            std::string::npos);
  StoredScene scene;
  TensorBuilder builder(BlockTree(Grid{2, 2}), 1);
  scene.tensor = std::move(builder).finish();
  ASSERT_TRUE(save_scene(folder_ / "whole.h5", scene).ok());
  fs::resize_file(folder_ / "whole.h5", fs::file_size(folder_ / "whole.h5") - 100);
  EXPECT_NE(error_of(load_scene(folder_ / "whole.h5")).find("cut short"), std::string::npos);
}

/// Writes a small scene.
void write_scene(const fs::path& path) {
  StoredScene scene;
  TensorBuilder builder(BlockTree(Grid{2, 2}), 1);
  scene.tensor = std::move(builder).finish();
  ASSERT_TRUE(save_scene(path, scene).ok());
}

// HDF5 locks a file for as long as a program has it open. The lock of a second descriptor counts too.
TEST_F(Access, a_scene_that_another_program_has_open_is_in_use_and_not_damaged) {
  const fs::path path = folder_ / "open.h5";
  write_scene(path);
  {
    const Fd elsewhere(::open(path.c_str(), O_RDWR | O_CLOEXEC));
    ASSERT_EQ(::flock(elsewhere.get(), LOCK_EX), 0);
    const auto read = load_scene(path);
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(read.error().code, ErrorCode::io);
    EXPECT_NE(read.error().line().find("is in use: another program"), std::string::npos)
        << read.error().line();
  }
  EXPECT_EQ(error_of(load_scene(path)), "");
}

// What remains of a program that was killed: the mark in the file, without a lock.
TEST_F(Access, a_scene_that_was_not_closed_is_marked_and_not_damaged) {
  const fs::path path = folder_ / "open.h5", left = folder_ / "left.h5";
  write_scene(path);
  const hid_t open = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  ASSERT_GE(open, 0);
  fs::copy_file(path, left);
  H5Fclose(open);
  EXPECT_EQ(error_of(load_scene(path)), "");
  EXPECT_NE(error_of(load_scene(left)).find("is marked as open for writing"), std::string::npos)
      << error_of(load_scene(left));
}

// 60 bytes that would have become four gigabytes.
TEST_F(Access, a_picture_that_claims_more_than_it_holds_is_refused) {
  const std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x27\x10\0\0\x27\x10\x10\x02\0\0\0", 29);
  const auto crc = [](const std::string& text) {
    std::uint32_t sum = ~0U;
    for (const char c : text) {
      sum ^= static_cast<std::uint8_t>(c);
      for (int k = 0; k < 8; ++k) sum = (sum >> 1U) ^ ((sum & 1U) != 0 ? 0xEDB88320U : 0U);
    }
    sum = ~sum;
    return std::string{static_cast<char>(sum >> 24U), static_cast<char>(sum >> 16U),
                       static_cast<char>(sum >> 8U), static_cast<char>(sum)};
  };
  const std::string data = "IDAT";
  const std::string text = png + crc(png.substr(12)) + std::string(4, '\0') + data + crc(data);
  const std::string png_error = error_of(read_image(file("large.png", text)));
  EXPECT_NE(png_error.find("more pixels than"), std::string::npos) << png_error;
  const std::string pfm_error = error_of(read_image(file("large.pfm", "PF\n10000 10000\n-1\n")));
  EXPECT_NE(pfm_error.find("ends before"), std::string::npos) << pfm_error;
}

}  // namespace
}  // namespace symrig::structured::access_test
