// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace symrig::test {

/// The first two causes of a refusal, and how many there are.
inline std::pair<std::string, std::size_t> first_causes(const std::string& line) {
  const std::string mark = "possible causes: ", between = "; or ";
  const auto begin = line.find(mark);
  if (begin == std::string::npos) return {line, 1};
  std::size_t count = 1, at = begin, second = std::string::npos;
  while ((at = line.find(between, at + 1)) != std::string::npos) {
    ++count;
    if (count == 3) second = at;
  }
  return {line.substr(0, second), count};
}

/// One of the fault's causes is named first or second, of at most three. "Moved" is said only of what moved.
template <class Fault>
void expect_named(const Fault& fault, const std::string& command, const std::string& line) {
  const auto named = first_causes(line);
  EXPECT_LE(named.second, 3U) << command << ": " << line;
  EXPECT_TRUE(std::ranges::any_of(
      fault.causes, [&](const std::string& one) { return named.first.find(one) != std::string::npos; }))
      << fault.name << ", " << command << ": " << line;
  if (!fault.moved) {
    EXPECT_EQ(line.find("moved"), std::string::npos) << fault.name << ", " << command << ": " << line;
  }
}

}  // namespace symrig::test
