// SPDX-License-Identifier: Apache-2.0
// The rules of PROTOCOL.md, "Sequence", one by one, and then under noise.
#include "symrig/firmware/link.hpp"

#include "raw_host.hpp"
#include "unit/protocol/random_program.hpp"

#include <array>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::firmware::link_test {
namespace {

using protocol::Kind;
using test::RawHost;
namespace flag = protocol::flag;

struct Bench {
  board_sim::SimBoard board;
  RawHost host{board};
};

/// Sends one frame and takes the answers.
void exchange(RawHost& host, Kind kind, std::uint16_t seq, std::uint8_t flags,
              const std::vector<std::uint8_t>& body) {
  host.listen();
  host.frames.clear();
  host.send(kind, seq, flags, body);
  host.listen();
}

std::vector<std::uint8_t> status_request() {
  return RawHost::bytes_of(RawHost::make(symrig_wire_Request_get_status_tag));
}

TEST(Link, nothing_is_done_before_hello) {
  Bench bench;
  exchange(bench.host, Kind::request, 1, 0, status_request());
  ASSERT_EQ(bench.host.frames.size(), 1U);
  EXPECT_EQ(bench.host.frames[0].header.kind, Kind::nak);
}

TEST(Link, only_hello_begins_a_session) {
  Bench bench;
  exchange(bench.host, Kind::request, 1, flag::sync, status_request());
  EXPECT_TRUE(bench.host.frames.empty());
  exchange(bench.host, Kind::request, 2, 0, status_request());
  ASSERT_EQ(bench.host.frames.size(), 1U);
  EXPECT_EQ(bench.host.frames[0].header.kind, Kind::nak);
}

TEST(Link, a_session_begins_at_any_number) {
  Bench bench;
  bench.host.seq = 0xFFFF;
  ASSERT_TRUE(bench.host.hello().has_value());
  EXPECT_EQ(bench.host.frames[0].header.ack, 0);
  EXPECT_TRUE(bench.host.ask_bytes(status_request()).has_value());
  EXPECT_EQ(bench.host.frames[0].header.ack, 1);
}

TEST(Link, a_repeated_request_is_answered_from_memory) {
  Bench bench;
  bench.host.hello();
  // A clock reading tells a second execution from a repeated answer.
  const auto body = RawHost::bytes_of([] {
    symrig_wire_Request request = RawHost::make(symrig_wire_Request_time_ping_tag);
    request.body.time_ping.host_ns = 42;
    return request;
  }());
  const std::uint16_t seq = bench.host.seq;
  const auto first = bench.host.ask_bytes(body);
  ASSERT_TRUE(first.has_value());
  bench.board.advance_to(bench.board.now() + 12'345);
  exchange(bench.host, Kind::request, seq, 0, body);
  const auto second = bench.host.last_reply();
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(second->body.time.rx_tick, first->body.time.rx_tick);  // the old answer, not a new one
}

TEST(Link, a_request_from_the_future_is_not_carried_out) {
  Bench bench;
  bench.host.hello();
  const std::uint16_t next = bench.host.seq;
  exchange(bench.host, Kind::request, static_cast<std::uint16_t>(next + 1), 0, status_request());
  ASSERT_EQ(bench.host.frames.size(), 1U);
  EXPECT_EQ(bench.host.frames[0].header.kind, Kind::nak);
  EXPECT_EQ(bench.host.frames[0].header.ack, next);
}

TEST(Link, a_request_from_the_past_is_acknowledged_and_forgotten) {
  Bench bench;
  bench.host.hello();
  for (int k = 0; k < 3; ++k) bench.host.ask_bytes(status_request());
  exchange(bench.host, Kind::request, static_cast<std::uint16_t>(bench.host.seq - 3), 0, status_request());
  ASSERT_EQ(bench.host.frames.size(), 1U);
  EXPECT_EQ(bench.host.frames[0].header.kind, Kind::ack);
  EXPECT_EQ(bench.host.frames[0].header.ack, bench.host.seq);
}

TEST(Link, a_bad_body_with_a_good_crc_is_answered_and_harms_nothing) {
  Bench bench;
  bench.host.hello();
  const auto reply = bench.host.ask_bytes({0xFF, 0xFF, 0xFF});
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->code, symrig_wire_Code_CODE_DECODE);
  const auto empty = bench.host.ask_bytes({});
  ASSERT_TRUE(empty.has_value());
  EXPECT_EQ(empty->code, symrig_wire_Code_CODE_UNKNOWN_REQUEST);
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_SAFE);
}

