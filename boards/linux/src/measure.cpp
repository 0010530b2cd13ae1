// SPDX-License-Identifier: Apache-2.0
#include "measure.hpp"

#include "clock.hpp"
#include "process.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <poll.h>
#include <sys/utsname.h>

namespace symrig::board_linux {
namespace {

constexpr hal::Tick kNap = 500 * kMicrosecond;
constexpr hal::Tick kLongestSpin = 100 * kMicrosecond;
constexpr unsigned kWarmUp = 16;  // the first rounds fill caches and page tables and do not count
constexpr unsigned kPushes = 1024;
constexpr std::uint64_t kCap = 200 * kMillisecond;
constexpr std::uint64_t kFar = 1'000 * kMillisecond;

Spread spread_of(std::vector<std::uint64_t> times) {
  if (times.empty()) return {};
  std::sort(times.begin(), times.end());
  return {times.front(), times[times.size() / 2], times.back()};
}

void wait_for(int fd) {
  pollfd one{fd, POLLIN, 0};
  while (::poll(&one, 1, -1) < 1) {
  }
}

/// Sleeps, then watches the clock until `tick`. Returns the last clock reading.
hal::Tick sleep_to(const Alarm& alarm, hal::Tick tick, hal::Tick spin) {
  pollfd own{};
  alarm.wait(tick - spin, {&own, 1});
  hal::Tick now = monotonic_now();
  while (now < tick) now = monotonic_now();
  return now;
}

Spread time_wakes(unsigned count) {
  const Alarm alarm;
  for (unsigned k = 0; k < kWarmUp; ++k) sleep_to(alarm, monotonic_now() + kNap, 0);
  std::vector<std::uint64_t> late(count);
  for (auto& one : late) {
    const hal::Tick tick = monotonic_now() + kNap;
    one = sleep_to(alarm, tick, 0) - tick;
  }
  return spread_of(late);
}

hal::Tick spin_for(const Spread& wake) {
  return std::clamp<hal::Tick>(2 * wake.most, 5 * kMicrosecond, kLongestSpin);
}

void time_words(Gpio& gpio, std::uint32_t levels, unsigned count, Measured& out) {
  const Alarm alarm;
  std::vector<std::uint64_t> late(count);
  std::vector<std::uint64_t> set(count);
  for (unsigned k = 0; k < kWarmUp; ++k) gpio.put(levels);
  for (std::size_t k = 0; k < count; ++k) {
    const hal::Tick tick = monotonic_now() + kNap;
    const hal::Tick begin = sleep_to(alarm, tick, spin_for(out.wake));
    gpio.put(levels);
    const hal::Tick end = monotonic_now();
    late[k] = end - tick;
    set[k] = end - begin;
  }
  out.word = spread_of(late);
  out.set = spread_of(set);
}

Spread time_nudges(unsigned count, int priority) {
  const Bell bell;
  const Bell answer;
  std::atomic<hal::Tick> heard = 0;
  std::thread listener([&] {
    if (priority > 0) run_first(priority);
    for (unsigned k = 0; k < count; ++k) {
      wait_for(bell.fd());
      heard = monotonic_now();
      bell.quiet();
      answer.ring();
    }
  });
  std::vector<std::uint64_t> times(count);
  for (auto& one : times) {
    std::this_thread::sleep_for(std::chrono::microseconds(100));  // the thread must be asleep, as in a run
    const hal::Tick rung = monotonic_now();
    bell.ring();
    wait_for(answer.fd());
    answer.quiet();
    one = heard - rung;
  }
  listener.join();
  return spread_of(times);
}

class NoWords final : public board_common::WordSink {
 public:
  hal::Tick put(std::uint32_t) override { return 0; }
  hal::Tick put_all(std::uint32_t) override { return 0; }
};

Spread time_pushes() {
  NoWords sink;
  board_common::Playback playback(sink, {}, kPushes);
  PriorityMutex mutex;
  std::vector<std::uint64_t> times;
  for (unsigned k = 0; k < kPushes; ++k) {
    const hal::Tick begin = monotonic_now();
    const PriorityLock lock(mutex);
    playback.push({});
    times.push_back(monotonic_now() - begin);
  }
  return spread_of(times);
}

Spread worse(const Spread& a, const Spread& b) {
  return {std::max(a.least, b.least), std::max(a.median, b.median), std::max(a.most, b.most)};
}

}  // namespace

Measured measure(Gpio& gpio, std::uint32_t levels, unsigned wakes, int priority) {
  Measured out;
  std::thread worker([&] {
    if (priority > 0) run_first(priority);
    out.wakes = wakes;
    out.wake = time_wakes(wakes);
    time_words(gpio, levels, wakes, out);
    out.nudge = time_nudges(wakes, priority);
    out.push = time_pushes();
  });
  worker.join();
  return out;
}

Measured worse(const Measured& a, const Measured& b) {
  return {a.wakes + b.wakes,   worse(a.wake, b.wake),   worse(a.word, b.word),
          worse(a.set, b.set), worse(a.nudge, b.nudge), worse(a.push, b.push)};
}

Abilities abilities(const Measured& measured, std::uint32_t lateness, std::size_t queue) {
  const auto bounded = [](std::uint64_t ticks, std::uint64_t most) {
    return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(ticks, 1, most));
  };
  const std::uint64_t worst_word = 2 * std::max(measured.word.most, measured.set.most) + kMicrosecond;
  const std::uint64_t worst_input = 2 * std::max(measured.nudge.most, measured.wake.most);
  Abilities out;
  out.spin = spin_for(measured.wake);
  out.promise.lateness = bounded(lateness != 0 ? lateness : worst_word, kCap);
  // A word must be longer than the lateness of the next word plus the calls for setting both.
  out.promise.min_dwell =
      bounded(2 * std::uint64_t{out.promise.lateness} + 4 * measured.set.median + out.spin, kFar);
  out.promise.input = bounded(
      (lateness != 0 ? std::min<std::uint64_t>(lateness, worst_input) : worst_input) + out.spin, kCap);
  out.promise.wait_latency = bounded(std::uint64_t{out.promise.input} + out.promise.lateness, kFar);
  out.output_stamp = bounded(measured.set.most, kCap);
  out.input_stamp = bounded(measured.wake.most, kCap);  // line interrupts can be as late as timers
  out.poll_ticks = bounded(2 * measured.wake.most + 2 * kMillisecond, kFar);
  // At least so much that a full queue of shortest words lasts longer than a poll (rule refill).
  out.refill_ticks = bounded(
      std::max(4 * measured.push.median + kMicrosecond, 4 * std::uint64_t{out.poll_ticks} / queue), kFar);
  return out;
}

}  // namespace symrig::board_linux

