// SPDX-License-Identifier: Apache-2.0
// The bytes of the wire, in both directions, against files made by a program that shares no code with ours
// (make_wire_vectors.py).
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/messages.hpp"
#include "symrig/protocol/program.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::protocol::golden_wire_test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Words = std::vector<std::string>;

/// Lines of a vector file as words. Comments are left out.
std::vector<Words> read_vectors(const std::string& file) {
  std::ifstream in(std::string(SYMRIG_GOLDEN_DIR "/wire/") + file);
  EXPECT_TRUE(in.good()) << file;
  std::vector<Words> vectors;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    Words found;
    for (std::string word; words >> word;) found.push_back(word);
    vectors.push_back(found);
  }
  EXPECT_FALSE(vectors.empty()) << file;
  return vectors;
}

Bytes from_hex(const std::string& hex) {
  Bytes bytes;
  if (hex == "-") return bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
  return bytes;
}

ByteView view(const Bytes& bytes) {
  return {bytes.data(), bytes.size()};
}

template <class T>
T number(const std::string& text, int base = 10) {
  return static_cast<T>(std::stoull(text, nullptr, base));
}

TEST(GoldenWire, cobs_encodes_as_the_vectors_say) {
  for (const Words& vector : read_vectors("cobs.txt")) {
    const Bytes plain = from_hex(vector.at(0));
    Bytes out(cobs_bound(plain.size()));
    out.resize(cobs_encode(view(plain), {out.data(), out.size()}));
    EXPECT_EQ(out, from_hex(vector.at(1))) << vector.at(0);
  }
}

TEST(GoldenWire, frames_are_written_as_the_vectors_say) {
  for (const Words& vector : read_vectors("frames.txt")) {
    const FrameHeader header{1,
                             static_cast<Kind>(number<int>(vector.at(1))),
                             number<std::uint16_t>(vector.at(2)),
                             number<std::uint16_t>(vector.at(3)),
                             number<std::uint8_t>(vector.at(4)),
                             number<std::uint8_t>(vector.at(5))};
    const Bytes body = from_hex(vector.at(6));
    Bytes out(kMaxWire, 0xEE);
    out.resize(encode_frame(header, view(body), {out.data(), out.size()}));
    EXPECT_EQ(out, from_hex(vector.at(7))) << vector.at(0);
  }
}

TEST(GoldenWire, frames_are_read_as_the_vectors_say) {
  FrameDecoder decoder;
  for (const Words& vector : read_vectors("frames.txt")) {
    const Bytes wire = from_hex(vector.at(7));
    for (std::size_t i = 0; i + 1 < wire.size(); ++i)
      ASSERT_EQ(decoder.push(wire[i]), FrameDecoder::Event::none) << vector.at(0);
    ASSERT_EQ(decoder.push(wire.back()), FrameDecoder::Event::frame) << vector.at(0);
    const Frame& frame = decoder.frame();
    EXPECT_EQ(frame.header.proto_major, 1);
    EXPECT_EQ(static_cast<int>(frame.header.kind), number<int>(vector.at(1)));
    EXPECT_EQ(frame.header.seq, number<int>(vector.at(2)));
    EXPECT_EQ(frame.header.ack, number<int>(vector.at(3)));
    EXPECT_EQ(frame.header.credit, number<int>(vector.at(4)));
    EXPECT_EQ(frame.header.flags, number<int>(vector.at(5)));
    EXPECT_EQ(Bytes(frame.body.data, frame.body.data + frame.body.size), from_hex(vector.at(6)));
  }
}

template <std::size_t N>
void put_text(std::string_view text, char (&out)[N]) {
  ASSERT_LT(text.size(), N);
  out[text.copy(out, N - 1)] = 0;
}

symrig_wire_Request request(pb_size_t which) {
  symrig_wire_Request message = symrig_wire_Request_init_zero;
  message.which_body = which;
  return message;
}

