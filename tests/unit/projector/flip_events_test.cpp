// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/flip_events.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <xf86drm.h>

namespace symrig::projector::drm::test::flip_events_test {
namespace {

/// A pipe in place of a card's file: what is written comes out as the kernel's events do.
class Events : public ::testing::Test {
 protected:
  Events() { EXPECT_EQ(pipe2(ends.data(), O_NONBLOCK | O_CLOEXEC), 0); }
  ~Events() override {
    close(ends[0]);
    if (ends[1] >= 0) close(ends[1]);
  }
  void send(const std::vector<std::byte>& bytes) const {
    ASSERT_EQ(write(ends[1], bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  static std::vector<std::byte> event(std::uint32_t type, std::uint64_t token, std::uint32_t sequence) {
    drm_event_vblank raw{};
    raw.base = {type, sizeof raw};
    raw.user_data = token;
    raw.tv_sec = 5;
    raw.tv_usec = 250'000;
    raw.sequence = sequence;
    std::vector<std::byte> bytes(sizeof raw);
    std::memcpy(bytes.data(), &raw, sizeof raw);
    return bytes;
  }
  Answer<FlipEvent> next(Nanoseconds patience = Nanoseconds{0}) { return events.next(ends[0], patience); }

  std::array<int, 2> ends{-1, -1};
  FlipEvents events;
};

TEST_F(Events, flips_come_out_in_order_with_their_stamps) {
  auto both = event(DRM_EVENT_FLIP_COMPLETE, 7, 41);
  const auto second = event(DRM_EVENT_FLIP_COMPLETE, 8, 42);
  both.insert(both.end(), second.begin(), second.end());
  send(both);
  const auto first = next();
  ASSERT_EQ(first.error, 0);
  EXPECT_EQ(first.value.token, 7U);
  EXPECT_EQ(first.value.sequence, 41U);
  EXPECT_EQ(first.value.stamp.since, Nanoseconds{5'250'000'000});
  EXPECT_EQ(next().value.token, 8U);
  EXPECT_EQ(next().error, ETIMEDOUT);
}

TEST_F(Events, other_kinds_are_passed_over) {
  send(event(DRM_EVENT_VBLANK, 1, 1));
  send(event(DRM_EVENT_FLIP_COMPLETE, 2, 2));
  EXPECT_EQ(next().value.token, 2U);
}

TEST_F(Events, an_event_of_impossible_length_is_an_error_and_not_read_past) {
  for (const std::uint32_t length : {0U, 7U, 4096U}) {
    const drm_event head{DRM_EVENT_FLIP_COMPLETE, length};
    std::vector<std::byte> bytes(sizeof head);
    std::memcpy(bytes.data(), &head, sizeof head);
    send(bytes);
    EXPECT_EQ(next().error, EPROTO) << length;
  }
}

TEST_F(Events, a_file_that_ends_is_a_card_that_is_gone) {
  close(ends[1]);
  ends[1] = -1;
  EXPECT_EQ(next(Nanoseconds{1'000'000'000}).error, ENODEV);
}

}  // namespace
}  // namespace symrig::projector::drm::test::flip_events_test