TEST(Link, only_abort_is_urgent_and_it_works_without_a_session) {
  Bench bench;
  const auto reply = bench.host.ask_bytes(status_request(), flag::urgent);
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->code, symrig_wire_Code_CODE_NOT_URGENT);
  exchange(bench.host, Kind::request, 0x4242, flag::urgent,
           RawHost::bytes_of(RawHost::make(symrig_wire_Request_abort_tag)));
  ASSERT_EQ(bench.host.frames.size(), 1U);
  EXPECT_EQ(bench.host.frames[0].header.ack, 0x4242);
  EXPECT_EQ(bench.host.frames[0].header.flags, flag::urgent);
}

TEST(Link, another_major_version_is_told_so_but_may_say_hello) {
  Bench bench;
  ASSERT_TRUE(bench.host.hello().has_value());
  std::vector<std::uint8_t> wire(protocol::kMaxWire);
  const auto body = status_request();
  wire.resize(protocol::encode_frame({2, Kind::request, bench.host.seq, 0, 8, 0}, {body.data(), body.size()},
                                     {wire.data(), wire.size()}));
  bench.host.frames.clear();
  bench.board.write(wire);
  bench.host.listen();
  const auto reply = bench.host.last_reply();
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->code, symrig_wire_Code_CODE_VERSION);
}

TEST(Link, chunks_out_of_place_make_the_commit_fail) {
  Bench bench;
  bench.host.hello();
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  ASSERT_EQ(bench.host.begin(7, 16), 0U);
  bench.host.chunk(7, 8, std::vector<std::uint8_t>(8));
  ASSERT_TRUE(bench.host.last_reply().has_value());
  EXPECT_EQ(bench.host.last_reply()->code, symrig_wire_Code_CODE_BAD_CHUNK);
  EXPECT_EQ(bench.host.last_reply()->detail, 0U);
  bench.host.chunk(7, 0, std::vector<std::uint8_t>(16));
  EXPECT_EQ(bench.host.commit(7, 0), symrig_wire_Code_CODE_INCOMPLETE);
}

