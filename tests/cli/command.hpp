// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/types.h>

/// Runs the real `symrig` binary.
namespace symrig::test {

struct Outcome {
  int code = -1;  ///< exit code; 128 + n when killed by signal n
  std::string out, err;
};

/// A command that runs in the background.
class Running {
 public:
  Running(const std::filesystem::path& folder, const std::vector<std::string>& arguments);
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running();

  void signal(int number) const;
  /// Waits until the command takes this signal itself, and has worked for so long since: in seconds of
  /// processor time, which passes as slowly as the command does on a busy machine. false: it has ended.
  bool works(int number, double seconds) const;
  Outcome wait();

 private:
  std::filesystem::path captured_;
  pid_t child_ = -1;
};

std::string read_text(const std::filesystem::path& path);
void write_text(const std::filesystem::path& path, const std::string& text);

/// An empty folder for each test, which is where commands run; removed afterwards.
class CommandTest : public ::testing::Test {
 protected:
  CommandTest();
  ~CommandTest() override;

  Outcome symrig(const std::vector<std::string>& arguments) const;
  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  /// Names of all files in the folder: nothing half-written, no temporary file left over.
  std::set<std::string> files() const;
  nlohmann::json json(const std::string& name) const;
  /// Captures a small noise-free scene into scene.h5.
  void capture_small(const std::string& rig = kSmall);

  /// The command refuses: this exit code, nothing on stdout, one line on stderr that names the command and
  /// holds each of these words, and the folder as it was.
  void expect_refusal(const std::vector<std::string>& arguments, int code,
                      const std::vector<std::string>& words) const;

  static constexpr const char* kSmall = "sim:vgroove-textured?size=12x17&noise=off";
  static constexpr int kUsage = 2;
  static constexpr int kBadInput = 4;
  static constexpr int kFault = 5;

 private:
  std::filesystem::path folder_;
};

}  // namespace symrig::test
