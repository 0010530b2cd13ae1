// SPDX-License-Identifier: Apache-2.0
// How late this computer would be as a trigger board: symrigd's own measurement without GPIO lines, so that
// it needs neither a chip nor a configuration. docs/board-linux.md has its numbers.
//   benchmark_board_latency [ROUNDS [PRIORITY]]      priority: of SCHED_FIFO (root), 0 = ordinary; default
//   5000 0
#include "daemon.hpp"
#include "measure.hpp"
#include "process.hpp"

#include <cstdio>
#include <cstdlib>

namespace {

/// No lines: a word costs nothing, so the times are the kernel's alone.
class NoLines final : public symrig::board_linux::Gpio {
 public:
  bool put(std::uint32_t, std::uint32_t) noexcept override { return true; }
  bool inputs(std::uint32_t& levels) const noexcept override {
    levels = 0;
    return true;
  }
  std::span<const int> edge_fds() const override { return {}; }
  std::size_t read_edges(std::span<symrig::hal::CapturedEdge>, bool&) override { return 0; }
};

double load_average() {
  double load = 0;
  return ::getloadavg(&load, 1) == 1 ? load : -1;
}

}  // namespace

int main(int count, char** words) {
  using namespace symrig::board_linux;
  const long rounds = count > 1 ? std::strtol(words[1], nullptr, 10) : 5000;
  const long priority = count > 2 ? std::strtol(words[2], nullptr, 10) : 0;
  if (count > 3 || rounds < 1 || rounds > 10'000'000 || priority < 0 || priority > 99) {
    (void)std::fprintf(stderr,
                       "usage: benchmark_board_latency [ROUNDS [PRIORITY]]   1 to 10000000, 0 to 99\n");
    return 2;
  }
  if (const std::string obstacle = lock_memory(); !obstacle.empty()) std::printf("%s\n", obstacle.c_str());
  if (priority > 0) {
    if (const std::string obstacle = run_first(static_cast<int>(priority)); !obstacle.empty()) {
      (void)std::fprintf(stderr, "%s\n", obstacle.c_str());
      return 3;
    }
  }
  NoLines lines;
  const Measured measured = measure(lines, 0, static_cast<unsigned>(rounds), static_cast<int>(priority));
  std::printf("priority %ld, load %.1f\n%s", priority, load_average(),
              measured_text(measured, abilities(measured, 0, Daemon::kSegments)).c_str());
  return 0;
}