TEST(Link, events_not_acknowledged_are_sent_again) {
  Bench bench;
  bench.host.hello();
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  const std::vector<protocol::Record> records{protocol::make_record(protocol::Op::mark, 5, 0),
                                              protocol::make_record(protocol::Op::set_word, 1, 1000),
                                              protocol::make_record(protocol::Op::end, 0, 0)};
  std::vector<std::uint8_t> program;
  for (const auto& record : records) test::pack(record, program);
  ASSERT_EQ(bench.host.upload(program), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  ASSERT_EQ(bench.host.start(), 0U);
  bench.board.advance_to(bench.board.now() + 10'000);
  bench.board.read();  // the first copies are lost
  bench.board.advance_to(bench.board.now() + 125'000'000 / 20);
  bench.host.listen();
  EXPECT_TRUE(bench.host.done());
  EXPECT_EQ(bench.host.last(symrig_wire_Event_step_mark_tag)->body.step_mark.id, 5U);
}

TEST(Link, no_more_events_are_in_flight_than_the_host_has_credit) {
  Bench bench;
  bench.host.credit = 3;
  bench.host.hello();
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  std::vector<std::uint8_t> program;
  for (std::uint32_t k = 0; k < 10; ++k) {
    test::pack(protocol::make_record(protocol::Op::mark, k, 0), program);
    test::pack(protocol::make_record(protocol::Op::set_word, 1, 100), program);
  }
  test::pack(protocol::make_record(protocol::Op::end, 0, 0), program);
  ASSERT_EQ(bench.host.upload(program), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  ASSERT_EQ(bench.host.start(), 0U);
  bench.board.advance_to(bench.board.now() + 10'000);
  bench.host.listen();
  EXPECT_EQ(bench.host.events.size(), 3U);
  exchange(bench.host, Kind::ack, bench.host.seq, 0, {});
  EXPECT_EQ(bench.host.events.size(), 6U);
}

TEST(Link, random_bytes_never_harm_and_a_session_can_begin_after_them) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    test::Random random(seed);
    Bench bench;
    std::vector<std::uint8_t> noise(random.range(0, 3000));
    for (std::uint8_t& byte : noise) byte = random.chance(10) ? 0 : static_cast<std::uint8_t>(random.next());
    bench.board.write(noise);
    bench.board.write(std::vector<std::uint8_t>{0});
    bench.board.read();
    ASSERT_TRUE(bench.host.hello().has_value()) << seed;
    EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_SAFE);
  }
}

TEST(Link, half_a_frame_is_forgotten_when_the_cable_is_pulled) {
  board_sim::SimBoard board;
  RawHost host(board);
  const std::vector<std::uint8_t> half{9, 1, 1, 7, 7};
  board.write(half);
  board.set_attached(false);
  board.advance();
  board.set_attached(true);
  EXPECT_TRUE(host.hello());
}

symrig_wire_Event mark(std::uint32_t id) {
  symrig_wire_Event event = symrig_wire_Event_init_zero;
  event.which_body = symrig_wire_Event_step_mark_tag;
  event.body.step_mark = {id, id, id};
  return event;
}

struct Queue {
  std::array<symrig_wire_Event, 8> slots{};
  EventQueue events{slots.data(), 8};
};

TEST(EventQueue, keeps_events_until_they_are_acknowledged) {
  Queue q;
  for (std::uint32_t id = 0; id < 4; ++id) q.events.push(mark(id), id);
  for (std::uint32_t id = 0; id < 4; ++id) {
    EXPECT_EQ(q.events.unsent().body.step_mark.id, id);
    q.events.mark_sent();
  }
  EXPECT_FALSE(q.events.has_unsent());
  EXPECT_EQ(q.events.in_flight(), 4);
  EXPECT_TRUE(q.events.acknowledge(2));
  q.events.rewind();
  ASSERT_TRUE(q.events.has_unsent());
  EXPECT_EQ(q.events.unsent().body.step_mark.id, 2U);
}

TEST(EventQueue, an_acknowledgement_of_what_was_never_sent_is_ignored) {
  Queue q;
  q.events.push(mark(1), 1);
  EXPECT_FALSE(q.events.acknowledge(1));
  q.events.mark_sent();
  EXPECT_FALSE(q.events.acknowledge(2));
  EXPECT_FALSE(q.events.acknowledge(0xFFFF));
  EXPECT_TRUE(q.events.acknowledge(1));
}

TEST(EventQueue, an_acknowledgement_that_comes_after_a_rewind_counts) {
  Queue q;
  q.events.push(mark(1), 1);
  q.events.push(mark(2), 2);
  q.events.mark_sent();
  q.events.mark_sent();
  q.events.rewind();
  EXPECT_TRUE(q.events.acknowledge(2));
  EXPECT_FALSE(q.events.has_unsent());
  EXPECT_EQ(q.events.in_flight(), 0);
}

TEST(EventQueue, what_finds_no_room_is_counted_and_told) {
  Queue q;
  for (std::uint32_t id = 0; id < 10; ++id) q.events.push(mark(id), 100 + id);
  EXPECT_EQ(q.events.lost(), 6U);  // 8 slots, 4 of them kept for important events
  q.events.push_important(mark(77), 200);
  for (std::uint32_t id = 0; id < 4; ++id) {
    EXPECT_EQ(q.events.unsent().body.step_mark.id, id);
    q.events.mark_sent();
  }
  ASSERT_EQ(q.events.unsent().which_body, symrig_wire_Event_events_lost_tag);
  EXPECT_EQ(q.events.unsent().body.events_lost.count, 6U);
  EXPECT_EQ(q.events.unsent().body.events_lost.tick, 104U);
  q.events.mark_sent();
  EXPECT_EQ(q.events.unsent().body.step_mark.id, 77U);
}

TEST(EventQueue, numbers_go_round_the_circle) {
  Queue q;
  std::uint16_t next = 0;
  for (std::uint32_t id = 0; id < 70'000; ++id) {
    q.events.push(mark(id), id);
    ASSERT_TRUE(q.events.has_unsent());
    ASSERT_EQ(q.events.unsent().body.step_mark.id, id);
    ASSERT_EQ(q.events.next_to_send(), next);
    q.events.mark_sent();
    ASSERT_TRUE(q.events.acknowledge(++next));
  }
  EXPECT_EQ(q.events.lost(), 0U);
}

}  // namespace
}  // namespace symrig::firmware::link_test