std::map<std::string, symrig_wire_Request> requests() {
  std::map<std::string, symrig_wire_Request> all;
  all["hello"] = request(symrig_wire_Request_hello_tag);
  all["hello"].body.hello = {1, 0};
  all["capabilities"] = request(symrig_wire_Request_capabilities_tag);
  all["config_line"] = request(symrig_wire_Request_config_line_tag);
  all["config_line"].body.config_line = {2,
                                         symrig_wire_Direction_DIRECTION_OUTPUT,
                                         symrig_wire_LineRole_LINE_ROLE_LAMP_ENABLE,
                                         symrig_wire_Hazard_HAZARD_LAMP,
                                         false,
                                         true,
                                         250'000'000,
                                         125'000,
                                         500,
                                         false};
  all["config_interlock"] = request(symrig_wire_Request_config_line_tag);
  all["config_interlock"].body.config_line = {5,
                                              symrig_wire_Direction_DIRECTION_INPUT,
                                              symrig_wire_LineRole_LINE_ROLE_INTERLOCK,
                                              symrig_wire_Hazard_HAZARD_BENIGN,
                                              false,
                                              false,
                                              0,
                                              0,
                                              0,
                                              true};
  all["finalize_config"] = request(symrig_wire_Request_finalize_config_tag);
  all["finalize_config"].body.finalize_config.hash = 0xDEADBEEF;
  all["program_begin"] = request(symrig_wire_Request_program_begin_tag);
  all["program_begin"].body.program_begin = {7, 1024};
  all["program_commit"] = request(symrig_wire_Request_program_commit_tag);
  all["program_commit"].body.program_commit = {7, 0x01020304};
  all["arm"] = request(symrig_wire_Request_arm_tag);
  all["arm"].body.arm = {0x01020304, 0xDEADBEEF, false};
  all["arm_autonomous"] = request(symrig_wire_Request_arm_tag);
  all["arm_autonomous"].body.arm = {0x01020304, 0xDEADBEEF, true};
  all["start_now"] = request(symrig_wire_Request_start_tag);
  all["start_now"].body.start.which_when = symrig_wire_Start_now_tag;
  all["start_now"].body.start.when.now = true;
  all["start_at"] = request(symrig_wire_Request_start_tag);
  all["start_at"].body.start.which_when = symrig_wire_Start_at_tick_tag;
  all["start_at"].body.start.when.at_tick = std::uint64_t{1} << 40U;
  all["abort"] = request(symrig_wire_Request_abort_tag);
  all["keep_alive"] = request(symrig_wire_Request_keep_alive_tag);
  all["keep_alive"].body.keep_alive.ttl_ms = 1000;
  all["time_ping"] = request(symrig_wire_Request_time_ping_tag);
  all["time_ping"].body.time_ping.host_ns = 123'456'789'012'345;
  all["capabilities_line"] = request(symrig_wire_Request_capabilities_line_tag);
  all["capabilities_line"].body.capabilities_line.line = 31;
  all["identify"] = request(symrig_wire_Request_identify_tag);
  all["identify"].body.identify.seconds = 10;
  all["manual_set"] = request(symrig_wire_Request_manual_set_tag);
  all["manual_set"].body.manual_set = {0x0FFFFFFF, 5};
  all["program_verify"] = request(symrig_wire_Request_program_verify_tag);
  all["program_line"] = request(symrig_wire_Request_program_line_tag);
  all["program_line"].body.program_line.line = 2;
  all["store_config"] = request(symrig_wire_Request_store_config_tag);
  put_text("left rig", all["store_config"].body.store_config.label);
  all["reboot"] = request(symrig_wire_Request_reboot_tag);
  all["reboot"].body.reboot = {0x89ABCDEF, true, false};
  all["starve_watchdog"] = request(symrig_wire_Request_reboot_tag);
  all["starve_watchdog"].body.reboot = {0x89ABCDEF, false, true};
  return all;
}

symrig_wire_Reply hello_reply() {
  symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
  reply.which_body = symrig_wire_Reply_hello_tag;
  symrig_wire_HelloReply& hello = reply.body.hello;
  hello.proto_major = 1;
  hello.schema_hash = 0x11223344;
  put_text("sim", hello.board);
  put_text("0.1.0", hello.firmware_version);
  hello.unique_id.size = 3;
  hello.unique_id.bytes[0] = 1;
  hello.unique_id.bytes[2] = 255;
  hello.firmware_hash = 0x0102030405060708;
  hello.required = 1;
  hello.reset_fault = 5;
  return reply;
}

symrig_wire_Reply status_reply() {
  symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
  reply.which_body = symrig_wire_Reply_status_tag;
  reply.body.status = {symrig_wire_State_STATE_FAULT,
                       0xDEADBEEF,
                       0x01020304,
                       std::uint64_t{1} << 33U,
                       0x1F,
                       true,
                       {symrig_wire_FaultCode_FAULT_MAX_ON, 99, 2},
                       3,
                       12,
                       symrig_wire_ResetCause_RESET_CAUSE_WATCHDOG,
                       true,
                       {symrig_wire_FaultCode_FAULT_WATCHDOG, 0, 0},
                       0xCAFEF00D};
  return reply;
}

symrig_wire_Reply capabilities_reply() {
  symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
  reply.which_body = symrig_wire_Reply_capabilities_tag;
  symrig_wire_CapabilitiesReply& can = reply.body.capabilities;
  can = {125'000'000, 18, 6, 0xFFFFFFFF, 9, 131'072, 4, 512, 8, 256, 1024, 120, 60'000, "", 0};
  put_text("left rig", can.label);
  return reply;
}

