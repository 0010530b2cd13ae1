// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "conformance/raw_session.hpp"
#include "symrig/protocol/program.hpp"

#include <cstdint>
#include <initializer_list>
#include <vector>

namespace symrig::conformance {

/// The bytes of a program.
Bytes pack(std::initializer_list<protocol::Record> records);
protocol::Record word(std::uint32_t levels, std::uint32_t ticks);
protocol::Record mark(std::uint32_t id);
protocol::Record loop(std::uint64_t rounds);
protocol::Record end_loop();
protocol::Record wait(std::uint32_t line, protocol::WaitFor edge, bool abort, std::uint32_t timeout);
protocol::Record end(std::uint32_t levels = 0);

/// All marks and edges of a program without waits, with its loops expanded. Ticks count from its start.
struct Plan {
  struct Mark {
    std::uint32_t id;
    std::uint64_t tick;
  };
  struct Edge {
    std::uint32_t line;
    bool level;
    std::uint64_t tick;
  };
  std::vector<Mark> marks;
  std::vector<Edge> edges;  ///< with those of End; all outputs are low before the program
  std::uint64_t steps = 0;
  std::uint64_t duration = 0;
};

/// program: keeps the rules and has no wait. The cost grows with the number of executed steps.
Plan plan_of(const Bytes& program);

}  // namespace symrig::conformance
