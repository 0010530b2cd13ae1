// SPDX-License-Identifier: Apache-2.0
// The bytes of the USB3 Vision camera, written by hand from the registers and packets that Aravis and
// Wireshark read. With it, tests on a kernel show that Aravis agrees.
#include "u3v/u3v_camera.hpp"

#include "gige/gige_camera.hpp"

#include <gtest/gtest.h>

namespace symrig::u3v_camera_test {
namespace {

using namespace std::chrono_literals;
using Bytes = test::UsbDevice::Bytes;
using u3v::U3vCamera;

constexpr std::size_t kMost = 1U << 20U;

/// A command: magic, flags, number, length, id 7, and its body.
Bytes command(std::uint8_t number, const Bytes& body) {
  Bytes bytes{'U', '3', 'V', 'C', 0x00, 0x40, number, 0x08, static_cast<std::uint8_t>(body.size()), 0, 7, 0};
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

Bytes read_command(std::uint32_t at, std::uint16_t count) {
  return command(0, {static_cast<std::uint8_t>(at), static_cast<std::uint8_t>(at >> 8U),
                     static_cast<std::uint8_t>(at >> 16U), 0, 0, 0, 0, 0, 0, 0,
                     static_cast<std::uint8_t>(count), static_cast<std::uint8_t>(count >> 8U)});
}

Bytes write_command(std::uint32_t at, std::uint32_t value) {
  Bytes body{static_cast<std::uint8_t>(at),
             static_cast<std::uint8_t>(at >> 8U),
             static_cast<std::uint8_t>(at >> 16U),
             0,
             0,
             0,
             0,
             0};
  for (const unsigned shift : {0U, 8U, 16U, 24U}) body.push_back(static_cast<std::uint8_t>(value >> shift));
  return command(2, body);
}

/// The answer to a command. Empty: none.
Bytes answer(U3vCamera& camera, const Bytes& asked) {
  EXPECT_TRUE(camera.out(1, asked));
  return camera.in(1, kMost).value_or(Bytes{});
}

/// The head of an answer: magic, status, number, length, id 7.
Bytes head(std::uint16_t status, std::uint8_t number, std::uint8_t length) {
  return {'U',
          '3',
          'V',
          'C',
          static_cast<std::uint8_t>(status),
          static_cast<std::uint8_t>(status >> 8U),
          number,
          0x08,
          length,
          0,
          7,
          0};
}

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// A camera of 16 x 8 pixels in Mono8 that waits for its line.
struct Armed {
  U3vCamera camera;

  explicit Armed(bool chunks = false) : camera(traits(chunks), gige::numbered_scene, "U1") {
    for (const auto& [at, value] :
         std::initializer_list<std::pair<std::uint32_t, std::uint32_t>>{{0x10020, 1},
                                                                        {0x10024, 1},
                                                                        {0x1002C, 1},
                                                                        {0x10018, 1},
                                                                        {0x201C, 100},
                                                                        {0x2020, 1},
                                                                        {0x2024, 28},
                                                                        {0x2004, 1}})
      answer(camera, write_command(at, value));
  }
  static gige::CameraTraits traits(bool chunks) {
    gige::CameraTraits traits;
    traits.rows = 8;
    traits.cols = 16;
    traits.has_chunks = chunks;
    return traits;
  }
};

TEST(U3vCamera, registers_are_read_as_they_lie) {
  U3vCamera camera(Armed::traits(false), gige::numbered_scene, "U1");
  EXPECT_EQ(answer(camera, read_command(0x04, 7)), head(0, 1, 7) + Bytes({'S', 'y', 'm', 'r', 'i', 'g', 0}));
  EXPECT_EQ(answer(camera, read_command(0x1D8, 8)), head(0, 1, 8) + Bytes({0x00, 0x10, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(answer(camera, read_command(0x1020, 8)), head(0, 1, 8) + Bytes({0x00, 0x20, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(answer(camera, read_command(0x2008, 8)), head(0, 1, 8) + Bytes({128, 0, 0, 0, 0, 0, 0, 0}))
      << "bytes of a frame";
  EXPECT_EQ(answer(camera, read_command(0x20000, 5)), head(0, 1, 5) + Bytes({'<', '?', 'x', 'm', 'l'}));
}

TEST(U3vCamera, a_written_register_is_acknowledged_and_has_its_value) {
  U3vCamera camera(Armed::traits(false), gige::numbered_scene, "U1");
  EXPECT_EQ(answer(camera, write_command(0x10010, 0x01100007)), head(0, 3, 4) + Bytes({0, 0, 4, 0}));
  EXPECT_EQ(camera.reg(0x10010), 0x01100007U);
  EXPECT_EQ(camera.reg(0x10050), 256U) << "PayloadSize follows the format";
  EXPECT_EQ(camera.reg(0x2008), 256U);
}

TEST(U3vCamera, what_it_cannot_do_has_a_status_and_changes_nothing) {
  U3vCamera camera(Armed::traits(false), gige::numbered_scene, "U1");
  EXPECT_EQ(answer(camera, read_command(0x1FFFE, 4)), head(0x8003, 1, 0)) << "across the end";
  EXPECT_EQ(answer(camera, read_command(0xFFFFFF, 4)), head(0x8003, 1, 0));
  EXPECT_EQ(answer(camera, read_command(0, 1013)), head(0x8002, 1, 0)) << "longer than an answer may be";
  EXPECT_EQ(answer(camera, write_command(0x04, 0)), head(0x8004, 3, 4) + Bytes({0, 0, 0, 0}));
  EXPECT_EQ(answer(camera, write_command(0x20000, 0)), head(0x8003, 3, 4) + Bytes({0, 0, 0, 0}));
  EXPECT_EQ(answer(camera, command(0x10, {})), head(0x8001, 0x11, 0));
  EXPECT_EQ(answer(camera, read_command(0x04, 1)), head(0, 1, 1) + Bytes({'S'}));
  Bytes cut = read_command(0x04, 1);
  cut.pop_back();
  EXPECT_EQ(answer(camera, cut), Bytes{}) << "cut short";
  EXPECT_EQ(answer(camera, {}), Bytes{});
}

TEST(U3vCamera, a_frame_is_a_leader_the_hosts_transfers_and_a_trailer) {
  Armed armed;
  U3vCamera& camera = armed.camera;
  EXPECT_EQ(camera.in(2, kMost), std::nullopt);
  ASSERT_TRUE(camera.pulse(3ms, gige::Mishap::frame_dropped));
  ASSERT_TRUE(camera.pulse(5ms));
  const Bytes leader = camera.in(2, kMost).value_or(Bytes{});
  ASSERT_EQ(leader.size(), 52U);
  EXPECT_EQ(Bytes(leader.begin(), leader.begin() + 20),
            Bytes({'U', '3', 'V', 'L', 0, 0, 52, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0}))
      << "the lost frame was number 0";
  EXPECT_EQ(Bytes(leader.begin() + 28, leader.end()),
            Bytes({1, 0, 8, 1, 16, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
  const Bytes part = camera.in(2, 60).value_or(Bytes{});
  const Bytes rest = camera.in(2, kMost).value_or(Bytes{}), last = camera.in(2, kMost).value_or(Bytes{});
  EXPECT_EQ(part.size(), 60U) << "a read that is shorter than the transfer";
  EXPECT_EQ(rest.size(), 40U);
  EXPECT_EQ(last.size(), 28U);
  const Bytes all = part + rest + last;
  gige::Shot shot;
  shot.counter = 2;
  shot.exposure = 5ms;
  for (std::size_t k = 0; k < all.size(); ++k) ASSERT_EQ(all[k], gige::numbered_code(shot, k) >> 8U) << k;
  EXPECT_EQ(camera.in(2, kMost), Bytes({'U', '3', 'V', 'T', 0,   0, 32, 0, 1, 0, 0, 0, 0, 0, 0, 0,
                                        0,   0,   0,   0,   128, 0, 0,  0, 0, 0, 0, 0, 8, 0, 0, 0}));
  EXPECT_EQ(camera.in(2, kMost), std::nullopt);
}

TEST(U3vCamera, chunks_lie_behind_the_picture) {
  Armed armed(true);
  U3vCamera& camera = armed.camera;
  for (const auto& [at, value] : std::initializer_list<std::pair<std::uint32_t, std::uint32_t>>{
           {0x10040, 1}, {0x10044, 0}, {0x10048, 1}, {0x2024, 0}, {0x201C, 148}})
    answer(camera, write_command(at, value));
  EXPECT_EQ(camera.reg(0x10050), 128U + 8 + 12);
  ASSERT_TRUE(camera.pulse(5ms));
  const Bytes leader = camera.in(2, kMost).value_or(Bytes{}), data = camera.in(2, kMost).value_or(Bytes{});
  ASSERT_EQ(leader.size(), 52U);
  EXPECT_EQ(leader[18] | leader[19] << 8, 0x4001);
  ASSERT_EQ(data.size(), 148U);
  EXPECT_EQ(Bytes(data.begin() + 128, data.end()),
            Bytes({0, 0xC0, 0, 0, 128, 0, 0, 0, 1, 0, 0, 0, 1, 0xC0, 0, 0, 4, 0, 0, 0}));
}

/// The trigger whose picture begins with these bytes. Trigger k exposed for k ms. 0: none.
std::uint32_t trigger_of(const Bytes& data) {
  for (std::uint32_t trigger = 1; trigger < 10; ++trigger) {
    gige::Shot shot;
    shot.counter = trigger;
    shot.exposure = trigger * 1ms;
    std::size_t k = 0;
    while (k < data.size() && data[k] == gige::numbered_code(shot, k) >> 8U) ++k;
    if (k == data.size()) return trigger;
  }
  return 0;
}

using Sent = std::vector<std::pair<std::uint32_t, std::chrono::nanoseconds>>;

/// Trigger and stamp of each frame that waits, in the order of delivery.
Sent sent_by(U3vCamera& camera) {
  constexpr std::size_t kLeader = 52, kStamp = 20;
  Sent all;
  while (const auto part = camera.in(2, kMost)) {
    if (part->size() != kLeader) continue;
    std::int64_t stamp = 0;
    for (std::size_t k = 8; k-- > 0;) stamp = stamp << 8U | (*part)[kStamp + k];
    all.emplace_back(trigger_of(camera.in(2, kMost).value_or(Bytes{})), stamp);
  }
  return all;
}

// A frame that is late or swapped keeps its picture and its stamp.
TEST(U3vCamera, late_and_swapped_frames_come_with_the_next_one) {
  using gige::Mishap;
  Armed armed;
  U3vCamera& camera = armed.camera;
  ASSERT_TRUE(camera.pulse(1ms, Mishap::late, 1s));
  EXPECT_EQ(sent_by(camera), Sent{});
  ASSERT_TRUE(camera.pulse(2ms, Mishap::swapped, 2s));
  EXPECT_EQ(sent_by(camera), (Sent{{1, 1s}}));
  ASSERT_TRUE(camera.pulse(3ms, Mishap::none, 3s));
  EXPECT_EQ(sent_by(camera), (Sent{{3, 3s}, {2, 2s}}));
  EXPECT_FALSE(camera.pulse(9ms, Mishap::trigger_dropped));
  ASSERT_TRUE(camera.pulse(4ms, Mishap::late, 4s));
  ASSERT_TRUE(camera.pulse(5ms, Mishap::frame_dropped));
  EXPECT_EQ(sent_by(camera), (Sent{{4, 4s}}));
}

TEST(U3vCamera, exposes_only_while_it_is_armed_and_its_stream_is_on) {
  U3vCamera idle(Armed::traits(false), gige::numbered_scene, "U1");
  EXPECT_FALSE(idle.pulse(1ms));
  Armed armed;
  ASSERT_TRUE(armed.camera.pulse(1ms));
  answer(armed.camera, write_command(0x2004, 0));
  EXPECT_FALSE(armed.camera.pulse(1ms));
  EXPECT_EQ(armed.camera.in(2, kMost), std::nullopt) << "the stream's end takes what waited";
}

TEST(U3vCamera, its_configuration_is_consistent) {
  const test::UsbDescription described = u3v::u3v_description("U1");
  const Bytes& all = described.configuration;
  ASSERT_GE(all.size(), 9U);
  EXPECT_EQ(all[2] | all[3] << 8, static_cast<int>(all.size()));
  Bytes classes;
  int endpoints = 0, stated = 0;
  std::size_t at = 0;
  while (at < all.size()) {
    const std::size_t length = all[at];
    ASSERT_GE(length, 2U);
    ASSERT_LE(at + length, all.size());
    if (all[at + 1] == 4) {
      classes.insert(classes.end(), {all[at + 5], all[at + 6], all[at + 7]});
      stated += all[at + 4];
    }
    if (all[at + 1] == 5) {
      ++endpoints;
      EXPECT_EQ(all[at + length + 1], 0x30) << "each endpoint of SuperSpeed has a companion";
    }
    at += length;
  }
  EXPECT_EQ(classes, described.interface_classes);
  EXPECT_EQ(classes.size(), all[4] * std::size_t{3});
  EXPECT_EQ(endpoints, stated);
  EXPECT_EQ(described.device.size(), 18U);
  const Bytes& bos = described.others.at(0x0F);
  EXPECT_EQ(bos[2], bos.size());
}

}  // namespace
}  // namespace symrig::u3v_camera_test