symrig_wire_Reply line_reply() {
  symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
  reply.which_body = symrig_wire_Reply_line_tag;
  symrig_wire_LineReply& line = reply.body.line;
  line.line = 15;
  put_text("interlock", line.name);
  put_text("GPIO19", line.pin);
  line.waits = 3;
  line.trips = true;
  line.stamp_ticks = 2;
  return reply;
}

std::map<std::string, symrig_wire_Reply> replies() {
  std::map<std::string, symrig_wire_Reply> all;
  all["ok"] = symrig_wire_Reply_init_zero;
  all["bad_state"] = symrig_wire_Reply_init_zero;
  all["bad_state"].code = symrig_wire_Code_CODE_BAD_STATE;
  all["bad_state"].detail = 5;
  all["bad_value"] = symrig_wire_Reply_init_zero;
  all["bad_value"].code = symrig_wire_Code_CODE_BAD_VALUE;
  all["bad_value"].field = 9;
  all["hello"] = hello_reply();
  all["commit"] = symrig_wire_Reply_init_zero;
  all["commit"].which_body = symrig_wire_Reply_commit_tag;
  all["commit"].body.commit = {0x01020304, 3200, 1000, 2000};
  all["violation"] = symrig_wire_Reply_init_zero;
  all["violation"].code = symrig_wire_Code_CODE_BAD_PROGRAM;
  all["violation"].which_body = symrig_wire_Reply_violation_tag;
  all["violation"].body.violation = {15, 5, 2, 500, 400};
  all["status"] = status_reply();
  all["capabilities"] = capabilities_reply();
  all["line"] = line_reply();
  all["line_use"] = symrig_wire_Reply_init_zero;
  all["line_use"].which_body = symrig_wire_Reply_line_use_tag;
  all["line_use"].body.line_use = {2, 12'500, 333};
  return all;
}

std::map<std::string, symrig_wire_Event> events() {
  const auto event = [](pb_size_t which) {
    symrig_wire_Event message = symrig_wire_Event_init_zero;
    message.which_body = which;
    return message;
  };
  std::map<std::string, symrig_wire_Event> all;
  all["step_mark"] = event(symrig_wire_Event_step_mark_tag);
  all["step_mark"].body.step_mark = {4, 17, 5'000'000'000};
  all["edge"] = event(symrig_wire_Event_edge_tag);
  all["edge"].body.edge = {4, true, 77};
  all["run_done"] = event(symrig_wire_Event_run_done_tag);
  all["run_done"].body.run_done = {symrig_wire_RunEnd_RUN_END_WAIT_TIMEOUT, 300, 200, 9, 0, 1, 3, 2};
  all["events_lost"] = event(symrig_wire_Event_events_lost_tag);
  all["events_lost"].body.events_lost = {12, 345};
  return all;
}

template <class Message>
Bytes bytes_of(const Message& message) {
  BodyBuffer body{};
  const std::size_t size = encode(message, body);
  return {body.bytes, body.bytes + size};
}

/// Checks one group of messages: ours encodes to the vector, and the vector decodes to what encodes to
/// itself.
template <class Message>
void expect_messages(const std::string& group, const std::map<std::string, Message>& ours) {
  std::size_t seen = 0;
  for (const Words& vector : read_vectors("messages.txt")) {
    if (vector.at(0).rfind(group + ".", 0) != 0) continue;
    ++seen;
    const std::string name = vector.at(0).substr(group.size() + 1);
    ASSERT_EQ(ours.count(name), 1U) << name;
    const Bytes expected = from_hex(vector.at(1));
    EXPECT_EQ(bytes_of(ours.at(name)), expected) << vector.at(0);
    Message decoded;
    ASSERT_TRUE(decode(view(expected), decoded)) << vector.at(0);
    EXPECT_EQ(decoded.which_body, ours.at(name).which_body) << vector.at(0);
    EXPECT_EQ(bytes_of(decoded), expected) << vector.at(0);
  }
  EXPECT_EQ(seen, ours.size());
}

TEST(GoldenWire, requests) {
  expect_messages("request", requests());
}
TEST(GoldenWire, replies) {
  expect_messages("reply", replies());
}
TEST(GoldenWire, events) {
  expect_messages("event", events());
}

TEST(GoldenWire, decoded_fields_are_those_that_were_written) {
  for (const Words& vector : read_vectors("messages.txt")) {
    if (vector.at(0) != "reply.status") continue;
    symrig_wire_Reply reply;
    ASSERT_TRUE(decode(view(from_hex(vector.at(1))), reply));
    const symrig_wire_StatusReply& status = reply.body.status;
    EXPECT_EQ(raw(status.state), 7U);
    EXPECT_EQ(status.config_hash, 0xDEADBEEFU);
    EXPECT_EQ(status.program_hash, 0x01020304U);
    EXPECT_EQ(status.tick, std::uint64_t{1} << 33U);
    EXPECT_EQ(status.levels, 0x1FU);
    EXPECT_TRUE(status.has_fault);
    EXPECT_EQ(raw(status.fault.code), 2U);
    EXPECT_EQ(status.fault.tick, 99U);
    EXPECT_EQ(status.fault.arg, 2U);
    EXPECT_EQ(status.bad_frames, 3U);
    EXPECT_EQ(status.steps, 12U);
    return;
  }
  FAIL() << "no vector reply.status";
}

std::map<std::string, std::vector<Record>> programs() {
  const WaitEdge vsync{3, WaitFor::rising, true};
  return {
      {"bracket",
       {make_record(Op::mark, 0, 0), make_record(Op::set_word, 1, 12500), make_record(Op::set_word, 0, 5),
        make_wait(vsync, 6'250'000), make_loop(3), make_record(Op::mark, 1, 0),
        make_record(Op::set_word, 2, 12500), make_record(Op::set_word, 0, 500'000),
        make_record(Op::end_loop, 0, 0), make_record(Op::end, 0, 0)}},
      {"extremes",
       {make_record(Op::set_word, kMaxArg, 0xFFFFFFFF), make_loop(kMaxRounds),
        make_record(Op::set_word, 0, 1), make_record(Op::end_loop, 0, 0), make_record(Op::end, kMaxArg, 0)}}};
}

TEST(GoldenWire, programs_are_packed_as_the_vectors_say) {
  const auto ours = programs();
  for (const Words& vector : read_vectors("programs.txt")) {
    const Bytes expected = from_hex(vector.at(1));
    Bytes packed;
    for (const Record& record : ours.at(vector.at(0))) {
      packed.resize(packed.size() + kRecordSize);
      put_record(record, packed.data() + packed.size() - kRecordSize);
    }
    EXPECT_EQ(packed, expected) << vector.at(0);
    EXPECT_EQ(crc32c(view(expected)), number<std::uint32_t>(vector.at(2), 16)) << vector.at(0);
    const ProgramView program{view(expected)};
    for (std::uint32_t i = 0; i < program.size(); ++i) {
      const Record& wanted = ours.at(vector.at(0)).at(i);
      EXPECT_EQ(program[i].op, wanted.op);
      EXPECT_EQ(program[i].arg, wanted.arg);
      EXPECT_EQ(program[i].ticks, wanted.ticks);
    }
  }
}

TEST(GoldenWire, configurations_hash_as_the_vectors_say) {
  std::map<std::string, BoardConfig> ours;
  for (unsigned k = 0; k < 5; ++k) {
    LineConfig& line = ours["default_board"].lines[k];
    line.configured = true;
    line.output = k < 3;
    line.role = static_cast<std::uint8_t>(k + 1);
  }
  ours["lamp"].lines[2] = {true, true, 3, 1, true, true, 125'000'000, std::uint64_t{1} << 40U, 250, false};
  ours["interlock"].lines[5].configured = true;
  ours["interlock"].lines[5].role = 6;
  ours["interlock"].lines[5].trip_level = true;
  for (const Words& vector : read_vectors("configs.txt"))
    EXPECT_EQ(config_hash(ours.at(vector.at(0))), number<std::uint32_t>(vector.at(1), 16)) << vector.at(0);
}

TEST(GoldenWire, chunks_are_written_and_read_as_the_vectors_say) {
  for (const Words& vector : read_vectors("chunks.txt")) {
    const Bytes data = from_hex(vector.at(2));
    const Bytes expected = from_hex(vector.at(3));
    const auto id = number<std::uint32_t>(vector.at(0));
    const auto offset = number<std::uint32_t>(vector.at(1));
    Bytes out(kMaxBody);
    out.resize(encode_chunk({id, offset, view(data)}, {out.data(), out.size()}));
    EXPECT_EQ(out, expected);
    DataChunk chunk;
    ASSERT_TRUE(decode_chunk(view(expected), chunk));
    EXPECT_EQ(chunk.program_id, id);
    EXPECT_EQ(chunk.offset, offset);
    EXPECT_EQ(Bytes(chunk.bytes.data, chunk.bytes.data + chunk.bytes.size), data);
  }
}

}  // namespace
}  // namespace symrig::protocol::golden_wire_test
