// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/link.hpp"
#include "symrig/protocol/messages.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace symrig::conformance {

using Bytes = std::vector<std::uint8_t>;

/// A frame from the board, kept.
struct Received {
  protocol::FrameHeader header;
  Bytes body;
};

inline constexpr Nanoseconds kAnswerTime{300'000'000};  ///< a board that takes longer has not answered
inline constexpr Nanoseconds kQuietTime{30'000'000};    ///< long enough to believe that nothing comes
inline constexpr std::uint16_t kNoCode = 0xFFFF;        ///< in place of a code: no reply came

symrig_wire_Request make_request(pb_size_t which);

/// The least that can speak to a board, frame by frame, so that each rule can be broken on purpose. A link
/// that fails is remembered (lost()); from then on nothing is sent and nothing comes.
class RawSession {
 public:
  explicit RawSession(std::unique_ptr<Link> link) : link_(std::move(link)) {}

  std::uint16_t seq = 1;  ///< of the next numbered frame
  std::uint16_t ack = 0;  ///< event expected next
  std::uint8_t credit = 64;
  bool acknowledges = true;  ///< events, as they come

  const std::optional<Error>& lost() const { return lost_; }
  Nanoseconds now() const { return link_->now(); }

  void send_bytes(std::span<const std::uint8_t> bytes);
  void send(protocol::Kind kind, std::uint16_t number, std::uint8_t flags, const Bytes& body,
            std::uint8_t major = protocol::kProtoMajor);
  /// The bytes of such a frame, to be damaged.
  Bytes frame(protocol::Kind kind, std::uint16_t number, std::uint8_t flags, const Bytes& body,
              std::uint8_t major = protocol::kProtoMajor) const;

  /// Takes what comes until `done` says so or `timeout` has passed. true: done.
  template <class Done>
  bool listen_until(Done done, Nanoseconds timeout) {
    const Nanoseconds deadline = now() + timeout;
    while (!done()) {
      const Nanoseconds left = deadline - now();
      if (left.count() <= 0 || lost_) return false;
      take(left);
    }
    return true;
  }
  void listen_for(Nanoseconds time) {
    listen_until([] { return false; }, time);
  }

  /// Sends a request once and waits for its reply; the number is used up.
  std::optional<symrig_wire_Reply> ask(const symrig_wire_Request& request) {
    return ask_bytes(bytes_of(request));
  }
  std::optional<symrig_wire_Reply> ask_bytes(const Bytes& body, std::uint8_t major = protocol::kProtoMajor);
  /// Out of turn, with a token of its own.
  std::optional<symrig_wire_Reply> ask_urgently(const symrig_wire_Request& request);
  /// Begins a session; the number of the first event is taken from the reply.
  std::optional<symrig_wire_Reply> hello();
  /// Code of the reply, kNoCode if none came.
  std::uint32_t code(const symrig_wire_Request& request);

  /// Sends a chunk, the number is used up. Does not wait.
  void send_chunk(std::uint32_t id, std::uint32_t offset, std::span<const std::uint8_t> bytes);
  static Bytes chunk_body(std::uint32_t id, std::uint32_t offset, std::span<const std::uint8_t> bytes);
  static Bytes bytes_of(const symrig_wire_Request& request);

  /// Frames since the last forget().
  const std::vector<Received>& frames() const { return frames_; }
  std::size_t count(protocol::Kind kind) const;
  const Received* last(protocol::Kind kind) const;
  /// Events in order, each once, since the last forget().
  const std::vector<symrig_wire_Event>& events() const { return events_; }
  const symrig_wire_Event* last_event(pb_size_t which) const;
  void forget();

 private:
  void take(Nanoseconds timeout);
  void take_frame(const protocol::Frame& frame);
  std::optional<symrig_wire_Reply> await_reply(std::uint16_t wanted, std::uint8_t flags);

  std::unique_ptr<Link> link_;
  protocol::FrameDecoder decoder_;
  std::vector<Received> frames_;
  std::vector<symrig_wire_Event> events_;
  std::optional<Error> lost_;
  bool owes_ack_ = false;
  std::optional<std::uint16_t> greeting_;  // hello was sent; the ack of its reply
};

}  // namespace symrig::conformance
