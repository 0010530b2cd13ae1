// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "unit/board/faulty_link.hpp"

#include <set>
#include <string>
#include <vector>

namespace symrig::test {

/// A board broken in one way, and what must find it.
struct Broken {
  std::string how;
  Breaks breaks;
  std::string filter;  // the checks to make
  std::set<std::string> found_by;
};

/// A board that calls itself best effort: words may be `lateness` ticks late. Every fourth edge that it sees
/// is `delay` late. tells: it counts the words that are later than promised.
Breaks best_effort(std::uint32_t lateness, std::uint32_t delay, bool tells);

/// Boards that break the rules of frames and numbers.
std::vector<Broken> broken_wires();
/// Boards that carry out what they should refuse, or refuse what they should carry out.
std::vector<Broken> broken_refusals();
/// Boards that tell something wrong.
std::vector<Broken> broken_words();
/// Boards that do not watch what they should.
std::vector<Broken> broken_watches();

}  // namespace symrig::test
