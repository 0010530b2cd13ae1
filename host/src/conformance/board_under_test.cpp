// SPDX-License-Identifier: Apache-2.0
#include "conformance/board_under_test.hpp"

#include "symrig/protocol/messages.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::conformance {

using namespace std::chrono_literals;
using protocol::raw;

Verdict BoardUnderTest::meet() {
  const auto hello = session.hello();
  if (!hello || hello->which_body != symrig_wire_Reply_hello_tag) return failed("no board answers hello");
  who = hello->body.hello;
  const auto answer = session.ask(make_request(symrig_wire_Request_capabilities_tag));
  if (!answer || answer->which_body != symrig_wire_Reply_capabilities_tag)
    return failed("the board does not answer capabilities");
  can = answer->body.capabilities;
  for (std::uint32_t k = 0; k < std::min(can.lines, protocol::kMaxLines); ++k) {
    symrig_wire_Request request = make_request(symrig_wire_Request_capabilities_line_tag);
    request.body.capabilities_line.line = k;
    const auto line = session.ask(request);
    if (!line || line->which_body != symrig_wire_Reply_line_tag)
      return failed(fmt::format("the board does not answer capabilities_line {}", k));
    lines.push_back(line->body.line);
  }
  return that(can.tick_hz >= 1000 && !outputs().empty(),
              "the board has a clock of at least 1 kHz and an output");
}

Verdict BoardUnderTest::start_afresh() {
  session.credit = 64;
  session.acknowledges = true;
  if (!session.hello()) return failed("no board answers hello");
  abort();
  const auto before = status();
  if (!before) return failed("no answer to get_status");
  if (raw(before->state) == symrig_wire_State_STATE_FAULT)
    SYMRIG_MUST(code_is("clear_fault", symrig_wire_Code_CODE_OK, clear_fault(raw(before->fault.code))));
  SYMRIG_MUST(code_is("reset_config", symrig_wire_Code_CODE_OK, code(symrig_wire_Request_reset_config_tag)));
  SYMRIG_MUST(code_is("keep_alive 0", symrig_wire_Code_CODE_OK, keep_alive(0)));
  plain_config();
  session.listen_for(Nanoseconds(1'000'000));  // receives events of the aborted run
  session.forget();
  return in_state(symrig_wire_State_STATE_SAFE);
}

void BoardUnderTest::leave_safe() {
  session.acknowledges = true;
  if (!session.hello()) return abort();
  abort();
  const auto now = status();
  if (now && raw(now->state) == symrig_wire_State_STATE_FAULT) clear_fault(raw(now->fault.code));
  code(symrig_wire_Request_reset_config_tag);
  keep_alive(0);
}

std::vector<std::uint32_t> BoardUnderTest::outputs() const {
  std::vector<std::uint32_t> found;
  for (const symrig_wire_LineReply& line : lines)
    if (raw(line.direction) == symrig_wire_Direction_DIRECTION_OUTPUT) found.push_back(line.line);
  return found;
}

std::vector<std::uint32_t> BoardUnderTest::inputs() const {
  std::vector<std::uint32_t> found;
  for (const symrig_wire_LineReply& line : lines)
    if (raw(line.direction) == symrig_wire_Direction_DIRECTION_INPUT) found.push_back(line.line);
  return found;
}

std::optional<std::uint32_t> BoardUnderTest::seen_output() const {
  for (const std::uint32_t line : outputs())
    if (lines[line].stamp_ticks != 0) return line;
  return std::nullopt;
}

std::uint32_t BoardUnderTest::word() const {
  const std::uint64_t fed = 4 * std::uint64_t{can.refill_ticks} + can.min_dwell;
  return static_cast<std::uint32_t>(std::max(fed, ticks(200us)));
}

protocol::ProgramRules BoardUnderTest::rules() const {
  protocol::ProgramRules rules;
  rules.config = &config;
  rules.min_dwell = can.min_dwell;
  rules.max_dwell = can.max_dwell;
  rules.wait_latency = can.wait_latency;
  rules.max_bytes = can.program_bytes;
  rules.loop_depth = can.loop_depth;
  for (const symrig_wire_LineReply& line : lines)
    rules.no_waits[line.line] = static_cast<std::uint8_t>(~line.waits & 7U);
  rules.queue_segments = can.queue_segments;
  rules.refill_ticks = can.refill_ticks;
  rules.poll_ticks = can.poll_ticks;
  return rules;
}

