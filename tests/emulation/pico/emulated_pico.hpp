// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "assert_ok.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/virtual_bench.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::test {

/// One clock cycle and one tick of the Pico.
inline constexpr Nanoseconds kCycle{8};

/// A process that emulates a Pico with our image, and the table it lies on. One a test: each begins at
/// power-up.
class EmulatedPico {
 public:
  /// Why the image cannot be run on this machine; empty if it can.
  static std::string missing();

  EmulatedPico();
  EmulatedPico(const EmulatedPico&) = delete;
  EmulatedPico& operator=(const EmulatedPico&) = delete;
  ~EmulatedPico();

  VirtualBench& bench() { return *bench_; }
  /// A session with the board.
  Board connect(const BoardOptions& options = {});
  /// The same without a library in the way: raw bytes.
  std::unique_ptr<Link> link() { return bench_->link(); }

  /// All edges since the last call.
  std::vector<PinEdge> edges();
  /// The board's time in cycles.
  std::uint64_t cycle() const;
  /// Lets so much of the board's time pass, whatever it sends.
  void pass(Nanoseconds time);

 private:
  std::string socket_;
  int process_ = -1;
  std::optional<VirtualBench> bench_;
  std::unique_ptr<Link> idle_;
};

/// Edges of one pin.
std::vector<PinEdge> of_pin(const std::vector<PinEdge>& edges, unsigned gpio);

/// The GPIO number of a line, from the pin name that the board tells ("GPIO16").
unsigned gpio_of(const BoardInfo& info, std::string_view line);

}  // namespace symrig::test

/// Skips where the image cannot be run, and says why.
#define NEEDS_EMULATION() \
  if (const std::string why = ::symrig::test::EmulatedPico::missing(); !why.empty()) GTEST_SKIP() << why
