// SPDX-License-Identifier: Apache-2.0
// Files that are whole in form and wrong in content: a few hundred in every test run, 10,000 of a kind with
// SYMRIG_LONG=1. SYMRIG_CASE=n runs one case alone.
#pragma once

#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>
#include <sys/time.h>
#include <unistd.h>

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

}  // namespace symrig::structured
