// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/selftest/guest.hpp"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <sstream>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace symrig::bench_vm {

namespace {
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::string_view kEvent = ": gpio_value: ";
}  // namespace

std::string place(const char* variable) {
  const char* text = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe)
  EXPECT_NE(text, nullptr) << "no $" << variable << ": run this by tests/bench-vm/run with that device";
  return text == nullptr ? "" : text;
}

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

void sleep_until(std::int64_t ns) {
  const timespec until{.tv_sec = ns / kSecond, .tv_nsec = ns % kSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

std::string read_text(const std::filesystem::path& path) {
  const std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

bool write_text(const std::filesystem::path& path, std::string_view text) {
  const int file = open(path.c_str(), O_WRONLY | O_CLOEXEC);  // NOLINT(*-vararg)
  if (file < 0) return false;
  const bool taken = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  return close(file) == 0 && taken;
}

void clear_trace() {
  std::ofstream(place("BENCH_TRACEFS") + "/trace", std::ios::trunc).flush();
}

// A line of the trace: "name-123  [000] .....  12.345678: gpio_value: 1009 set 1". "get" is the reading of an
// input.
std::vector<TracedLevel> traced_levels() {
  const int base = std::stoi(place("BENCH_GPIO_BASE"));
  std::istringstream trace(read_text(place("BENCH_TRACEFS") + "/trace"));
  std::vector<TracedLevel> found;
  for (std::string line; std::getline(trace, line);) {
    const std::size_t event = line.find(kEvent);
    if (event == std::string::npos) continue;
    const double seconds = std::stod(line.substr(line.rfind(' ', event - 1) + 1, event));
    std::istringstream what(line.substr(event + kEvent.size()));
    int gpio = 0, level = 0;
    std::string verb;
    if (what >> gpio >> verb >> level && verb == "set")
      found.push_back({gpio - base, level != 0, std::llround(seconds * 1e6) * 1000});
  }
  return found;
}

}  // namespace symrig::bench_vm
