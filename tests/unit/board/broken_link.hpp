// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/link.hpp"
#include "symrig/protocol/messages.hpp"

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

}  // namespace symrig::test
