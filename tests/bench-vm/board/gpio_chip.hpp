// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/selftest/guest.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace symrig::bench {

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
