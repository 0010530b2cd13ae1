// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <span>

namespace symrig::acquisition {

/// How the transport of a polish is dealt. T is the sum of parts, and each of several processes has some of
/// them. All processes run the same polish on the same photographs: each call here is made by all of them, in
/// the same order. This class is one process with all of T in one part.
class PolishTeam {
 public:
  PolishTeam() = default;
  PolishTeam(const PolishTeam&) = delete;
  PolishTeam& operator=(const PolishTeam&) = delete;
  virtual ~PolishTeam() = default;

  /// Parts of all processes together.
  virtual std::size_t parts() const { return 1; }
  /// The number of the first part here; the others here follow it. Exactly one process has part 0.
  virtual std::size_t first() const { return 0; }

  /// Each value becomes its sum over the processes, on all of them. The sums are exact in any order
  /// (ExactSums), so how many processes there are changes no bit.
  virtual void add_up(std::span<double> /*values*/) const {}
  /// The first failure of any process, on all of them.
  virtual Result<void> all(const Result<void>& mine) const { return mine; }
};

}  // namespace symrig::acquisition
