// SPDX-License-Identifier: Apache-2.0
// Requests about the board's program.
#include "replies.hpp"
#include "symrig/firmware/core.hpp"

namespace symrig::firmware {

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

protocol::ProgramRules Core::rules() const {
  const hal::BoardTraits& traits = board_.traits;
  protocol::ProgramRules rules;
  rules.config = &config_;
  rules.min_dwell = traits.min_dwell;
  rules.max_dwell = traits.max_dwell;
  rules.wait_latency = traits.wait_latency;
  rules.max_bytes = store_.capacity();
  for (unsigned k = 0; k < traits.line_count; ++k)
    rules.no_waits[k] = static_cast<uint8_t>(hal::waits::all & ~traits.lines[k].waits);
  rules.queue_segments = traits.queue_segments;
  rules.refill_ticks = traits.refill_ticks;
  rules.poll_ticks = traits.poll_ticks;
  return rules;
}

Answer Core::commit_program(const symrig_wire_ProgramCommit& commit, symrig_wire_Reply& reply) {
  if (!transition(state_, Condition::program_good).allowed) {
    permit(Condition::program_good, reply);
    return Answer::now;
  }
  const ProgramStore::Verdict verdict = store_.commit(commit.program_id, commit.crc32c, rules());
  if (verdict == ProgramStore::Verdict::pending) return Answer::later;
  conclude_commit(verdict, reply);
  return Answer::now;
}

Answer Core::verify_program(symrig_wire_Reply& reply) {
  if (state_ != State::loaded && state_ != State::done) {
    refuse(reply, symrig_wire_Code_CODE_BAD_STATE, static_cast<uint64_t>(state_));
    return Answer::now;
  }
  store_.verify();
  return Answer::later;
}

/// Continues a commit or a verification. Not during a run, which needs the time.
void Core::read_program() {
  if (!store_.working() || state_ == State::armed || state_ == State::running) return;
  const bool committing = !store_.loaded();
  const ProgramStore::Verdict verdict = store_.work();
  if (verdict == ProgramStore::Verdict::pending) return;
  symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
  if (committing) {
    conclude_commit(verdict, reply);
  } else {
    report_program(verdict, reply);
  }
  link_.complete(reply);
}

void Core::conclude_commit(ProgramStore::Verdict verdict, symrig_wire_Reply& reply) {
  const bool good = verdict == ProgramStore::Verdict::good;
  report_program(verdict, reply);
  // A fault may have happened while the program was read.
  if (apply(good ? Condition::program_good : Condition::program_bad)) return;
  store_.drop();
  reply = symrig_wire_Reply_init_zero;
  refuse(reply, symrig_wire_Code_CODE_BAD_STATE, static_cast<uint64_t>(state_));
}

void Core::report_program(ProgramStore::Verdict verdict, symrig_wire_Reply& reply) const {
  const protocol::Violation& broken = store_.violation();
  const protocol::ProgramTiming& timing = store_.timing();
  switch (verdict) {
    case ProgramStore::Verdict::pending:
      return;
    case ProgramStore::Verdict::wrong_program:
      return bad_value(reply, symrig_wire_ProgramCommit_program_id_tag);
    case ProgramStore::Verdict::incomplete:
      return refuse(reply, symrig_wire_Code_CODE_INCOMPLETE, store_.received());
    case ProgramStore::Verdict::crc_mismatch:
      return refuse(reply, symrig_wire_Code_CODE_HASH_MISMATCH, store_.crc());
    case ProgramStore::Verdict::broken_rule:
      reply.code = symrig_wire_Code_CODE_BAD_PROGRAM;
      reply.which_body = symrig_wire_Reply_violation_tag;
      reply.body.violation = {static_cast<uint32_t>(broken.rule), broken.record, broken.line, broken.actual,
                              broken.limit};
      return;
    case ProgramStore::Verdict::good:
      reply.which_body = symrig_wire_Reply_commit_tag;
      reply.body.commit = {store_.hash(), timing.steps, timing.min, timing.max};
      return;
  }
}

void Core::tell_line_use(uint32_t line, symrig_wire_Reply& reply) const {
  if (!store_.loaded()) return refuse(reply, symrig_wire_Code_CODE_BAD_STATE, static_cast<uint64_t>(state_));
  if (line >= board_.traits.line_count) return refuse(reply, symrig_wire_Code_CODE_NO_SUCH_LINE, line);
  if (!config_.lines[line].output) return refuse(reply, symrig_wire_Code_CODE_WRONG_DIRECTION, line);
  const protocol::LineUse& use = store_.use(static_cast<unsigned>(line));
  reply.which_body = symrig_wire_Reply_line_use_tag;
  reply.body.line_use = {line, use.worst_on, use.worst_duty_permille};
}

}  // namespace symrig::firmware
