// SPDX-License-Identifier: Apache-2.0
// Requests that only read.
#include "replies.hpp"
#include "symrig/firmware/core.hpp"
#include "symrig/firmware/version.hpp"
#include "symrig/protocol/schema_hash.hpp"

namespace symrig::firmware {
namespace {

symrig_wire_Fault to_wire(const hal::FaultRecord& fault) {
  return {static_cast<symrig_wire_FaultCode>(fault.code), fault.tick, fault.arg};
}

symrig_wire_Crash to_wire(const hal::Crash& crash) {
  return {crash.exception, crash.pc,   crash.lr,   crash.psr,  crash.sp,
          crash.r[0],      crash.r[1], crash.r[2], crash.r[3], crash.r[4]};
}

}  // namespace

void Core::hello(symrig_wire_Reply& reply) const {
  reply.which_body = symrig_wire_Reply_hello_tag;
  symrig_wire_HelloReply& hello = reply.body.hello;
  hello = symrig_wire_HelloReply_init_zero;
  hello.proto_major = protocol::kProtoMajor;
  hello.proto_minor = protocol::kProtoMinor;
  hello.schema_hash = protocol::kSchemaHash;
  hello.firmware_hash = kSourceHash;
  hello.reset_fault = reset_fault_.code;
  put_text(board_.traits.name, hello.board);
  put_text(kVersion, hello.firmware_version);
  for (uint8_t i = 0; i < board_.traits.unique_id_size && i < sizeof hello.unique_id.bytes; ++i)
    hello.unique_id.bytes[hello.unique_id.size++] = board_.traits.unique_id[i];
}

void Core::capabilities(symrig_wire_Reply& reply) const {
  const hal::BoardTraits& traits = board_.traits;
  reply.which_body = symrig_wire_Reply_capabilities_tag;
  symrig_wire_CapabilitiesReply& can = reply.body.capabilities;
  can = symrig_wire_CapabilitiesReply_init_zero;
  can.tick_hz = traits.tick_hz;
  can.lines = traits.line_count;
  can.min_dwell = traits.min_dwell;
  can.max_dwell = traits.max_dwell;
  can.wait_latency = traits.wait_latency;
  can.program_bytes = store_.capacity();
  can.loop_depth = protocol::kMaxLoopDepth;
  can.mtu = protocol::kMtu;
  can.window = Link::kWindow;
  can.event_ring = events_.capacity();
  can.queue_segments = traits.queue_segments;
  can.refill_ticks = traits.refill_ticks;
  can.poll_ticks = traits.poll_ticks;
  can.lateness = traits.lateness;
  put_text(label_.text, can.label);
}

void Core::describe_line(uint32_t line, symrig_wire_Reply& reply) const {
  if (line >= board_.traits.line_count) return refuse(reply, symrig_wire_Code_CODE_NO_SUCH_LINE, line);
  const hal::Line& wired = board_.traits.lines[line];
  reply.which_body = symrig_wire_Reply_line_tag;
  symrig_wire_LineReply& told = reply.body.line;
  told = symrig_wire_LineReply_init_zero;
  told.line = line;
  told.direction =
      wired.output ? symrig_wire_Direction_DIRECTION_OUTPUT : symrig_wire_Direction_DIRECTION_INPUT;
  put_text(wired.name, told.name);
  put_text(wired.pin, told.pin);
  told.waits = wired.waits;
  told.trips = wired.trips;
  told.stamp_ticks = wired.stamp_ticks;
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
  status.fault = to_wire(fault_);
  status.bad_frames = link_.bad_frames();
  status.steps = static_cast<uint32_t>(sequencer_.steps());
  status.reset_cause = static_cast<symrig_wire_ResetCause>(board_.system.reset_cause());
  status.has_reset_fault = reset_fault_.code != 0;
  status.reset_fault = to_wire(reset_fault_);
  status.stored_config = stored_config_;
}

void Core::diagnostics(symrig_wire_Reply& reply) const {
  hal::Diagnostics found;
  if (!board_.system.diagnose(found)) {
    reply.code = symrig_wire_Code_CODE_UNKNOWN_REQUEST;
    return;
  }
  reply.which_body = symrig_wire_Reply_diagnostics_tag;
  symrig_wire_DiagnosticsReply& told = reply.body.diagnostics;
  told = symrig_wire_DiagnosticsReply_init_zero;
  told.longest_round = longest_round_;
  told.worst_refill = worst_refill_;
  told.flash_reads = found.flash_reads;
  told.flash_hits = found.flash_hits;
  told.queue_overflows = found.queue_overflows;
  told.dma_errors = found.dma_errors;
  told.stack_free = found.stack_free;
  told.chip_revision = found.chip_revision;
  told.has_crash = found.crash.exception != 0;
  told.crash = to_wire(found.crash);
}

void Core::time(uint64_t host_ns, symrig_wire_Reply& reply) const {
  reply.which_body = symrig_wire_Reply_time_tag;
  reply.body.time = {host_ns, received_, board_.clock.now()};
}

}  // namespace symrig::firmware
