// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/selftest/guest.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/link.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
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

/// A change of an output's level in the kernel's trace.
struct TracedEdge {
  std::uint64_t tick = 0;  ///< CLOCK_MONOTONIC in ns; the trace has whole microseconds
  std::string line;
  bool level = false;
};

/// The guest's gpio-sim chip from outside: sets inputs, reads outputs.
class GpioChip {
 public:
  GpioChip() {
    std::istringstream names(bench_vm::place("BENCH_GPIO_LINES"));
    for (std::string name; names >> name;) lines_.push_back(name);
  }

  void pull(const std::string& line, bool level) const {
    std::ofstream(path(line) + "/pull") << (level ? "pull-up" : "pull-down") << std::flush;
  }
  bool value(const std::string& line) const {
    int value = -1;
    std::ifstream(path(line) + "/value") >> value;
    return value == 1;
  }

  static void clear_trace() { std::ofstream(trace_path()) << ""; }
  /// The last level of the line since clear_trace(). Unlike value(), it is valid after the line was released:
  /// gpio-sim then forgets the level, as some real drivers do.
  bool last_set(const std::string& line) const {
    bool level = false;
    for (const TracedEdge& edge : sets())
      if (edge.line == line) level = edge.level;
    return level;
  }
  /// Changes since clear_trace(), in order. Lines are low at first. Setting a line to its present level is no
  /// change.
  std::vector<TracedEdge> trace() const {
    std::vector<TracedEdge> edges;
    std::map<std::string, bool> levels;
    for (const TracedEdge& set : sets()) {
      if (levels[set.line] == set.level) continue;
      levels[set.line] = set.level;
      edges.push_back(set);
    }
    return edges;
  }

 private:
  std::vector<TracedEdge> sets() const {
    const int base = std::stoi(bench_vm::place("BENCH_GPIO_BASE"));
    std::ifstream file(trace_path());
    std::vector<TracedEdge> edges;
    for (std::string text; std::getline(file, text);) {
      const std::size_t at = text.find(": gpio_value: ");
      if (at == std::string::npos || text.find(" set ") == std::string::npos) continue;
      const std::size_t begin = text.rfind(' ', at) + 1;
      std::istringstream rest(text.substr(at + 14));
      int number = 0;
      std::string set;
      int level = 0;
      rest >> number >> set >> level;
      edges.push_back({to_tick(text.substr(begin, at - begin)),
                       lines_.at(static_cast<std::size_t>(number - base)), level != 0});
    }
    return edges;
  }

  static std::string trace_path() { return bench_vm::place("BENCH_TRACEFS") + "/trace"; }
  static std::uint64_t to_tick(const std::string& seconds) {
    const std::size_t dot = seconds.find('.');
    return std::stoull(seconds.substr(0, dot)) * 1'000'000'000 + std::stoull(seconds.substr(dot + 1)) * 1000;
  }
  std::string path(const std::string& line) const {
    const auto number = std::find(lines_.begin(), lines_.end(), line) - lines_.begin();
    return bench_vm::place("BENCH_GPIO_SYSFS") + "/sim_gpio" + std::to_string(number);
  }

  std::vector<std::string> lines_;
};

}  // namespace symrig::bench
