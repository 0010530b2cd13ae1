// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gpio.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

#include <sys/eventfd.h>
#include <unistd.h>

namespace symrig::board_linux::test {

/// Lines in memory. Keeps every word that was put out, and gives edges that the test makes.
class FakeGpio final : public Gpio {
 public:
  FakeGpio() : edge_fd_{::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)} {}
  ~FakeGpio() override { ::close(edge_fd_[0]); }

  using Gpio::put;
  bool put(std::uint32_t levels, std::uint32_t lines) noexcept override {
    const std::scoped_lock lock(mutex_);
    if (broken_) {
      errno = EIO;
      return false;
    }
    outputs_ = (outputs_ & ~lines) | (levels & lines);
    words_.push_back(outputs_);
    return true;
  }
  bool inputs(std::uint32_t& levels) const noexcept override {
    const std::scoped_lock lock(mutex_);
    levels = inputs_;
    return true;
  }
  std::span<const int> edge_fds() const override { return edge_fd_; }
  std::size_t read_edges(std::span<hal::CapturedEdge> out, bool& lost) override {
    const std::scoped_lock lock(mutex_);
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t got = ::read(edge_fd_[0], &count, sizeof count);
    lost = lost_;
    lost_ = false;
    std::size_t taken = 0;
    if (storm_ && edges_.empty()) {
      for (; taken < out.size(); ++taken) out[taken] = {storm_tick_++, *storm_, storm_tick_ % 2 == 0};
      wake();
      return taken;
    }
    for (; taken < out.size() && !edges_.empty(); edges_.pop_front()) out[taken++] = edges_.front();
    return taken;
  }

  // What tests do.
  void edge(const hal::CapturedEdge& edge) {
    {
      const std::scoped_lock lock(mutex_);
      const std::uint32_t bit = 1U << edge.line;
      inputs_ = edge.level ? inputs_ | bit : inputs_ & ~bit;
      edges_.push_back(edge);
    }
    wake();
  }
  /// The level changes, but its edge finds no room.
  void lose_edge(std::uint8_t line, bool level) {
    {
      const std::scoped_lock lock(mutex_);
      inputs_ = level ? inputs_ | 1U << line : inputs_ & ~(1U << line);
      lost_ = true;
    }
    wake();
  }
  /// From now on this input changes faster than anyone can read. No value: it stops.
  void storm(std::optional<std::uint8_t> line) {
    {
      const std::scoped_lock lock(mutex_);
      storm_ = line;
    }
    wake();
  }
  void break_down() {
    const std::scoped_lock lock(mutex_);
    broken_ = true;
  }
  std::uint32_t outputs() const {
    const std::scoped_lock lock(mutex_);
    return outputs_;
  }
  std::vector<std::uint32_t> words() const {
    const std::scoped_lock lock(mutex_);
    return words_;
  }

 private:
  void wake() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(edge_fd_[0], &one, sizeof one);
  }

  mutable std::mutex mutex_;
  std::array<int, 1> edge_fd_;
  std::deque<hal::CapturedEdge> edges_;
  std::vector<std::uint32_t> words_;
  std::uint32_t outputs_ = 0;
  std::uint32_t inputs_ = 0;
  bool lost_ = false;
  bool broken_ = false;
  std::optional<std::uint8_t> storm_;
  hal::Tick storm_tick_ = 1;
};

}  // namespace symrig::board_linux::test
