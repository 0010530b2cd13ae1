// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/core.hpp"
#include "symrig/firmware/version.hpp"
#include "symrig/protocol/schema_hash.hpp"

namespace symrig::firmware {
namespace {

using protocol::LineConfig;
using protocol::raw;

constexpr uint32_t kMaxTtlMs = 60'000;

void refuse(symrig_wire_Reply& reply, symrig_wire_Code code, uint64_t detail) {
  reply.code = code;
  reply.detail = detail;
}

void bad_value(symrig_wire_Reply& reply, uint32_t field) {
  reply.code = symrig_wire_Code_CODE_BAD_VALUE;
  reply.field = field;
}

/// Text that does not fit is cut.
template <size_t N>
void put_text(const char* text, char (&out)[N]) {
  size_t i = 0;
  for (; i + 1 < N && text[i] != 0; ++i) out[i] = text[i];
  out[i] = 0;
}

/// Number of the first field whose value makes no sense, 0 if all do.
uint32_t first_bad_field(const symrig_wire_ConfigLine& line) {
  const bool limits = line.max_on != 0 || line.min_off != 0 || line.max_duty_permille != 0;
  const bool output = raw(line.direction) == symrig_wire_Direction_DIRECTION_OUTPUT;
  if (raw(line.direction) > _symrig_wire_Direction_MAX) return symrig_wire_ConfigLine_direction_tag;
  if (raw(line.role) > _symrig_wire_LineRole_MAX) return symrig_wire_ConfigLine_role_tag;
  if (raw(line.hazard) > _symrig_wire_Hazard_MAX) return symrig_wire_ConfigLine_hazard_tag;
  if (!output && line.safe_level) return symrig_wire_ConfigLine_safe_level_tag;
  if (line.max_on > protocol::kMaxDuration || (limits && !output)) return symrig_wire_ConfigLine_max_on_tag;
  if (line.min_off > protocol::kMaxDuration) return symrig_wire_ConfigLine_min_off_tag;
  if (line.max_duty_permille > 1000) return symrig_wire_ConfigLine_max_duty_permille_tag;
  return 0;
}

LineConfig to_config(const symrig_wire_ConfigLine& line) {
  LineConfig config;
  config.configured = true;
  config.output = raw(line.direction) == symrig_wire_Direction_DIRECTION_OUTPUT;
  config.role = static_cast<uint8_t>(raw(line.role));
  config.hazard = static_cast<uint8_t>(raw(line.hazard));
  config.safe_level = line.safe_level;
  config.capture = line.capture;
  config.max_on = line.max_on;
  config.min_off = line.min_off;
  config.max_duty_permille = static_cast<uint16_t>(line.max_duty_permille);
  return config;
}

}  // namespace

void Core::answer(const symrig_wire_Request& request, symrig_wire_Reply& reply) {
  switch (request.which_body) {
    case symrig_wire_Request_hello_tag:
      return hello(reply);
    case symrig_wire_Request_capabilities_tag:
      return capabilities(reply);
    case symrig_wire_Request_capabilities_line_tag:
      return describe_line(request.body.capabilities_line.line, reply);
    case symrig_wire_Request_config_line_tag:
      return configure_line(request.body.config_line, reply);
    case symrig_wire_Request_finalize_config_tag:
      return finalize_config(request.body.finalize_config.hash, reply);
    case symrig_wire_Request_reset_config_tag:
      permit(Condition::config_reset, reply);
      return;
    case symrig_wire_Request_program_begin_tag:
      return begin_program(request.body.program_begin, reply);
    case symrig_wire_Request_program_commit_tag:
      return commit_program(request.body.program_commit, reply);
    case symrig_wire_Request_arm_tag:
      return arm(request.body.arm, reply);
    case symrig_wire_Request_start_tag:
      return start(request.body.start, reply);
    case symrig_wire_Request_abort_tag:
      return abort();
    case symrig_wire_Request_clear_fault_tag:
      return clear_fault(request.body.clear_fault.code, reply);
    case symrig_wire_Request_get_status_tag:
      return status(reply);
    case symrig_wire_Request_keep_alive_tag:
      if (request.body.keep_alive.ttl_ms > kMaxTtlMs)
        return bad_value(reply, symrig_wire_KeepAlive_ttl_ms_tag);
      return keep_alive(request.body.keep_alive.ttl_ms);
    case symrig_wire_Request_time_ping_tag:
      return time(request.body.time_ping.host_ns, reply);
    default:
      reply.code = symrig_wire_Code_CODE_UNKNOWN_REQUEST;
  }
}

void Core::hello(symrig_wire_Reply& reply) const {
  reply.which_body = symrig_wire_Reply_hello_tag;
  symrig_wire_HelloReply& hello = reply.body.hello;
  hello = symrig_wire_HelloReply_init_zero;
  hello.proto_major = protocol::kProtoMajor;
  hello.proto_minor = protocol::kProtoMinor;
  hello.schema_hash = protocol::kSchemaHash;
  hello.firmware_hash = kSourceHash;
  hello.reset_fault = reset_fault_;
  put_text(board_.traits.name, hello.board);
  put_text(kVersion, hello.firmware_version);
  for (uint8_t i = 0; i < board_.traits.unique_id_size && i < sizeof hello.unique_id.bytes; ++i)
    hello.unique_id.bytes[hello.unique_id.size++] = board_.traits.unique_id[i];
}

void Core::capabilities(symrig_wire_Reply& reply) const {
  const hal::BoardTraits& traits = board_.traits;
  reply.which_body = symrig_wire_Reply_capabilities_tag;
  reply.body.capabilities = {
      traits.tick_hz,    traits.line_count,       traits.min_dwell, traits.max_dwell, traits.wait_latency,
      store_.capacity(), protocol::kMaxLoopDepth, protocol::kMtu,   Link::kWindow,    events_.capacity()};
}

void Core::describe_line(uint32_t line, symrig_wire_Reply& reply) const {
  if (line >= board_.traits.line_count) return refuse(reply, symrig_wire_Code_CODE_NO_SUCH_LINE, line);
  const hal::Line& wired = board_.traits.lines[line];
  reply.which_body = symrig_wire_Reply_line_tag;
  reply.body.line = symrig_wire_LineReply_init_zero;
  reply.body.line.line = line;
  reply.body.line.direction =
      wired.output ? symrig_wire_Direction_DIRECTION_OUTPUT : symrig_wire_Direction_DIRECTION_INPUT;
  put_text(wired.name, reply.body.line.name);
}

void Core::configure_line(const symrig_wire_ConfigLine& line, symrig_wire_Reply& reply) {
  if (line.line >= board_.traits.line_count)
    return refuse(reply, symrig_wire_Code_CODE_NO_SUCH_LINE, line.line);
  if (const uint32_t field = first_bad_field(line)) return bad_value(reply, field);
  const LineConfig config = to_config(line);
  if (config.output != board_.traits.lines[line.line].output)
    return refuse(reply, symrig_wire_Code_CODE_WRONG_DIRECTION, line.line);
  if (!permit(Condition::config_line, reply)) return;
  config_.lines[line.line] = config;
}

void Core::finalize_config(uint32_t hash, symrig_wire_Reply& reply) {
  const uint32_t own = protocol::config_hash(config_);
  if (!transition(state_, Condition::config_final).allowed) {
    permit(Condition::config_final, reply);
    return;
  }
  if (hash != own) return refuse(reply, symrig_wire_Code_CODE_HASH_MISMATCH, own);
  safe_levels_ = config_.safe_levels();
  permit(Condition::config_final, reply);
  config_hash_ = own;
  guard_.configure(config_, board_.capture.levels(), board_.clock.now());
}

void Core::begin_program(const symrig_wire_ProgramBegin& begin, symrig_wire_Reply& reply) {
  if (begin.length > store_.capacity())
    return refuse(reply, symrig_wire_Code_CODE_TOO_LONG, store_.capacity());
  if (begin.length == 0 || begin.length % protocol::kRecordSize != 0)
    return bad_value(reply, symrig_wire_ProgramBegin_length_tag);
  if (permit(Condition::program_begin, reply)) store_.begin(begin.program_id, begin.length);
}

void Core::take_chunk(const protocol::DataChunk& chunk, symrig_wire_Reply& reply) {
  if (!permit(Condition::program_chunk, reply)) return;
  if (!store_.add(chunk)) refuse(reply, symrig_wire_Code_CODE_BAD_CHUNK, store_.received());
}

void Core::commit_program(const symrig_wire_ProgramCommit& commit, symrig_wire_Reply& reply) {
  if (!transition(state_, Condition::program_good).allowed) {
    permit(Condition::program_good, reply);
    return;
  }
  protocol::ProgramRules rules;
  rules.config = &config_;
  rules.min_dwell = board_.traits.min_dwell;
  rules.max_dwell = board_.traits.max_dwell;
  rules.wait_latency = board_.traits.wait_latency;
  rules.max_bytes = store_.capacity();
  const ProgramStore::Commit outcome = store_.commit(commit.program_id, commit.crc32c, rules);
  report_commit(outcome, reply);
  apply(outcome == ProgramStore::Commit::good ? Condition::program_good : Condition::program_bad);
}

void Core::report_commit(ProgramStore::Commit outcome, symrig_wire_Reply& reply) const {
  const protocol::Violation& broken = store_.violation();
  const protocol::ProgramTiming& timing = store_.timing();
  switch (outcome) {
    case ProgramStore::Commit::wrong_program:
      return bad_value(reply, symrig_wire_ProgramCommit_program_id_tag);
    case ProgramStore::Commit::incomplete:
      return refuse(reply, symrig_wire_Code_CODE_INCOMPLETE, store_.received());
    case ProgramStore::Commit::crc_mismatch:
      return refuse(reply, symrig_wire_Code_CODE_HASH_MISMATCH, store_.crc());
    case ProgramStore::Commit::broken_rule:
      reply.code = symrig_wire_Code_CODE_BAD_PROGRAM;
      reply.which_body = symrig_wire_Reply_violation_tag;
      reply.body.violation = {static_cast<uint32_t>(broken.rule), broken.record, broken.line, broken.actual,
                              broken.limit};
      return;
    case ProgramStore::Commit::good:
      reply.which_body = symrig_wire_Reply_commit_tag;
      reply.body.commit = {store_.hash(), timing.steps, timing.min, timing.max};
      return;
  }
}

/// The first lamp or laser line in the configuration, -1 if there is none.
int Core::hazardous_line() const {
  for (unsigned k = 0; k < protocol::kMaxLines; ++k)
    if (config_.lines[k].configured && config_.lines[k].output && config_.lines[k].hazard != 0)
      return static_cast<int>(k);
  return -1;
}

void Core::arm(const symrig_wire_Arm& arm, symrig_wire_Reply& reply) {
  if (!transition(state_, Condition::arm).allowed) {
    permit(Condition::arm, reply);
    return;
  }
  reply.field = arm.program_hash != store_.hash() ? symrig_wire_Arm_program_hash_tag : 0;
  if (reply.field != 0) return refuse(reply, symrig_wire_Code_CODE_HASH_MISMATCH, store_.hash());
  reply.field = arm.config_hash != config_hash_ ? symrig_wire_Arm_config_hash_tag : 0;
  if (reply.field != 0) return refuse(reply, symrig_wire_Code_CODE_HASH_MISMATCH, config_hash_);
  const int hazard = hazardous_line();
  if (hazard >= 0 && ttl_ms_ == 0)
    return refuse(reply, symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED, static_cast<uint64_t>(hazard));
  permit(Condition::arm, reply);
}

void Core::start(const symrig_wire_Start& start, symrig_wire_Reply& reply) {
  if (!transition(state_, Condition::start).allowed) {
    permit(Condition::start, reply);
    return;
  }
  const hal::Tick now = board_.clock.now();
  const bool timed = start.which_when == symrig_wire_Start_at_tick_tag;
  const hal::Tick at = timed ? start.when.at_tick : now;
  if (at < now) return refuse(reply, symrig_wire_Code_CODE_IN_PAST, now);
  if (at - now > protocol::kMaxDuration) return bad_value(reply, symrig_wire_Start_at_tick_tag);
  hal::Tick needed = 0;
  const int cooling = guard_.cooling_line(at, needed);
  if (cooling >= 0) {
    reply.which_body = symrig_wire_Reply_violation_tag;
    reply.body.violation = {static_cast<uint32_t>(protocol::Rule::duty), 0, static_cast<uint32_t>(cooling), 0,
                            needed};
    return refuse(reply, symrig_wire_Code_CODE_COOLING, static_cast<uint64_t>(cooling));
  }
  permit(Condition::start, reply);
  events_.restart_count();
  const hal::BoardTraits& traits = board_.traits;
  sequencer_.begin(store_.program(), traits.min_dwell, traits.wait_latency, at, now);
  symrig_wire_Event event = symrig_wire_Event_init_zero;
  event.which_body = symrig_wire_Event_run_started_tag;
  event.body.run_started = {store_.hash(), sequencer_.tally().started};
  events_.push_important(event, now);
}

void Core::abort() {
  const bool running = state_ == State::running;
  apply(Condition::abort);
  if (running) report_run(symrig_wire_RunEnd_RUN_END_ABORTED);
}

void Core::clear_fault(uint32_t code, symrig_wire_Reply& reply) {
  if (state_ == State::fault && code != fault_.code)
    return refuse(reply, symrig_wire_Code_CODE_BAD_VALUE, fault_.code);
  if (!permit(Condition::clear_fault, reply)) return;
  fault_ = {};
  board_.faults.save(fault_);
}

void Core::status(symrig_wire_Reply& reply) const {
  reply.which_body = symrig_wire_Reply_status_tag;
  symrig_wire_StatusReply& status = reply.body.status;
  status = symrig_wire_StatusReply_init_zero;
  status.state = static_cast<symrig_wire_State>(state_);
  status.config_hash = config_hash_;
  status.program_hash = store_.hash();
  status.tick = board_.clock.now();
  status.levels = board_.capture.levels();
  status.has_fault = fault_.code != 0;
  status.fault = {static_cast<symrig_wire_FaultCode>(fault_.code), fault_.tick, fault_.arg};
  status.bad_frames = link_.bad_frames();
  status.steps = static_cast<uint32_t>(sequencer_.steps());
}

void Core::keep_alive(uint32_t ttl_ms) {
  ttl_ms_ = ttl_ms;
  alive_until_ = ttl_ms == 0 ? hal::kNever : board_.clock.now() + board_.traits.tick_hz * ttl_ms / 1000;
}

void Core::time(uint64_t host_ns, symrig_wire_Reply& reply) const {
  reply.which_body = symrig_wire_Reply_time_tag;
  reply.body.time = {host_ns, received_, board_.clock.now()};
}

}  // namespace symrig::firmware
