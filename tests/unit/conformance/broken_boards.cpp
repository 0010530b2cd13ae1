// SPDX-License-Identifier: Apache-2.0
// Some forty-five boards, each broken in one way, and the checks of the conformance kit that must find it.
#include "broken_boards.hpp"

#include <algorithm>
#include <functional>
#include <utility>

namespace symrig::test {
namespace {

template <class Message>
bool change(Bytes& body, const std::function<bool(Message&)>& how) {
  Message message;
  if (!protocol::decode({body.data(), body.size()}, message)) return true;
  if (!how(message)) return false;
  protocol::BodyBuffer out{};
  const std::size_t size = encode(message, out);
  body.assign(out.bytes, out.bytes + size);
  return true;
}
Break replies(std::function<bool(symrig_wire_Reply&)> how) {
  return [how = std::move(how)](FrameHeader& header, Bytes& body) {
    return header.kind != Kind::reply || change<symrig_wire_Reply>(body, how);
  };
}
Break events(std::function<bool(symrig_wire_Event&)> how) {
  return [how = std::move(how)](FrameHeader& header, Bytes& body) {
    return header.kind != Kind::event || change<symrig_wire_Event>(body, how);
  };
}
Break requests(std::function<bool(symrig_wire_Request&)> how) {
  return [how = std::move(how)](FrameHeader& header, Bytes& body) {
    return header.kind != Kind::request || change<symrig_wire_Request>(body, how);
  };
}
/// A reply of that kind, changed.
Break told(pb_size_t which, std::function<void(symrig_wire_Reply&)> how) {
  return replies([which, how = std::move(how)](symrig_wire_Reply& reply) {
    if (reply.which_body == which) how(reply);
    return true;
  });
}
Break happened(pb_size_t which, std::function<void(symrig_wire_Event&)> how) {
  return events([which, how = std::move(how)](symrig_wire_Event& event) {
    if (event.which_body == which) how(event);
    return true;
  });
}
Break asked(pb_size_t which, std::function<void(symrig_wire_Request&)> how) {
  return requests([which, how = std::move(how)](symrig_wire_Request& request) {
    if (request.which_body == which) how(request);
    return true;
  });
}

Break says_yes() {
  return replies([](symrig_wire_Reply& reply) {
    if (reply.code != symrig_wire_Code_CODE_OK) reply = symrig_wire_Reply_init_zero;
    return true;
  });
}

Break ignores_numbers() {
  return [expected = std::uint16_t{0}](FrameHeader& header, Bytes&) mutable {
    const bool numbered = header.kind == Kind::request || header.kind == Kind::data;
    if (!numbered || (header.flags & protocol::flag::urgent) != 0) return true;
    if ((header.flags & protocol::flag::sync) != 0) expected = header.seq;
    header.seq = expected++;
    return true;
  };
}

Break never_sends_again() {
  return [seen = std::set<std::uint16_t>{}](FrameHeader& header, Bytes&) mutable {
    return header.kind != Kind::event || seen.insert(header.seq).second;
  };
}

Break wants_hello_in_turn() {
  return [last = std::uint16_t{0}](FrameHeader& header, Bytes&) mutable {
    if (header.kind != Kind::request || (header.flags & protocol::flag::urgent) != 0) return true;
    const bool next = static_cast<std::uint16_t>(header.seq - last) < 3;
    if ((header.flags & protocol::flag::sync) != 0 && !next) return false;
    last = header.seq;
    return true;
  };
}

Break loses_third_chunk() {
  return [count = 0](FrameHeader& header, Bytes&) mutable {
    return header.kind != Kind::data || ++count % 3 != 0;
  };
}

Breaks from(Break how) {
  return {.from_board = std::move(how), .to_board = {}};
}
Breaks to(Break how) {
  return {.from_board = {}, .to_board = std::move(how)};
}

}  // namespace

Breaks best_effort(std::uint32_t lateness, std::uint32_t delay, bool tells) {
  const auto claim = [lateness](symrig_wire_Reply& reply) {
    if (reply.which_body == symrig_wire_Reply_capabilities_tag) reply.body.capabilities.lateness = lateness;
    return true;
  };
  // An event that comes twice, because a host is slow to acknowledge it, is the same event.
  const auto happen = [=, late = std::set<std::uint64_t>{}](symrig_wire_Event& event) mutable {
    if (event.which_body == symrig_wire_Event_run_started_tag) late.clear();
    if (event.which_body == symrig_wire_Event_run_done_tag && tells)
      event.body.run_done.late = static_cast<std::uint32_t>(late.size());
    if (event.which_body != symrig_wire_Event_edge_tag || event.body.edge.tick % 4 != 0) return true;
    if (delay > lateness) late.insert(event.body.edge.tick);
    event.body.edge.tick += delay;
    return true;
  };
  return from([tell = replies(claim), make = events(happen)](FrameHeader& header, Bytes& body) {
    return tell(header, body) && make(header, body);
  });
}

std::vector<Broken> broken_wires() {
  return {
      {"answers rubbish",
       {.from_board = {}, .to_board = {}, .answers_rubbish = true},
       "^wire|^receipt.bad",
       {"wire.zeros", "wire.corrupted", "wire.truncated", "wire.too_long", "wire.bad_kind",
        "receipt.bad_frames"}},
      {"ignores numbers",
       to(ignores_numbers()),
       "^wire|^upload",
       {"wire.lost", "wire.old", "wire.duplicated", "upload.chunk_repeated", "upload.chunks_out_of_order"}},
      {"sends no NAK",
       from([](FrameHeader& header, Bytes&) { return header.kind != Kind::nak; }),
       "^wire|^upload",
       {"wire.lost", "upload.chunks_out_of_order"}},
      {"sends no ACK",
       from([](FrameHeader& header, Bytes&) { return header.kind != Kind::ack; }),
       "^wire|^upload",
       {"wire.old", "upload.window", "upload.chunk_repeated", "upload.chunks_out_of_order", "upload.full"}},
      {"makes up a new answer",
       from(told(symrig_wire_Reply_time_tag,
                 [count = 0U](symrig_wire_Reply& reply) mutable { reply.body.time.tx_tick += ++count; })),
       "^wire.dup",
       {"wire.duplicated"}},
      {"tells of two starts",
       from(happened(symrig_wire_Event_step_mark_tag,
                     [](symrig_wire_Event& event) { event.which_body = symrig_wire_Event_run_started_tag; })),
       "^wire.done",
       {"wire.done_once"}},
      {"wants hello in turn",
       to(wants_hello_in_turn()),
       "^wire.hello|^wire.seq",
       {"wire.hello_anywhere", "wire.sequence_wraps"}},
      {"knows no field to come",
       to([](FrameHeader&, Bytes& body) {
         if (body.size() > 3 && body.back() == 1 && body[body.size() - 2] == 0x3F) body = {0xFF};
         return true;
       }),
       "^wire.unknown",
       {"wire.unknown_field"}},
      {"answers nothing out of turn",
       from([](FrameHeader& header, Bytes&) { return (header.flags & protocol::flag::urgent) == 0; }),
       "^wire.urgent",
       {"wire.urgent_abort", "wire.urgent_time", "wire.urgent_other"}},
      {"loses chunks", to(loses_third_chunk()), "^upload.window", {"upload.window"}},
      {"sends no event twice", from(never_sends_again()), "^events", {"events.sent_again", "events.nak"}},
      {"ignores the credit",
       to([](FrameHeader& header, Bytes&) {
         header.credit = 255;
         return true;
       }),
       "^events",
       {"events.credit", "events.lost_are_counted"}},
      {"ignores NAK",
       to([](FrameHeader& header, Bytes&) { return header.kind != Kind::nak; }),
       "^events",
       {"events.nak"}},
      {"counts marks wrong",
       from(happened(symrig_wire_Event_step_mark_tag,
                     [](symrig_wire_Event& event) { ++event.body.step_mark.ordinal; })),
       "^events|^programs",
       {"events.in_order", "programs.words", "programs.loops", "programs.again"}},
      {"hides what it lost",
       from(happened(symrig_wire_Event_run_done_tag,
                     [](symrig_wire_Event& event) { event.body.run_done.events_lost = 0; })),
       "^events",
       {"events.lost_are_counted"}},
  };
}

std::vector<Broken> broken_refusals() {
  return {
      {"says yes to everything",
       from(says_yes()),
       "",
       {"identity.no_such_line",
        "identity.config_hash",
        "identity.wrong_direction",
        "identity.reboot_token",
        "identity.identify",
        "wire.unknown_request",
        "wire.bad_body",
        "wire.bad_chunk_body",
        "wire.version",
        "wire.urgent_other",
        "states.safe",
        "states.configured",
        "states.loaded",
        "states.armed",
        "states.running",
        "states.done",
        "states.fault",
        "states.wrong_fault",
        "states.arm_hashes",
        "upload.chunk_misplaced",
        "upload.incomplete",
        "upload.wrong_crc",
        "rules.length",
        "rules.bad_op",
        "rules.bad_arg",
        "rules.min_dwell",
        "rules.max_dwell",
        "rules.not_an_output",
        "rules.not_an_input",
        "rules.loop_depth",
        "rules.loop_balance",
        "rules.loop_rounds",
        "rules.idle_loop",
        "rules.mark_crowd",
        "rules.no_end",
        "rules.too_long",
        "rules.max_on",
        "rules.min_off",
        "rules.duty",
        "programs.start_in_past",
        "programs.start_unknown",
        "limits.lamp_needs_keep_alive",
        "limits.lamp_not_autonomous",
        "limits.laser_needs_max_on",
        "limits.laser_needs_short_keep_alive",
        "limits.keep_alive_stays_on",
        "limits.bad_numbers",
        "limits.cooling",
        "limits.by_hand_wrong_line",
        "interlock.open_refuses",
        "interlock.not_an_output"}},
      {"claims less than it awaits",
       {.from_board =
            told(symrig_wire_Reply_line_tag, [](symrig_wire_Reply& reply) { reply.body.line.waits &= 3U; }),
        .to_board = {}},
       "^rules.wait",
       {"rules.wait_kind"}},
      {"claims to be slow",
       from(told(symrig_wire_Reply_capabilities_tag,
                 [](symrig_wire_Reply& reply) { reply.body.capabilities.refill_ticks = 1000; })),
       "^rules.refill",
       {"rules.refill"}},
      {"finds its interlock open",
       from(replies([](symrig_wire_Reply& reply) {
         if (reply.code == symrig_wire_Code_CODE_BAD_STATE) reply.code = symrig_wire_Code_CODE_INTERLOCK_OPEN;
         return true;
       })),
       "^states",
       {"states.safe", "states.armed"}},
      {"starts no run",
       to(asked(
           symrig_wire_Request_start_tag,
           [](symrig_wire_Request& request) { request.which_body = symrig_wire_Request_get_status_tag; })),
       "^interlock",
       {"interlock.closed_allows"}},
  };
}

std::vector<Broken> broken_words() {
  using Reply = symrig_wire_Reply;
  using Event = symrig_wire_Event;
  return {
      {"requires what nobody knows",
       from(told(symrig_wire_Reply_hello_tag, [](Reply& reply) { reply.body.hello.required = 1; })),
       "^identity",
       {"identity.hello"}},
      {"is another each time",
       from(told(symrig_wire_Reply_hello_tag,
                 [count = 0U](Reply& reply) mutable { reply.body.hello.firmware_hash += ++count; })),
       "^identity",
       {"identity.stable"}},
      {"has a small MTU",
       from(
           told(symrig_wire_Reply_capabilities_tag, [](Reply& reply) { reply.body.capabilities.mtu = 120; })),
       "^identity",
       {"identity.capabilities"}},
      {"has lines of one name",
       from(told(symrig_wire_Reply_line_tag, [](Reply& reply) { reply.body.line.name[0] = 0; })),
       "^identity",
       {"identity.lines"}},
      {"is a tick late with marks",
       from(happened(symrig_wire_Event_step_mark_tag, [](Event& event) { ++event.body.step_mark.tick; })),
       "^programs",
       {"programs.words", "programs.loops", "programs.again", "programs.wait_timeout"}},
      {"is a tick late with edges",
       from(happened(symrig_wire_Event_edge_tag, [](Event& event) { ++event.body.edge.tick; })),
       "^programs",
       {"programs.edges"}},
      {"calls words late that hardware makes",
       from(happened(symrig_wire_Event_run_done_tag, [](Event& event) { event.body.run_done.late = 1; })),
       "^programs|^receipt.counters",
       {"programs.words", "programs.edges", "programs.loops", "programs.again", "receipt.counters"}},
      {"is later than it promises and does not tell",
       best_effort(100, 101, false),
       "^programs",
       {"programs.edges"}},
      {"makes words early, best effort or not",
       from([claim = best_effort(100, 0, true).from_board,
             early = happened(symrig_wire_Event_edge_tag, [](Event& event) { --event.body.edge.tick; })](
                FrameHeader& header, Bytes& body) { return claim(header, body) && early(header, body); }),
       "^programs",
       {"programs.edges"}},
      {"calls more words late than there are",
       from([claim = best_effort(100, 0, true).from_board,
             boast = happened(symrig_wire_Event_run_done_tag,
                              [](Event& event) {
                                event.body.run_done.late =
                                    3 + static_cast<std::uint32_t>(event.body.run_done.steps);
                              })](FrameHeader& header, Bytes& body) {
         return claim(header, body) && boast(header, body);
       }),
       "^programs|^receipt.counters",
       {"programs.words", "programs.again", "receipt.counters"}},
      {"starts a tick late",
       from(happened(symrig_wire_Event_run_started_tag, [](Event& event) { ++event.body.run_started.tick; })),
       "^programs",
       {"programs.start_at", "programs.words"}},
      {"plans a tick too much",
       from(told(symrig_wire_Reply_commit_tag, [](Reply& reply) { ++reply.body.commit.planned_max; })),
       "^programs|^receipt",
       {"programs.planned", "programs.wait_timeout", "receipt.counters"}},
      {"plans a step too few",
       from(told(symrig_wire_Reply_commit_tag, [](Reply& reply) { --reply.body.commit.steps; })),
       "^upload.full|^programs.planned|^receipt.counters",
       {"upload.full", "programs.planned", "receipt.counters"}},
      {"forgets which record waited",
       from(happened(symrig_wire_Event_run_done_tag, [](Event& event) { event.body.run_done.arg = 0; })),
       "^programs",
       {"programs.wait_abort"}},
      {"makes light of its lines",
       from(told(symrig_wire_Reply_line_use_tag, [](Reply& reply) { --reply.body.line_use.worst_on; })),
       "^programs",
       {"programs.line_use"}},
      {"shows all lines low",
       from(told(symrig_wire_Reply_status_tag, [](Reply& reply) { reply.body.status.levels = 0; })),
       "^programs|^limits",
       {"programs.final_levels", "limits.by_hand", "limits.safe_high", "limits.run_is_cut"}},
      {"keeps a program in name",
       from(told(symrig_wire_Reply_status_tag, [](Reply& reply) { reply.body.status.program_hash = 7; })),
       "^upload|^receipt",
       {"upload.dropped_with_config", "receipt.hashes"}},
      {"counts a step too many",
       from(happened(symrig_wire_Event_run_done_tag, [](Event& event) { ++event.body.run_done.steps; })),
       "^receipt|^programs",
       {"receipt.counters", "programs.words"}},
      {"calls everything complete",
       from(happened(symrig_wire_Event_run_done_tag,
                     [](Event& event) { event.body.run_done.end = symrig_wire_RunEnd_RUN_END_COMPLETED; })),
       "^receipt|^host_loss|^limits",
       {"receipt.aborted", "host_loss.while_running", "limits.run_is_cut"}},
      {"counts no bad frames",
       from(told(symrig_wire_Reply_status_tag, [](Reply& reply) { reply.body.status.bad_frames = 0; })),
       "^receipt|^wire",
       {"receipt.bad_frames", "wire.truncated", "wire.too_long", "wire.bad_kind"}},
      {"has a clock that goes back",
       from(told(symrig_wire_Reply_time_tag,
                 [](Reply& reply) { reply.body.time.tx_tick = reply.body.time.rx_tick - 1; })),
       "^clock",
       {"clock.monotone"}},
      {"keeps 32 bits of the host's clock",
       from(told(symrig_wire_Reply_time_tag, [](Reply& reply) { reply.body.time.host_ns &= 0xFFFFFFFFU; })),
       "^clock",
       {"clock.echo"}},
      {"has a clock that is 0.2 % fast",
       from(told(symrig_wire_Reply_time_tag,
                 [](Reply& reply) {
                   reply.body.time.rx_tick += reply.body.time.rx_tick / 500;
                   reply.body.time.tx_tick += reply.body.time.tx_tick / 500;
                 })),
       "^clock",
       {"clock.rate"}},
      {"has two clocks",
       from(told(symrig_wire_Reply_status_tag, [](Reply& reply) { reply.body.status.tick = 0; })),
       "^clock",
       {"clock.agrees_with_status"}},
  };
}

std::vector<Broken> broken_watches() {
  using Request = symrig_wire_Request;
  return {
      {"never misses its host",
       to(asked(symrig_wire_Request_keep_alive_tag,
                [](Request& request) { request.body.keep_alive.ttl_ms = 0; })),
       "^host_loss|^states.fault",
       {"host_loss.while_armed", "host_loss.while_running", "host_loss.by_hand", "states.fault"}},
      {"misses its host 20 ms late",
       to(asked(symrig_wire_Request_keep_alive_tag,
                [](Request& request) {
                  if (request.body.keep_alive.ttl_ms != 0) request.body.keep_alive.ttl_ms += 20;
                })),
       "^host_loss",
       {"host_loss.while_armed", "host_loss.while_running", "host_loss.by_hand"}},
      {"misses its host too soon",
       to(asked(symrig_wire_Request_keep_alive_tag,
                [](Request& request) { request.body.keep_alive.ttl_ms /= 10; })),
       "^host_loss",
       {"host_loss.kept_alive", "host_loss.while_armed"}},
      {"cannot stop to watch",
       to(asked(symrig_wire_Request_keep_alive_tag,
                [](Request& request) {
                  if (request.body.keep_alive.ttl_ms == 0) request.body.keep_alive.ttl_ms = 50;
                })),
       "^host_loss.switched",
       {"host_loss.switched_off"}},
      {"faults at rest",
       from(told(symrig_wire_Reply_status_tag,
                 [](symrig_wire_Reply& reply) {
                   if (reply.body.status.state == symrig_wire_State_STATE_CONFIGURED)
                     reply.body.status.state = symrig_wire_State_STATE_FAULT;
                 })),
       "^host_loss",
       {"host_loss.while_idle"}},
      {"never lets go of its host",
       to(asked(symrig_wire_Request_arm_tag, [](Request& request) { request.body.arm.autonomous = false; })),
       "^host_loss",
       {"host_loss.autonomous"}},
      {"moves nothing by hand",
       to(asked(symrig_wire_Request_manual_set_tag,
                [](Request& request) { request.body.manual_set.levels = 0; })),
       "^limits|^host_loss",
       {"limits.guard_max_on", "limits.by_hand", "limits.cooling", "host_loss.by_hand"}},
  };
}

}  // namespace symrig::test
