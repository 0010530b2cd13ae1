// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/cobs.hpp"
#include "symrig/protocol/crc32c.hpp"
#include "symrig/protocol/types.hpp"

namespace symrig::protocol {

constexpr uint8_t kProtoMajor = 1;
constexpr uint8_t kProtoMinor = 0;

constexpr size_t kHeaderSize = 8;
constexpr size_t kCrcSize = 4;
/// Bytes of a decoded frame, header and CRC included. The build of a board with little memory defines
/// SYMRIG_MTU, 128 to 512; its capabilities tell the host.
#ifdef SYMRIG_MTU
constexpr size_t kMtu = SYMRIG_MTU;
#else
constexpr size_t kMtu = 512;
#endif
constexpr size_t kMaxBody = kMtu - kHeaderSize - kCrcSize;
constexpr size_t kMaxWire = cobs_bound(kMtu) + 1;  ///< bytes of a frame on the wire, closing zero included

enum class Kind : uint8_t { request = 1, reply = 2, event = 3, data = 4, ack = 5, nak = 6 };

/// Bits of FrameHeader::flags. Other bits are sent as 0 and ignored.
namespace flag {
constexpr uint8_t sync = 1;    ///< this Hello begins a session: its seq is the first
constexpr uint8_t urgent = 2;  ///< outside of the sequence; seq is a token that the reply's ack returns
}  // namespace flag

/// The 8 bytes before every body, little endian.
struct FrameHeader {
  uint8_t proto_major = kProtoMajor;
  Kind kind = Kind::request;
  uint16_t seq = 0;    ///< number of this frame (REPLY, ACK, NAK: of the sender's next numbered frame)
  uint16_t ack = 0;    ///< number of the next expected frame from the other side
  uint8_t credit = 0;  ///< numbered frames for which the sender of this header has room
  uint8_t flags = 0;
};

/// True if `a` is before `b` in the 16-bit circle of sequence numbers.
constexpr bool seq_before(uint16_t a, uint16_t b) {
  return static_cast<uint16_t>(b - a) - 1U < 0x7FFFU;
}

constexpr void put_header(const FrameHeader& header, uint8_t* out) {
  out[0] = header.proto_major;
  out[1] = static_cast<uint8_t>(header.kind);
  put_u16(out + 2, header.seq);
  put_u16(out + 4, header.ack);
  out[6] = header.credit;
  out[7] = header.flags;
}

/// A decoded frame. body points into the decoder and is valid until its next push().
struct Frame {
  FrameHeader header;
  ByteView body;
};

/// Writes COBS(header | body | crc) and the closing zero. Returns the number of written bytes; 0 if the body
/// is longer than kMaxBody or `out` is too small (kMaxWire always suffices). body and out must not overlap.
constexpr size_t encode_frame(const FrameHeader& header, ByteView body, ByteRoom out) {
  const size_t plain_size = kHeaderSize + body.size + kCrcSize;
  if (body.size > kMaxBody || out.size < cobs_bound(plain_size) + 1) return 0;
  uint8_t head[kHeaderSize] = {};
  put_header(header, head);
  Crc32c crc;
  crc.add({head, kHeaderSize});
  crc.add(body);
  uint8_t tail[kCrcSize] = {};
  put_u32(tail, crc.value());
  CobsWriter writer(out.data);
  writer.add({head, kHeaderSize});
  writer.add(body);
  writer.add({tail, kCrcSize});
  const size_t written = writer.finish();
  out[written] = 0;
  return written + 1;
}

/// Finds frames in a stream of bytes, one byte at a time. Accepts any bytes: it counts and drops what is not
/// a frame, and a new frame begins after the next zero byte. Memory: one frame.
class FrameDecoder {
 public:
  enum class Event : uint8_t {
    none,       ///< no frame ends here
    frame,      ///< frame() is complete
    bad_cobs,   ///< a zero inside a block
    too_long,   ///< more than kMtu bytes
    too_short,  ///< no room for header and CRC
    bad_crc,
    bad_kind  ///< the CRC is right, but the kind does not exist
  };

  Event push(uint8_t byte) {
    if (byte == 0) return finish();
    if (left_ == 0) return start_block(byte);
    --left_;
    store(byte);
    return Event::none;
  }

  const Frame& frame() const { return frame_; }

  /// The other end reconnected: discards a partial frame.
  void restart() {
    size_ = 0;
    left_ = 0;
    zero_owed_ = false;
    overflow_ = false;
  }

 private:
  Event start_block(uint8_t code) {
    if (zero_owed_) store(0);
    zero_owed_ = code != 0xFF;
    left_ = static_cast<uint8_t>(code - 1);
    return Event::none;
  }

  void store(uint8_t byte) {
    if (size_ == kMtu) {
      overflow_ = true;
      return;
    }
    plain_[size_++] = byte;
  }

  Event finish() {
    const Event event = judge();
    restart();
    return event;
  }

  Event judge() {
    if (overflow_) return Event::too_long;
    if (left_ != 0) return Event::bad_cobs;
    if (size_ == 0) return Event::none;  // zeros between frames are allowed: a sender may flush with them
    if (size_ < kHeaderSize + kCrcSize) return Event::too_short;
    const size_t covered = size_ - kCrcSize;
    if (crc32c({plain_, covered}) != get_u32(plain_ + covered)) return Event::bad_crc;
    if (plain_[1] < static_cast<uint8_t>(Kind::request) || plain_[1] > static_cast<uint8_t>(Kind::nak))
      return Event::bad_kind;
    frame_.header = {plain_[0],           static_cast<Kind>(plain_[1]),
                     get_u16(plain_ + 2), get_u16(plain_ + 4),
                     plain_[6],           plain_[7]};
    frame_.body = {plain_ + kHeaderSize, covered - kHeaderSize};
    return Event::frame;
  }

  uint8_t plain_[kMtu] = {};
  size_t size_ = 0;
  uint8_t left_ = 0;        // bytes that are missing in this block
  bool zero_owed_ = false;  // the last block represents a zero at its end, if another block follows
  bool overflow_ = false;
  Frame frame_;
};

}  // namespace symrig::protocol
