// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/link.hpp"

#include <array>
#include <cstdint>

#include <gtest/gtest.h>

namespace symrig::firmware::event_queue_test {
namespace {

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
}  // namespace symrig::firmware::event_queue_test
