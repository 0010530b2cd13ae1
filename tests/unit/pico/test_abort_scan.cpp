// SPDX-License-Identifier: Apache-2.0
#include "abort_scan.hpp"
#include "symrig/protocol/frame.hpp"
#include "symrig/protocol/messages.hpp"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::pico {
namespace {

using Bytes = std::vector<std::uint8_t>;
using protocol::FrameHeader;
using protocol::Kind;
namespace flag = protocol::flag;

constexpr std::uint8_t kTag = symrig_wire_Request_abort_tag << 3U | 2U;
const Bytes kAbort{kTag, 0};

Bytes wire_of(const FrameHeader& header, const Bytes& body) {
  Bytes wire(protocol::kMaxWire);
  wire.resize(protocol::encode_frame(header, {body.data(), body.size()}, {wire.data(), wire.size()}));
  return wire;
}

FrameHeader urgent(std::uint16_t seq, std::uint16_t ack, std::uint8_t credit) {
  return {protocol::kProtoMajor, Kind::request, seq, ack, credit, flag::urgent};
}

bool found(const Bytes& packet) {
  return ends_with_abort(packet.data(), packet.size());
}

Bytes joined(Bytes first, const Bytes& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

// Zeros in any field move the COBS blocks: every pattern of them must be found.
TEST(AbortScan, FindsEveryUrgentAbort) {
  for (unsigned seq = 0; seq < 0x10000; seq += 0x101)
    for (const unsigned ack : {0x0000U, 0x0001U, 0x0100U, 0x1234U, 0xffffU})
      for (const unsigned credit : {0U, 1U, 255U})
        EXPECT_TRUE(found(wire_of(urgent(static_cast<std::uint16_t>(seq), static_cast<std::uint16_t>(ack),
                                         static_cast<std::uint8_t>(credit)),
                                  kAbort)))
            << seq << ' ' << ack << ' ' << credit;
}

TEST(AbortScan, FindsItBehindOtherFrames) {
  const Bytes other = wire_of({protocol::kProtoMajor, Kind::ack, 7, 9, 8, 0}, {});
  const Bytes abort = wire_of(urgent(3, 4, 5), kAbort);
  EXPECT_TRUE(found(joined(other, abort)));
  EXPECT_TRUE(found(joined({0}, abort)));
  EXPECT_FALSE(found(joined(abort, other)));  // the main loop finds it there
}

TEST(AbortScan, NothingElseIsAnAbort) {
  FrameHeader header = urgent(1, 2, 3);
  header.flags = 0;
  EXPECT_FALSE(found(wire_of(header, kAbort))) << "not urgent: it has its turn";
  header = urgent(1, 2, 3);
  header.kind = Kind::data;
  EXPECT_FALSE(found(wire_of(header, kAbort)));
  EXPECT_FALSE(found(wire_of(urgent(1, 2, 3), {symrig_wire_Request_time_ping_tag << 3U | 2U, 0})));
  EXPECT_FALSE(found(wire_of(urgent(1, 2, 3), {kTag, 0, 0})));
  EXPECT_FALSE(found({}));
  EXPECT_FALSE(found(Bytes(64, 0)));
  EXPECT_FALSE(found(Bytes(64, 0x10)));
}

// A changed code byte breaks the blocks of COBS; any other changed byte is a burst that CRC-32C always finds.
TEST(AbortScan, ADamagedAbortIsNone) {
  const Bytes sound = wire_of(urgent(0x1200, 0x0034, 8), kAbort);
  for (std::size_t at = 0; at < sound.size(); ++at)
    for (unsigned change = 1; change < 256; ++change) {
      Bytes damaged = sound;
      damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ change);
      EXPECT_FALSE(found(damaged)) << at << ' ' << change;
    }
}

TEST(AbortScan, ALongerFrameThatEndsLikeOneIsNone) {
  const Bytes abort = wire_of(urgent(3, 4, 5), kAbort);
  for (unsigned before = 1; before < 256; ++before)
    EXPECT_FALSE(found(joined({static_cast<std::uint8_t>(before)}, abort))) << before;
}

TEST(AbortScan, ACutAbortIsNone) {
  const Bytes abort = wire_of(urgent(3, 4, 5), kAbort);
  for (std::size_t size = 0; size < abort.size(); ++size) {
    EXPECT_FALSE(ends_with_abort(abort.data(), size));
    if (size > 0) {
      EXPECT_FALSE(ends_with_abort(abort.data() + size, abort.size() - size));
    }
  }
}

}  // namespace
}  // namespace symrig::pico
