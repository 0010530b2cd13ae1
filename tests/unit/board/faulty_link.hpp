// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/link.hpp"
#include "unit/protocol/random_program.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace symrig::test {

/// What becomes of frames (runs of bytes up to a zero) on their way, in percent.
struct Faults {
  std::uint64_t seed = 0;
  unsigned lost = 0;
  unsigned repeated = 0;
  unsigned swapped = 0;    // comes after the one that follows it
  unsigned cut = 0;        // the end missing, closing zero included
  unsigned corrupted = 0;  // one bit flipped
  unsigned rubbish = 0;    // bytes that nobody sent, before it
};

/// A channel that does all that a channel can do, the same way for the same seed.
class FaultyLink final : public Link {
 public:
  FaultyLink(std::unique_ptr<Link> link, const Faults& faults)
      : link_(std::move(link)), faults_(faults), random_(faults.seed) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override { return link_->send(spoil(bytes, to_)); }
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override {
    SYMRIG_TRY(const auto bytes, link_->receive(timeout));
    return spoil(bytes, from_);
  }
  Nanoseconds now() const override { return link_->now(); }

  std::uint64_t frames() const { return frames_; }
  std::uint64_t spoiled() const { return spoiled_; }

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Half {
    Bytes begun;  // a frame of which the end has not come
    Bytes late;   // a frame that was overtaken
  };

  Bytes spoil(std::span<const std::uint8_t> bytes, Half& half) {
    Bytes out;
    for (const std::uint8_t byte : bytes) {
      half.begun.push_back(byte);
      if (byte != 0) continue;
      pass(std::exchange(half.begun, {}), half, out);
    }
    return out;
  }

  void pass(Bytes frame, Half& half, Bytes& out) {
    ++frames_;
    const Bytes overtaken = std::exchange(half.late, {});
    if (chance(faults_.rubbish))
      for (std::uint64_t k = random_.range(1, 40); k > 0; --k)
        out.push_back(static_cast<std::uint8_t>(random_.next()));
    if (chance(faults_.corrupted))
      frame[random_.range(0, frame.size() - 1)] ^= static_cast<std::uint8_t>(1U << random_.range(0, 7));
    if (chance(faults_.cut)) frame.resize(random_.range(0, frame.size() - 1));
    const bool lost = chance(faults_.lost);
    if (!lost && overtaken.empty() && chance(faults_.swapped)) {
      half.late = std::move(frame);
      return;
    }
    if (!lost) out.insert(out.end(), frame.begin(), frame.end());
    if (!lost && chance(faults_.repeated)) out.insert(out.end(), frame.begin(), frame.end());
    out.insert(out.end(), overtaken.begin(), overtaken.end());
  }

  bool chance(unsigned percent) {
    if (!random_.chance(percent)) return false;
    ++spoiled_;
    return true;
  }

  std::unique_ptr<Link> link_;
  Faults faults_;
  symrig::test::Random random_;
  Half to_, from_;
  std::uint64_t frames_ = 0;
  std::uint64_t spoiled_ = 0;
};

/// The same link seen by a host whose clock runs fast (ppm > 0) or slow.
class DriftingLink final : public Link {
 public:
  DriftingLink(std::unique_ptr<Link> link, int ppm) : link_(std::move(link)), ppm_(ppm) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override { return link_->send(bytes); }
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override {
    return link_->receive(timeout - timeout * ppm_ / 1'000'000);
  }
  Nanoseconds now() const override { return link_->now() + link_->now() * ppm_ / 1'000'000; }

 private:
  std::unique_ptr<Link> link_;
  int ppm_;
};

}  // namespace symrig::test
