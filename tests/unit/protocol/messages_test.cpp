// SPDX-License-Identifier: Apache-2.0
#include "symrig/protocol/messages.hpp"

#include "random_program.hpp"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <pb_encode.h>
#include <rapidcheck.h>

namespace symrig::protocol::messages_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// A reply with every byte of its member set to `fill` (0 or 1), texts ended.
symrig_wire_Reply filled(pb_size_t member, std::uint8_t fill) {
  symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
  reply.which_body = member;
  __builtin_memset(&reply.body, fill, sizeof reply.body);
  if (member == symrig_wire_Reply_hello_tag) {
    symrig_wire_HelloReply& hello = reply.body.hello;
    hello.board[sizeof hello.board - 1] = hello.firmware_version[sizeof hello.firmware_version - 1] = 0;
    hello.unique_id.size = fill == 0 ? 0 : sizeof hello.unique_id.bytes;
  }
  if (member == symrig_wire_Reply_capabilities_tag)
    reply.body.capabilities.label[sizeof reply.body.capabilities.label - 1] = 0;
  if (member == symrig_wire_Reply_line_tag)
    reply.body.line.name[sizeof reply.body.line.name - 1] =
        reply.body.line.pin[sizeof reply.body.line.pin - 1] = 0;
  return reply;
}

TEST(Messages, a_reply_is_encoded_as_nanopb_encodes_it) {
  for (pb_size_t member = 0; member <= symrig_wire_Reply_diagnostics_tag; ++member) {
    for (const std::uint8_t fill : {std::uint8_t{0}, std::uint8_t{1}}) {
      if (member != 0 && member < symrig_wire_Reply_hello_tag) continue;
      symrig_wire_Reply reply = filled(member, fill);
      reply.code = fill == 0 ? symrig_wire_Code_CODE_OK : symrig_wire_Code_CODE_COOLING;
      reply.field = fill * 300U;
      reply.detail = fill == 0 ? 0 : UINT64_MAX;
      BodyBuffer own{};
      BodyBuffer theirs{};
      pb_ostream_t stream = pb_ostream_from_buffer(theirs.bytes, sizeof theirs.bytes);
      ASSERT_TRUE(pb_encode(&stream, symrig_wire_Reply_fields, &reply)) << member;
      const std::size_t size = encode(reply, own);
      EXPECT_EQ(Bytes(own.bytes, own.bytes + size), Bytes(theirs.bytes, theirs.bytes + stream.bytes_written))
          << member;
    }
  }
}

TEST(Messages, unknown_fields_are_passed_over) {
  // keep_alive { ttl_ms = 5, field 15 = 1 } and, beside it, field 63 = "x": written by a newer host.
  const Bytes body{0x6A, 0x04, 0x08, 0x05, 0x78, 0x01, 0xFA, 0x03, 0x01, 'x'};
  symrig_wire_Request request;
  ASSERT_TRUE(decode({body.data(), body.size()}, request));
  EXPECT_EQ(request.which_body, symrig_wire_Request_keep_alive_tag);
  EXPECT_EQ(request.body.keep_alive.ttl_ms, 5U);
}

TEST(Messages, text_longer_than_its_bound_is_refused) {
  Bytes line{0x1A, 30};  // LineReply.name, 30 bytes: the bound is 24 with the closing zero
  line.insert(line.end(), 30, 'a');
  Bytes body{0x32, static_cast<std::uint8_t>(line.size())};
  body.insert(body.end(), line.begin(), line.end());
  symrig_wire_Reply reply;
  EXPECT_FALSE(decode({body.data(), body.size()}, reply));
}

TEST(Messages, text_that_is_not_utf8_is_refused) {
  const Bytes body{0x32, 0x04, 0x1A, 0x02, 0xC3, 0x28};
  symrig_wire_Reply reply;
  EXPECT_FALSE(decode({body.data(), body.size()}, reply));
}

TEST(Messages, a_value_that_is_no_enumerator_can_be_looked_at) {
  const Bytes body{0x08, 0x63};  // Reply.code = 99
  symrig_wire_Reply reply;
  ASSERT_TRUE(decode({body.data(), body.size()}, reply));
  EXPECT_EQ(raw(reply.code), 99U);
}

TEST(Messages, truncated_bodies_are_refused_or_shorter) {
  symrig_wire_Event event = symrig_wire_Event_init_zero;
  event.which_body = symrig_wire_Event_run_done_tag;
  event.body.run_done = {symrig_wire_RunEnd_RUN_END_FAULT, 1U << 30U, 1U << 29U, 77, 1, 2, 3, 4};
  BodyBuffer body{};
  const std::size_t size = encode(event, body);
  ASSERT_GT(size, 10U);
  for (std::size_t cut = 1; cut < size; ++cut) {
    symrig_wire_Event out;
    EXPECT_FALSE(decode({body.bytes, cut}, out)) << cut;
  }
}

template <class Body>
Bytes by_hand(const Body& body) {
  BodyBuffer buffer{};
  const std::size_t size = encode(body, buffer);
  return {buffer.bytes, buffer.bytes + size};
}

Bytes in_general(const symrig_wire_Event& event) {
  BodyBuffer buffer{};
  const std::size_t size = encode(event, buffer);
  return {buffer.bytes, buffer.bytes + size};
}

TEST(Messages, marks_and_edges_by_hand_are_the_bytes_of_the_general_encoder) {
  test::Random random(7);
  for (int k = 0; k < 20'000; ++k) {
    // All lengths of varints, zeros among them.
    const auto number = [&] { return random.chance(10) ? 0 : random.next() >> random.range(0, 63); };
    symrig_wire_Event event = symrig_wire_Event_init_zero;
    event.which_body = symrig_wire_Event_step_mark_tag;
    event.body.step_mark = {static_cast<std::uint32_t>(number()), static_cast<std::uint32_t>(number()),
                            number()};
    ASSERT_EQ(by_hand(event.body.step_mark), in_general(event));
    event.which_body = symrig_wire_Event_edge_tag;
    event.body.edge = {static_cast<std::uint32_t>(number()), random.chance(50), number()};
    ASSERT_EQ(by_hand(event.body.edge), in_general(event));
  }
}

/// Random bytes either fail or give a message that can be written again and read back as the same.
template <class Message>
void expect_decoder_survives(const Bytes& bytes) {
  Message message;
  if (!decode({bytes.data(), bytes.size()}, message)) return;
  BodyBuffer body{};
  const std::size_t size = encode(message, body);
  Message again;
  RC_ASSERT(decode({body.bytes, size}, again));
  RC_ASSERT(again.which_body == message.which_body);
}

TEST(Messages, random_bodies_never_harm) {
  EXPECT_TRUE(rc::check([](const Bytes& bytes) {
    expect_decoder_survives<symrig_wire_Request>(bytes);
    expect_decoder_survives<symrig_wire_Reply>(bytes);
    expect_decoder_survives<symrig_wire_Event>(bytes);
  }));
}

}  // namespace
}  // namespace symrig::protocol::messages_test