std::uint32_t BoardUnderTest::config_line(std::uint32_t line) {
  const protocol::LineConfig& wanted = config.lines[line];
  symrig_wire_Request request = make_request(symrig_wire_Request_config_line_tag);
  request.body.config_line = {
      line,
      wanted.output ? symrig_wire_Direction_DIRECTION_OUTPUT : symrig_wire_Direction_DIRECTION_INPUT,
      static_cast<symrig_wire_LineRole>(wanted.role),
      static_cast<symrig_wire_Hazard>(wanted.hazard),
      wanted.safe_level,
      wanted.capture,
      wanted.max_on,
      wanted.min_off,
      wanted.max_duty_permille,
      wanted.trip_level};
  return session.code(request);
}

std::uint32_t BoardUnderTest::finalize() {
  config_hash = protocol::config_hash(config);
  symrig_wire_Request request = make_request(symrig_wire_Request_finalize_config_tag);
  request.body.finalize_config.hash = config_hash;
  return session.code(request);
}

std::uint32_t BoardUnderTest::program_begin(std::uint32_t length) {
  symrig_wire_Request request = make_request(symrig_wire_Request_program_begin_tag);
  request.body.program_begin = {++program_id, length};
  return session.code(request);
}

std::uint32_t BoardUnderTest::commit(std::uint32_t crc) {
  symrig_wire_Request request = make_request(symrig_wire_Request_program_commit_tag);
  request.body.program_commit = {program_id, crc};
  return session.code(request);
}

std::uint32_t BoardUnderTest::arm(bool autonomous) {
  symrig_wire_Request request = make_request(symrig_wire_Request_arm_tag);
  request.body.arm = {program_hash, config_hash, autonomous};
  return session.code(request);
}

std::uint32_t BoardUnderTest::start_at(std::uint64_t tick) {
  symrig_wire_Request request = make_request(symrig_wire_Request_start_tag);
  request.body.start.which_when = symrig_wire_Start_at_tick_tag;
  request.body.start.when.at_tick = tick;
  return session.code(request);
}

std::uint32_t BoardUnderTest::keep_alive(std::uint32_t ttl_ms) {
  symrig_wire_Request request = make_request(symrig_wire_Request_keep_alive_tag);
  request.body.keep_alive.ttl_ms = ttl_ms;
  return session.code(request);
}

std::uint32_t BoardUnderTest::manual_set(std::uint32_t mask, std::uint32_t levels) {
  symrig_wire_Request request = make_request(symrig_wire_Request_manual_set_tag);
  request.body.manual_set = {mask, levels};
  return session.code(request);
}

std::uint32_t BoardUnderTest::clear_fault(std::uint32_t fault) {
  symrig_wire_Request request = make_request(symrig_wire_Request_clear_fault_tag);
  request.body.clear_fault.code = fault;
  return session.code(request);
}

std::optional<symrig_wire_StatusReply> BoardUnderTest::status() {
  const auto reply = session.ask(make_request(symrig_wire_Request_get_status_tag));
  if (!reply || reply->which_body != symrig_wire_Reply_status_tag) return std::nullopt;
  return reply->body.status;
}

std::optional<symrig_wire_TimeReply> BoardUnderTest::time() {
  const auto reply = session.ask(make_request(symrig_wire_Request_time_ping_tag));
  if (!reply || reply->which_body != symrig_wire_Reply_time_tag) return std::nullopt;
  return reply->body.time;
}

std::uint64_t BoardUnderTest::now() {
  const auto answer = time();
  return answer ? answer->tx_tick : 0;
}

void BoardUnderTest::plain_config() {
  config = {};
  for (const symrig_wire_LineReply& line : lines) {
    config.lines[line.line].configured = true;
    config.lines[line.line].output = raw(line.direction) == symrig_wire_Direction_DIRECTION_OUTPUT;
  }
}

