// SPDX-License-Identifier: Apache-2.0
// Calls the function for each request. The table of protocol/PROTOCOL.md, in order of number.
#include "symrig/firmware/core.hpp"

namespace symrig::firmware {

Answer Core::answer(const symrig_wire_Request& request, symrig_wire_Reply& reply) {
  switch (request.which_body) {
    case symrig_wire_Request_program_commit_tag:
      return commit_program(request.body.program_commit, reply);
    case symrig_wire_Request_program_verify_tag:
      return verify_program(reply);
    default:
      answer_now(request, reply);
      return Answer::now;
  }
}

void Core::answer_now(const symrig_wire_Request& request, symrig_wire_Reply& reply) {
  switch (request.which_body) {
    case symrig_wire_Request_hello_tag:
      return hello(reply);
    case symrig_wire_Request_capabilities_tag:
      return capabilities(reply);
    case symrig_wire_Request_config_line_tag:
      return configure_line(request.body.config_line, reply);
    case symrig_wire_Request_finalize_config_tag:
      return finalize_config(request.body.finalize_config.hash, reply);
    case symrig_wire_Request_reset_config_tag:
      permit(Condition::config_reset, reply);
      return;
    case symrig_wire_Request_program_begin_tag:
      return begin_program(request.body.program_begin, reply);
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
      return keep_alive(request.body.keep_alive.ttl_ms, reply);
    case symrig_wire_Request_time_ping_tag:
      return time(request.body.time_ping.host_ns, reply);
    case symrig_wire_Request_capabilities_line_tag:
      return describe_line(request.body.capabilities_line.line, reply);
    case symrig_wire_Request_identify_tag:
      return identify(request.body.identify.seconds, reply);
    case symrig_wire_Request_manual_set_tag:
      return set_by_hand(request.body.manual_set, reply);
    case symrig_wire_Request_program_line_tag:
      return tell_line_use(request.body.program_line.line, reply);
    case symrig_wire_Request_store_config_tag:
      return store_config(request.body.store_config, reply);
    case symrig_wire_Request_reboot_tag:
      return reboot(request.body.reboot, reply);
    case symrig_wire_Request_get_diagnostics_tag:
      return diagnostics(reply);
    default:
      reply.code = symrig_wire_Code_CODE_UNKNOWN_REQUEST;
  }
}

}  // namespace symrig::firmware
