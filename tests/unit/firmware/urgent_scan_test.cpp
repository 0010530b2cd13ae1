// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/link.hpp"

#include "raw_host.hpp"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::firmware::urgent_scan_test {
namespace {

using protocol::Kind;
using Bytes = std::vector<std::uint8_t>;

Bytes frame(Kind kind, std::uint8_t flags, const Bytes& body) {
  Bytes wire(protocol::kMaxWire);
  wire.resize(protocol::encode_frame({protocol::kProtoMajor, kind, 0x1234, 7, 8, flags},
                                     {body.data(), body.size()}, {wire.data(), wire.size()}));
  return wire;
}

Bytes abort_body() {
  symrig_wire_Request request = symrig_wire_Request_init_zero;
  request.which_body = symrig_wire_Request_abort_tag;
  protocol::BodyBuffer buffer{};
  const std::size_t size = encode(request, buffer);
  return {buffer.bytes, buffer.bytes + size};
}

/// Bytes after which it says "abort", counted from 1; 0 = never.
std::size_t found_at(UrgentScan& scan, const Bytes& bytes) {
  std::size_t found = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    if (scan.push(bytes[i])) found = i + 1;
  return found;
}

TEST(UrgentScan, finds_an_abort_with_its_last_byte) {
  UrgentScan scan;
  const Bytes urgent = frame(Kind::request, protocol::flag::urgent, abort_body());
  EXPECT_EQ(found_at(scan, urgent), urgent.size());
  EXPECT_EQ(found_at(scan, urgent), urgent.size());  // and again
}

TEST(UrgentScan, finds_nothing_else) {
  UrgentScan scan;
  symrig_wire_Request ping = symrig_wire_Request_init_zero;
  ping.which_body = symrig_wire_Request_time_ping_tag;
  protocol::BodyBuffer buffer{};
  const std::size_t size = encode(ping, buffer);
  EXPECT_EQ(found_at(scan, frame(Kind::request, protocol::flag::urgent, {buffer.bytes, buffer.bytes + size})),
            0U);
  EXPECT_EQ(found_at(scan, frame(Kind::request, 0, abort_body())), 0U);
  EXPECT_EQ(found_at(scan, frame(Kind::data, protocol::flag::urgent, abort_body())), 0U);
  EXPECT_EQ(found_at(scan, frame(Kind::request, protocol::flag::urgent | protocol::flag::sync, abort_body())),
            0U);
  EXPECT_EQ(found_at(scan, frame(Kind::request, protocol::flag::urgent, {})), 0U);
}

TEST(UrgentScan, a_damaged_abort_is_none_and_the_next_one_is_found) {
  const Bytes urgent = frame(Kind::request, protocol::flag::urgent, abort_body());
  for (std::size_t at = 0; at + 1 < urgent.size(); ++at) {
    UrgentScan scan;
    Bytes damaged = urgent;
    damaged[at] ^= 0x41;
    EXPECT_EQ(found_at(scan, damaged), 0U) << at;
    EXPECT_EQ(found_at(scan, urgent), urgent.size()) << at;
  }
}

// A changed code byte breaks the blocks of COBS; any other changed byte is a burst that CRC-32C always finds.
TEST(UrgentScan, no_change_of_a_byte_makes_or_leaves_an_abort) {
  const Bytes urgent = frame(Kind::request, protocol::flag::urgent, abort_body());
  for (std::size_t at = 0; at < urgent.size(); ++at)
    for (unsigned change = 1; change < 256; ++change) {
      UrgentScan scan;
      Bytes damaged = urgent;
      damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ change);
      EXPECT_EQ(found_at(scan, damaged), 0U) << at << ' ' << change;
    }
}

// Zeros in the header's fields move the blocks of COBS; frames of any length may come before.
TEST(UrgentScan, finds_every_abort_behind_every_frame) {
  UrgentScan scan;
  const Bytes body = abort_body();
  for (unsigned seq = 0; seq < 0x10000; seq += 0x101)
    for (const unsigned ack : {0x0000U, 0x0001U, 0x0100U, 0xffffU}) {
      Bytes wire(protocol::kMaxWire);
      wire.resize(
          protocol::encode_frame({protocol::kProtoMajor, Kind::request, static_cast<std::uint16_t>(seq),
                                  static_cast<std::uint16_t>(ack), 0, protocol::flag::urgent},
                                 {body.data(), body.size()}, {wire.data(), wire.size()}));
      const Bytes before = frame(Kind::data, 0, Bytes(seq % 500, static_cast<std::uint8_t>(ack)));
      EXPECT_EQ(found_at(scan, before), 0U);
      EXPECT_EQ(found_at(scan, wire), wire.size()) << seq << ' ' << ack;
    }
}

TEST(UrgentScan, a_new_end_of_the_link_begins_afresh) {
  UrgentScan scan;
  const Bytes urgent = frame(Kind::request, protocol::flag::urgent, abort_body());
  for (std::size_t i = 0; i < 5; ++i) scan.push(urgent[i]);
  scan.restart();
  EXPECT_EQ(found_at(scan, urgent), urgent.size());
}

}  // namespace
}  // namespace symrig::firmware::urgent_scan_test
