// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board.hpp"
#include "symrig/board/device_uri.hpp"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace symrig::bench {

/// symrigd on the guest's simulated GPIO chip. Its folders are in memory.
class DaemonProcess {
 public:
  /// links: the keys under [link] of its board.toml. lines: its tables of lines.
  explicit DaemonProcess(const std::string& links = "", const std::string& lines = "")
      : folder_("/run/symrig-test") {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    const std::string link = links.empty() ? "unix = \"" + socket() + "\"\n" : links;
    std::ofstream(folder_ + "/board.toml")
        << "[link]\n"
        << link << "[folder]\nstate = \"" << folder_ << "\"\nrun = \"" << folder_ << "\"\n"
        << lines;
    once("--version");  // loads the program into memory, which can take 15 minutes in virtual time
    start();
  }
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;
  ~DaemonProcess() {
    if (pid_ > 0) end(SIGTERM);
  }

  std::string socket() const { return folder_ + "/board.sock"; }
  pid_t pid() const { return pid_; }

  void start() {
    pid_ = spawn({});
    for (int k = 0; k < 30'000 && !ended() && log().find("serves") == std::string::npos; ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  /// Sends the signal and returns the wait status.
  int end(int signal) {
    ::kill(pid_, signal);
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = 0;
    return status;
  }
  /// Runs it with one more option and returns its exit status.
  int once(const std::string& option) {
    int status = 0;
    ::waitpid(spawn({option}), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string log() const {
    std::ostringstream text;
    text << std::ifstream(folder_ + "/log").rdbuf();
    return text.str();
  }

  Result<Board> connect() const {
    SYMRIG_TRY(const auto uri, DeviceUri::parse("unix:" + socket()));
    SYMRIG_TRY(auto link, open_link(uri));
    return Board::connect(std::move(link));
  }

 private:
  /// true: it has ended by itself. end() still returns its status.
  bool ended() const {
    siginfo_t info{};
    ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT);
    return info.si_pid != 0;
  }
  pid_t spawn(const std::vector<std::string>& options) const {
    std::ofstream(folder_ + "/log") << "";  // before it runs, so that no reader sees the previous log
    const pid_t pid = ::fork();
    if (pid != 0) return pid;
    const int log = ::open((folder_ + "/log").c_str(), O_WRONLY | O_APPEND);
    ::dup2(log, STDERR_FILENO);
    const std::string config = folder_ + "/board.toml";
    const char* other = std::getenv("SYMRIG_OTHER_SYMRIGD");  // one that another system built
    const char* program = other != nullptr ? other : SYMRIG_SYMRIGD;
    std::vector<const char*> arguments{program, "--config", config.c_str()};
    for (const std::string& option : options) arguments.push_back(option.c_str());
    arguments.push_back(nullptr);
    ::execv(program, const_cast<char**>(arguments.data()));
    ::_exit(127);
  }

  std::string folder_;
  pid_t pid_ = 0;
};

}  // namespace symrig::bench
