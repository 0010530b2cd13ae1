// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>
#include <thread>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace symrig::test {
namespace {

namespace fs = std::filesystem;

fs::path new_folder() {
  std::string name = (fs::temp_directory_path() / "symrig-test-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) std::abort();
  return name;
}

/// In the child: output to files, then the command. Only calls that are allowed after fork.
[[noreturn]] void become_command(const fs::path& folder, const fs::path& captured, char* const* words) {
  const int out = open((captured / "out").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const int err = open((captured / "err").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const bool ready = out >= 0 && err >= 0 && dup2(out, STDOUT_FILENO) >= 0 && dup2(err, STDERR_FILENO) >= 0 &&
                     chdir(folder.c_str()) == 0;
  if (ready) execv(words[0], words);
  _exit(126);
}

/// Processor time that the process has used; none: it has ended.
std::optional<double> processor_seconds(pid_t process) {
  const std::string stat = read_text("/proc/" + std::to_string(process) + "/stat");
  std::istringstream fields(
      stat.substr(std::min(stat.size(), stat.rfind(')') + 2)));  // its name may hold anything
  std::string state, skipped;
  double user = 0, system = 0;
  fields >> state;
  for (int field = 4; field < 14; ++field) fields >> skipped;
  if (!(fields >> user >> system) || state == "Z") return std::nullopt;
  return (user + system) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

/// The process has a handler for the signal.
bool takes_signal(pid_t process, int number) {
  std::istringstream status(read_text("/proc/" + std::to_string(process) + "/status"));
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("SigCgt:"))
      return (std::stoull(line.substr(7), nullptr, 16) >> (number - 1) & 1U) != 0;
  return false;
}

}  // namespace

Running::Running(const fs::path& folder, const std::vector<std::string>& arguments)
    : captured_(new_folder()) {
  std::vector<std::string> all{SYMRIG_COMMAND};
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> words;
  words.reserve(all.size() + 1);
  for (std::string& word : all) words.push_back(word.data());
  words.push_back(nullptr);
  child_ = fork();
  if (child_ == 0) become_command(folder, captured_, words.data());
}

Running::~Running() {
  if (child_ > 0) {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  std::error_code ignored;
  fs::remove_all(captured_, ignored);
}

void Running::signal(int number) const {
  if (child_ > 0) kill(child_, number);
}

bool Running::works(int number, double seconds) const {
  double since = -1;
  for (;;) {
    const auto spent = processor_seconds(child_);
    if (!spent) return false;
    if (since < 0 && takes_signal(child_, number)) since = *spent;
    if (since >= 0 && *spent >= since + seconds) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

Outcome Running::wait() {
  int status = 0;
  waitpid(child_, &status, 0);
  child_ = -1;
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return {code, read_text(captured_ / "out"), read_text(captured_ / "err")};
}

std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

CommandTest::CommandTest() : folder_(new_folder()) {}

CommandTest::~CommandTest() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

Outcome CommandTest::symrig(const std::vector<std::string>& arguments) const {
  return Running(folder_, arguments).wait();
}

std::set<std::string> CommandTest::files() const {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder_))
    names.insert(fs::relative(entry.path(), folder_).string());
  return names;
}

nlohmann::json CommandTest::json(const std::string& name) const {
  return nlohmann::json::parse(read_text(path(name)));
}

void CommandTest::capture_small(const std::string& rig) {
  const Outcome outcome = symrig({"capture", "--rig", rig, "-o", "scene.h5"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
}

void CommandTest::expect_refusal(const std::vector<std::string>& arguments, int code,
                                 const std::vector<std::string>& words) const {
  const std::set<std::string> before = files();
  const Outcome outcome = symrig(arguments);
  EXPECT_EQ(outcome.code, code) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_TRUE(outcome.err.starts_with("symrig")) << outcome.err;
  EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << "not exactly one line: " << outcome.err;
  for (const std::string& word : words)
    EXPECT_NE(outcome.err.find(word), std::string::npos) << word << " in: " << outcome.err;
  EXPECT_EQ(files(), before);
}

}  // namespace symrig::test