Verdict BoardUnderTest::configure() {
  for (const symrig_wire_LineReply& line : lines)
    SYMRIG_MUST(
        code_is(fmt::format("config_line {}", line.line), symrig_wire_Code_CODE_OK, config_line(line.line)));
  return code_is("finalize_config", symrig_wire_Code_CODE_OK, finalize());
}

Verdict BoardUnderTest::send_program(const Bytes& program) {
  SYMRIG_MUST(code_is("program_begin", symrig_wire_Code_CODE_OK,
                      program_begin(static_cast<std::uint32_t>(program.size()))));
  const std::span<const std::uint8_t> bytes(program);
  const std::size_t chunk = protocol::chunk_room(can.mtu);
  for (std::size_t at = 0; at < program.size(); at += chunk) {
    session.forget();
    session.send_chunk(program_id, static_cast<std::uint32_t>(at),
                       bytes.subspan(at, std::min(chunk, program.size() - at)));
    const auto acknowledged = [&] {
      const Received* answer = session.last(protocol::Kind::ack);
      return answer != nullptr && answer->header.ack == session.seq;
    };
    if (!session.listen_until(acknowledged, kAnswerTime))
      return failed(fmt::format("the chunk at {} is not acknowledged", at));
  }
  return {};
}

Verdict BoardUnderTest::upload(const Bytes& program) {
  SYMRIG_MUST(send_program(program));
  program_hash = protocol::crc32c({program.data(), program.size()});
  symrig_wire_Request request = make_request(symrig_wire_Request_program_commit_tag);
  request.body.program_commit = {program_id, program_hash};
  const auto reply = session.ask(request);
  SYMRIG_MUST(code_is("program_commit", symrig_wire_Code_CODE_OK, reply ? raw(reply->code) : kNoCode));
  if (reply->which_body != symrig_wire_Reply_commit_tag)
    return failed("program_commit: the reply has no plan");
  committed = reply->body.commit;
  return {};
}

Verdict BoardUnderTest::load(const Bytes& program) {
  SYMRIG_MUST(configure());
  return upload(program);
}

Verdict BoardUnderTest::run_to_end(const Bytes& program, Nanoseconds timeout) {
  SYMRIG_MUST(load(program));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, arm()));
  session.forget();
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, start()));
  return await_done(timeout);
}

Verdict BoardUnderTest::await_done(Nanoseconds timeout) {
  const auto ended = [&] { return session.last_event(symrig_wire_Event_run_done_tag) != nullptr; };
  return that(session.listen_until(ended, timeout),
              fmt::format("run_done comes within {} ms", timeout / 1ms));
}

Verdict BoardUnderTest::in_state(symrig_wire_State state) {
  const auto now = status();
  if (!now) return failed("no answer to get_status");
  return same("state", state, raw(now->state));
}

Verdict BoardUnderTest::outputs_safe() {
  const auto now = status();
  if (!now) return failed("no answer to get_status");
  std::uint32_t mask = 0;
  for (const std::uint32_t line : outputs()) mask |= 1U << line;
  return same("levels of the outputs", config.safe_levels() & mask, now->levels & mask);
}

const symrig_wire_RunDone& BoardUnderTest::done() const {
  static constexpr symrig_wire_RunDone kNone{};
  const symrig_wire_Event* event = session.last_event(symrig_wire_Event_run_done_tag);
  return event == nullptr ? kNone : event->body.run_done;
}

Verdict BoardUnderTest::late_as_told(std::size_t seen) const {
  if (!best_effort()) return same("late", 0, done().late);
  // Two more than the steps: the word of End, and the start itself.
  return within("late, by the edges seen and by the steps", seen, std::uint64_t{done().steps} + 2,
                done().late);
}

bool BoardUnderTest::underran() {
  if (!best_effort() || session.lost()) return false;
  const auto now = status();
  return now && raw(now->state) == symrig_wire_State_STATE_FAULT &&
         raw(now->fault.code) == symrig_wire_FaultCode_FAULT_UNDERRUN;
}

}  // namespace symrig::conformance
