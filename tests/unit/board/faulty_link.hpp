// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/link.hpp"
#include "symrig/protocol/messages.hpp"
#include "unit/protocol/random_program.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace symrig::test {

using protocol::Frame;
using protocol::FrameHeader;
using protocol::Kind;
using Bytes = std::vector<std::uint8_t>;

/// What a broken board does to a frame: changes it, or false to drop it.
using Break = std::function<bool(FrameHeader& header, Bytes& body)>;
struct Breaks {
  Break from_board;              // frames that the board sends
  Break to_board;                // frames that it gets
  bool answers_rubbish = false;  // bytes that are no frame count as the last frame again
};

/// A link that makes a good board look broken.
class BrokenLink final : public Link {
 public:
  BrokenLink(std::unique_ptr<Link> link, Breaks breaks)
      : link_(std::move(link)), breaks_(std::move(breaks)) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override {
    const bool whole = !breaks_.to_board && !breaks_.answers_rubbish;
    return link_->send(whole ? Bytes(bytes.begin(), bytes.end()) : spoil(bytes, to_, breaks_.to_board));
  }
  Result<Bytes> receive(Nanoseconds timeout) override {
    SYMRIG_TRY(const Bytes bytes, link_->receive(timeout));
    return breaks_.from_board ? spoil(bytes, from_, breaks_.from_board) : bytes;
  }
  Nanoseconds now() const override { return link_->now(); }

 private:
  /// Sound frames go through the break, all other bytes as they are.
  struct Half {
    protocol::FrameDecoder decoder;
    Bytes raw, last;
  };
  Bytes spoil(std::span<const std::uint8_t> bytes, Half& half, const Break& how) const {
    Bytes out;
    for (const std::uint8_t byte : bytes) {
      half.raw.push_back(byte);
      const bool frame = half.decoder.push(byte) == protocol::FrameDecoder::Event::frame;
      if (byte != 0) continue;
      Bytes passed = frame && how ? translated(half.decoder.frame(), how) : half.raw;
      if (!frame && breaks_.answers_rubbish) passed = half.last;
      if (frame) half.last = passed;
      out.insert(out.end(), passed.begin(), passed.end());
      half.raw.clear();
    }
    return out;
  }
  static Bytes translated(const Frame& frame, const Break& how) {
    FrameHeader header = frame.header;
    Bytes body(frame.body.data, frame.body.data + frame.body.size);
    if (!how(header, body)) return {};
    Bytes wire(protocol::kMaxWire);
    wire.resize(protocol::encode_frame(header, {body.data(), body.size()}, {wire.data(), wire.size()}));
    return wire;
  }

  std::unique_ptr<Link> link_;
  Breaks breaks_;
  Half to_, from_;
};

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