// Measured times as text, for people and for the next start.

namespace symrig::board_linux {
namespace {

struct Row {
  const char* name;
  Spread Measured::*spread;
  const char* what;
};
constexpr std::array<Row, 5> kRows{{{"wake", &Measured::wake, "a sleep ends late by"},
                                    {"word", &Measured::word, "a word is late by"},
                                    {"set", &Measured::set, "setting all outputs takes"},
                                    {"nudge", &Measured::nudge, "from an event to its thread"},
                                    {"push", &Measured::push, "queueing one word takes"}}};

std::string kernel() {
  utsname about{};
  return ::uname(&about) == 0 ? about.release : "unknown";
}

double us(std::uint64_t ticks) {
  return static_cast<double>(ticks) / 1000;
}

}  // namespace

std::string measured_text(const Measured& measured, const Abilities& abilities) {
  std::string text = fmt::format("{} sleeps of 0.5 ms, kernel {} (us)      least    median      most\n",
                                 measured.wakes, kernel());
  for (const Row& row : kRows) {
    const Spread& spread = measured.*row.spread;
    text += fmt::format("  {:<42} {:>10.1f}{:>10.1f}{:>10.1f}\n", row.what, us(spread.least),
                        us(spread.median), us(spread.most));
  }
  const board_common::Promise& promise = abilities.promise;
  return text + fmt::format(
                    "so the board promises (us)\n"
                    "  words of at least {:.1f}, each at most {:.1f} late\n"
                    "  the next word {:.1f} after an awaited edge\n"
                    "  stamps of outputs to {:.1f}, of inputs to {:.1f}\n"
                    "  {:.1f} to refill a word, after at most {:.1f}\n",
                    us(promise.min_dwell), us(promise.lateness), us(promise.wait_latency),
                    us(abilities.output_stamp), us(abilities.input_stamp), us(abilities.refill_ticks),
                    us(abilities.poll_ticks));
}

Result<void> save_measured(const std::filesystem::path& path, const Measured& measured) {
  std::string text = fmt::format("{}\n{}\n", kernel(), measured.wakes);
  for (const Row& row : kRows) {
    const Spread& spread = measured.*row.spread;
    text += fmt::format("{} {} {} {}\n", row.name, spread.least, spread.median, spread.most);
  }
  return write_file_atomically(path, text);
}

Measured load_measured(const std::filesystem::path& path) {
  const auto bytes = read_file(path, 4096);
  if (!bytes) return {};
  std::string text;
  for (const std::byte one : *bytes) text.push_back(static_cast<char>(one));
  std::istringstream in(text);
  std::string word;
  Measured out;
  if (!std::getline(in, word) || word != kernel() || !(in >> out.wakes)) return {};
  for (const Row& row : kRows) {
    Spread& spread = out.*row.spread;
    if (!(in >> word >> spread.least >> spread.median >> spread.most) || word != row.name) return {};
  }
  return out;
}

}  // namespace symrig::board_linux
