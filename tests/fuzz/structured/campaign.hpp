// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/program/compile.hpp"
#include "symrig/run/run.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>
#include <sys/time.h>
#include <unistd.h>

// Files that are whole in form and wrong in content: a few hundred in every test run, 10,000 of a kind with
// SYMRIG_LONG=1. SYMRIG_CASE=n runs one case alone.

namespace symrig::structured {

/// Ends the process if a case takes more than five seconds of processor time: that is a hang, not slowness.
class HangWatch {
 public:
  explicit HangWatch(std::uint64_t number) {
    current() = number;
    (void)std::signal(SIGPROF, &HangWatch::hangs);
    arm(5);
  }
  HangWatch(const HangWatch&) = delete;
  HangWatch& operator=(const HangWatch&) = delete;
  ~HangWatch() { arm(0); }

 private:
  static std::uint64_t& current() {
    static std::uint64_t number = 0;
    return number;
  }
  static void arm(int seconds) {
    const itimerval timer{{0, 0}, {seconds, 0}};
    setitimer(ITIMER_PROF, &timer, nullptr);
  }
  static void hangs(int) {
    const std::string text = "case " + std::to_string(current()) + " hangs\n";
    [[maybe_unused]] const auto written = write(STDERR_FILENO, text.data(), text.size());
    std::abort();
  }
};

/// body(case number): once for each case; stops at the first that fails.
template <class Body>
void campaign(const Body& body) {
  const char* const only = std::getenv("SYMRIG_CASE");
  const std::uint64_t first = only != nullptr ? std::strtoull(only, nullptr, 10) : 0;
  const std::uint64_t cases = std::getenv("SYMRIG_LONG") != nullptr ? 10'000 : 300;
  const std::uint64_t end = only != nullptr ? first + 1 : cases;
  for (std::uint64_t number = first; number < end; ++number) {
    SCOPED_TRACE("SYMRIG_CASE=" + std::to_string(number));
    const HangWatch watch(number);
    body(number);
    if (testing::Test::HasFailure()) return;
  }
}

/// A scan of a few patterns, with waits, loops and a lamp.
constexpr const char* kProgram = R"(symrig = 1
[rig.lines.lamp_enable]
role = "lamp"
max_on = "2 s"
[program]
patterns = 3
bracket = ["1 ms", "4 ms"]
lamp = "lamp_enable"
)";

inline RunRecord run_once() {
  const auto file = parse_program_file(kProgram, "scan.toml", "");
  EXPECT_TRUE(file.ok()) << file.error().line();
  BoardOptions options;
  options.keep_alive = file->rig.keep_alive;
  auto board = Board::connect(make_sim_rig(wiring_of(file->rig)), options);
  EXPECT_TRUE(board.ok());
  const auto compilation = compile_program(*file, board->info());
  EXPECT_TRUE(compilation.ok());
  auto record = run_program(*board, *compilation.program);
  EXPECT_TRUE(record.ok()) << record.error().line();
  return *std::move(record);
}

}  // namespace symrig::structured
