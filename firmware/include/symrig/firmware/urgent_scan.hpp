// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/frame.hpp"

namespace symrig::firmware {

/// Finds an urgent abort in the bytes from the host before the core gets to them: for the interrupt in which
/// they arrive, so that outputs are safe whatever the main loop is doing. The core sees the same bytes later
/// and does the rest.
class UrgentScan {
 public:
  /// true: with this byte a sound urgent abort is complete.
  bool push(uint8_t byte) {
    if (decoder_.push(byte) != protocol::FrameDecoder::Event::frame) return false;
    const protocol::Frame& frame = decoder_.frame();
    const bool urgent = (frame.header.flags & protocol::flag::urgent) != 0;
    const bool sync = (frame.header.flags & protocol::flag::sync) != 0;
    const bool request = frame.header.kind == protocol::Kind::request;
    return request && urgent && !sync && is_abort(frame.body);
  }
  /// The host's end went away: what has come of a frame is void.
  void restart() { decoder_.restart(); }

 private:
  /// Request{abort{}}, as every encoder writes it: field 10, length-delimited, empty.
  static bool is_abort(protocol::ByteView body) {
    return body.size == 2 && body[0] == (10U << 3U | 2U) && body[1] == 0;
  }

  protocol::FrameDecoder decoder_;
};

}  // namespace symrig::firmware
