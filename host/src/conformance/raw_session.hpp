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

/// A frame from the board.
struct Received {
  protocol::FrameHeader header;
  Bytes body;
};

inline constexpr Nanoseconds kAnswerTime{
    300'000'000};  ///< after this long without an answer, the board has not answered
inline constexpr Nanoseconds kQuietTime{30'000'000};  ///< after this long without a frame, no frame comes
inline constexpr std::uint16_t kNoCode = 0xFFFF;      ///< instead of a code: no reply came

/// A request with its fields at zero; a start is one at once.
symrig_wire_Request make_request(pb_size_t which);

/// A minimal session that sends single frames, so that a check can break each rule on purpose. After the link
/// fails (lost()), the session sends and receives nothing.
class RawSession {
 public:
  explicit RawSession(std::unique_ptr<Link> link) : link_(std::move(link)) {}

  std::uint16_t seq = 1;  ///< number of the next numbered frame
  std::uint16_t ack = 0;  ///< number of the next expected event
  std::uint8_t credit = 64;
  bool acknowledges = true;  ///< acknowledge events as they arrive

  const std::optional<Error>& lost() const { return lost_; }
  Nanoseconds now() const { return link_->now(); }

  void send_bytes(std::span<const std::uint8_t> bytes);
  void send(protocol::Kind kind, std::uint16_t number, std::uint8_t flags, const Bytes& body,
            std::uint8_t major = protocol::kProtoMajor);
  /// The bytes of such a frame, for checks that damage them.
  Bytes frame(protocol::Kind kind, std::uint16_t number, std::uint8_t flags, const Bytes& body,
              std::uint8_t major = protocol::kProtoMajor) const;

  /// Receives frames until done() is true or `timeout` has passed. Returns whether done() was true.
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

  /// Sends a request once with the next number, and waits for its reply.
  std::optional<symrig_wire_Reply> ask(const symrig_wire_Request& request) {
    return ask_bytes(bytes_of(request));
  }
  std::optional<symrig_wire_Reply> ask_bytes(const Bytes& body, std::uint8_t major = protocol::kProtoMajor);
  /// Sends an urgent request, which has a number outside the sequence.
  std::optional<symrig_wire_Reply> ask_urgently(const symrig_wire_Request& request);
  /// Begins a session. The reply contains the number of the first event.
  std::optional<symrig_wire_Reply> hello();
  /// The code of the reply, or kNoCode if no reply came.
  std::uint32_t code(const symrig_wire_Request& request);

  /// Sends a chunk with the next number. Does not wait.
  void send_chunk(std::uint32_t id, std::uint32_t offset, std::span<const std::uint8_t> bytes);
  static Bytes chunk_body(std::uint32_t id, std::uint32_t offset, std::span<const std::uint8_t> bytes);
  static Bytes bytes_of(const symrig_wire_Request& request);

  /// Frames since the last forget().
  const std::vector<Received>& frames() const { return frames_; }
  std::size_t count(protocol::Kind kind) const;
  const Received* last(protocol::Kind kind) const;
  /// Events since the last forget(), in order, without repetitions.
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
  std::optional<std::uint16_t> greeting_;  // after hello was sent: the ack of its reply
};

}  // namespace symrig::conformance
