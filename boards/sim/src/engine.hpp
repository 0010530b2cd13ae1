// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/edge_engine.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace symrig::boards {

/// Where the engine's words go.
class Pins {
 public:
  virtual void drive(std::uint32_t levels) = 0;
  virtual std::uint64_t now() const = 0;

 protected:
  ~Pins() = default;
};

/// The edge engine in virtual time: exact, and as unforgiving about an empty queue as the real one.
class Engine final : public hal::EdgeEngine {
 public:
  Engine(Pins& pins, std::size_t depth) : pins_(pins), queue_(depth) {}

  std::size_t room() const override { return queue_.size() - count_; }
  void push(const hal::Segment& segment) override;
  void close() override { closed_ = true; }
  hal::Tick start(hal::Tick tick) override;
  bool idle() const override { return !playing_; }
  std::uint32_t levels() const override { return levels_; }
  bool underrun() const override { return underrun_; }
  std::uint32_t played() const override { return played_; }
  void force(std::uint32_t levels) override;

  /// When the next word is due (or the queue is found empty).
  hal::Tick next_event() const { return playing_ ? next_ : hal::kNever; }
  /// Does what is due at next_event() == now.
  void step();

 private:
  void drive(std::uint32_t levels);

  Pins& pins_;
  std::vector<hal::Segment> queue_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  bool playing_ = false;
  bool closed_ = false;
  bool underrun_ = false;
  std::uint32_t played_ = 0;
  std::uint32_t levels_ = 0;
  hal::Tick next_ = 0;
};

}  // namespace symrig::boards
