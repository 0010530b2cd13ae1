// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/link.hpp"
#include "symrig/protocol/messages.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>

namespace symrig::board {

/// The host's end of the wire: numbers frames, repeats requests without a reply, sorts events. Rules:
/// protocol/PROTOCOL.md, "Sequence".
class Wire {
 public:
  using EventSink = std::function<void(const symrig_wire_Event&)>;

  Wire(std::unique_ptr<Link> link, const BoardOptions& options, EventSink sink);

  /// Begins a session.
  Result<symrig_wire_Reply> hello();
  /// Sends a request and waits for its reply, with any code. fails: device_lost.
  Result<symrig_wire_Reply> request(const symrig_wire_Request& request);
  /// Sends a request that overtakes others (Abort only).
  Result<symrig_wire_Reply> urgent(const symrig_wire_Request& request);
  /// What a board can receive.
  struct Limits {
    std::uint32_t mtu = protocol::kMtu;  ///< bytes of a decoded frame
    unsigned window = 1;                 ///< frames in flight
  };

  /// Sends a program in chunks, as large and as many in flight as the board can receive. If the board refuses
  /// a chunk, returns its reply. fails: device_lost.
  Result<std::optional<symrig_wire_Reply>> send_chunks(std::uint32_t program_id,
                                                       std::span<const std::uint8_t> bytes,
                                                       const Limits& limits);
  /// Handles bytes that arrive within `timeout`; returns after the first ones.
  Result<void> listen(Nanoseconds timeout);

  Nanoseconds now() const { return link_->now(); }
  SteadyTime opened() const { return link_->opened(); }

 private:
  struct Upload;

  Result<symrig_wire_Reply> ask(const symrig_wire_Request& request, std::uint16_t seq, std::uint8_t flags,
                                int attempts);
  Result<void> send(protocol::Kind kind, std::uint16_t seq, std::uint8_t flags, protocol::ByteView body);
  Result<void> send_window(Upload& upload);
  Result<void> await(const std::function<bool()>& arrived, Nanoseconds timeout);
  void take(const protocol::Frame& frame);
  void take_reply(const protocol::Frame& frame);
  void take_event(const protocol::Frame& frame);

  std::unique_ptr<Link> link_;
  BoardOptions options_;
  EventSink sink_;
  protocol::FrameDecoder decoder_;

  std::uint16_t next_seq_ = 1;
  std::uint16_t next_event_ = 0;  // number of the next expected event
  std::uint16_t hello_ack_ = 0;
  bool in_session_ = false;
  bool asked_ = false;  // there was a Hello on this link
  bool events_to_acknowledge_ = false;
  bool events_missing_ = false;

  // Contents of the frames received last.
  std::optional<symrig_wire_Reply> reply_;
  std::uint16_t reply_ack_ = 0;
  bool reply_urgent_ = false;
  std::uint16_t acked_ = 0;  // the board expects this frame next
  bool nak_ = false;
  std::uint16_t nak_ack_ = 0;
};

}  // namespace symrig::board
