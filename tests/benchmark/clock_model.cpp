// SPDX-License-Identifier: Apache-2.0
// What the clock model's bound is worth: the table of docs/clock.md. Seeded, in simulated time: the numbers
// are the same on every run; only the cost of a call is measured on this machine.
#include "symrig/board/clock_model.hpp"

#include "clock_world.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace symrig::test {
namespace {

constexpr int kRuns = 200;
constexpr double kTicksPerMicrosecond = 125;

struct Row {
  std::string name;
  Delays delays;
};

std::vector<Row> rows() {
  const Delay board = uniform(2e-6, 5e-6);
  const Delay late = uniform(0, 50e-3);
  const auto jitter = [&](const Delay& way) { return either(way, 0.05, late); };
  return {
      {"exponential, mean 1 ms each way", {exponential(1e-3), board, jitter(exponential(1e-3))}},
      {"uniform, 0 to 1 ms each way", {uniform(0, 1e-3), board, jitter(uniform(0, 1e-3))}},
      {"exponential there, 50 us back", {exponential(1e-3), board, jitter(uniform(50e-6, 60e-6))}},
      {"50 us there, exponential back", {jitter(uniform(50e-6, 60e-6)), board, exponential(1e-3)}},
      {"mean 0.1 ms there, 2 ms back", {exponential(0.1e-3), board, jitter(exponential(2e-3))}},
      {"polled each ms: 0 to 1 ms there, 0.1 back", {uniform(0, 1e-3), board, jitter(uniform(0, 0.1e-3))}}};
}  // NOLINT(clang-analyzer-cplusplus.NewDeleteLeaks): std::function owns what it copies

struct Outcome {
  std::vector<double> errors, bounds;  // microseconds
  std::size_t outside = 0;
};

/// One session: a burst of 8 readings, then one every `interval`; looked at every 50 ms from 10 s to 30 s.
void session(const Row& row, double interval, std::uint64_t seed, Outcome& outcome) {
  Random random(seed);
  const TrueClock clock{.drift = random.sign() * 40e-6, .wander_period = 600};
  ClockModel model({125'000'000});
  double next = 0;
  double look = 10;
  for (int k = 0; look < 30; ++k) {
    while (look <= next && look < 30) {
      const HostTime time = host_time(look);
      const auto estimate = model.board_at(time);
      if (!estimate) std::exit(1);
      const double error = error_of(*estimate, clock, time);
      outcome.outside += error > static_cast<double>(estimate->bound.count) ? 1 : 0;
      outcome.errors.push_back(error / kTicksPerMicrosecond);
      outcome.bounds.push_back(static_cast<double>(estimate->bound.count) / kTicksPerMicrosecond);
      look += 0.05;
    }
    const TimeReading reading = ask(clock, row.delays, next, random);
    if (!model.add(reading)) std::exit(1);
    next = std::max(in_seconds(reading.received), k < 7 ? 0 : next + interval);
  }
}

void print_row(const Row& row, double interval) {
  Outcome outcome;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) session(row, interval, seed, outcome);
  fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.0f} | {:.0f} | {:.0f} | {} of {} |\n", row.name, interval,
             quantile(outcome.errors, 0.5), quantile(outcome.errors, 0.999), quantile(outcome.bounds, 0.5),
             quantile(outcome.bounds, 0.999), quantile(outcome.bounds, 1), outcome.outside,
             outcome.errors.size());
}

/// Median cost of a call, in microseconds, with full windows.
template <class Call>
double cost(Call call) {
  std::vector<double> times;
  for (int k = 0; k < 301; ++k) {
    const Stopwatch watch;
    call();
    times.push_back(1e6 * watch.seconds());
  }
  return quantile(times, 0.5);
}

void print_costs() {
  Random random(1);
  const TrueClock clock;
  const Row row = rows().front();
  ClockModel model({125'000'000});
  double now = 0;
  const auto add = [&] {
    const TimeReading reading = ask(clock, row.delays, now, random);
    now = in_seconds(reading.received) + 0.5;
    if (!model.add(reading)) std::exit(1);
  };
  for (int k = 0; k < 100; ++k) add();
  double sum = 0;
  const double asking =
      cost([&] { sum += static_cast<double>(model.board_at(host_time(now))->bound.count); });
  fmt::print("\nadd: {:.1f} us, board_at: {:.1f} us, memory: {} bytes\n", cost(add), asking,
             sizeof(ClockModel));
  if (sum == 0) std::exit(1);
}

}  // namespace
}  // namespace symrig::test

int main() {  // NOLINT(bugprone-exception-escape): a benchmark may end so
  using namespace symrig::test;
  fmt::print(
      "| delays (5 % of the answers up to 50 ms late) | every, s | error 50 % | 99.9 % | bound 50 % | 99.9 % "
      "| worst | outside |\n"
      "|---|---|---|---|---|---|---|---|\n");
  for (const double interval : {0.1, 0.25, 1.0})
    for (const auto& row : rows()) print_row(row, interval);
  print_costs();
}
