// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/sim_board.hpp"
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/messages.hpp"
#include "symrig/protocol/program.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

namespace symrig::test {

/// A frame from the board, kept.
struct Received {
  protocol::FrameHeader header;
  std::vector<std::uint8_t> body;
};

/// The least that can speak to a board, frame by frame, so that tests can break each rule on purpose.
class RawHost {
 public:
  explicit RawHost(board_sim::SimBoard& board) : board_(board) {}

  std::uint16_t seq = 1;  // of the next frame
  std::uint16_t ack = 0;  // event expected next
  std::uint8_t credit = 255;
  std::vector<symrig_wire_Event> events;  // as they came
  std::vector<Received> frames;           // all that came since the last clear()

  void send(protocol::Kind kind, std::uint16_t number, std::uint8_t flags,
            const std::vector<std::uint8_t>& body) {
    std::vector<std::uint8_t> wire(protocol::kMaxWire);
    wire.resize(protocol::encode_frame({protocol::kProtoMajor, kind, number, ack, credit, flags},
                                       {body.data(), body.size()}, {wire.data(), wire.size()}));
    board_.write(wire);
  }

  static std::vector<std::uint8_t> bytes_of(const symrig_wire_Request& request) {
    protocol::BodyBuffer body{};
    const std::size_t size = encode(request, body);
    return {body.bytes, body.bytes + size};
  }

  /// Takes what the board has sent. Events are counted as received.
  void listen() {
    for (const std::uint8_t byte : board_.read()) {
      if (decoder_.push(byte) != protocol::FrameDecoder::Event::frame) continue;
      const protocol::Frame& frame = decoder_.frame();
      frames.push_back({frame.header, {frame.body.data, frame.body.data + frame.body.size}});
      if (frame.header.kind != protocol::Kind::event || frame.header.seq != ack) continue;
      ++ack;
      symrig_wire_Event event;
      if (protocol::decode(frame.body, event)) events.push_back(event);
    }
  }

  /// Sends a request in turn; the reply to it, if one came.
  std::optional<symrig_wire_Reply> ask(const symrig_wire_Request& request, std::uint8_t flags = 0) {
    return ask_bytes(bytes_of(request), flags);
  }
  std::optional<symrig_wire_Reply> ask_bytes(const std::vector<std::uint8_t>& body, std::uint8_t flags = 0) {
    listen();
    frames.clear();
    send(protocol::Kind::request, seq, flags, body);
    if (flags != protocol::flag::urgent) ++seq;
    listen();
    return last_reply();
  }
  std::optional<symrig_wire_Reply> last_reply() const {
    std::optional<symrig_wire_Reply> last;
    for (const Received& frame : frames) {
      symrig_wire_Reply reply;
      const bool is_reply = frame.header.kind == protocol::Kind::reply;
      if (is_reply && protocol::decode({frame.body.data(), frame.body.size()}, reply)) last = reply;
    }
    return last;
  }
  /// Code of the reply, 999 if none came.
  std::uint32_t code(const symrig_wire_Request& request) {
    const auto reply = ask(request);
    return reply ? protocol::raw(reply->code) : 999;
  }

  static symrig_wire_Request make(pb_size_t which) {
    symrig_wire_Request request = symrig_wire_Request_init_zero;
    request.which_body = which;
    if (which == symrig_wire_Request_start_tag) request.body.start = {symrig_wire_Start_now_tag, {true}};
    return request;
  }

  std::optional<symrig_wire_Reply> hello() {
    return ask(make(symrig_wire_Request_hello_tag), protocol::flag::sync);
  }

  std::uint32_t reset_config() { return code(make(symrig_wire_Request_reset_config_tag)); }
  std::uint32_t config_line(std::uint32_t line, const protocol::LineConfig& config) {
    symrig_wire_Request request = make(symrig_wire_Request_config_line_tag);
    request.body.config_line = {
        line,
        config.output ? symrig_wire_Direction_DIRECTION_OUTPUT : symrig_wire_Direction_DIRECTION_INPUT,
        static_cast<symrig_wire_LineRole>(config.role),
        static_cast<symrig_wire_Hazard>(config.hazard),
        config.safe_level,
        config.capture,
        config.max_on,
        config.min_off,
        config.max_duty_permille,
        config.trip_level};
    return code(request);
  }
  std::uint32_t finalize(std::uint32_t hash) {
    symrig_wire_Request request = make(symrig_wire_Request_finalize_config_tag);
    request.body.finalize_config.hash = hash;
    return code(request);
  }
  /// reset, all configured lines, finalize. The first code that is not OK.
  std::uint32_t configure(const protocol::BoardConfig& config) {
    if (const std::uint32_t bad = reset_config()) return bad;
    for (std::uint32_t k = 0; k < protocol::kMaxLines; ++k)
      if (config.lines[k].configured)
        if (const std::uint32_t bad = config_line(k, config.lines[k])) return bad;
    config_hash = protocol::config_hash(config);
    return finalize(config_hash);
  }

  std::uint32_t begin(std::uint32_t id, std::uint32_t length) {
    symrig_wire_Request request = make(symrig_wire_Request_program_begin_tag);
    request.body.program_begin = {id, length};
    return code(request);
  }
  void chunk(std::uint32_t id, std::uint32_t offset, const std::vector<std::uint8_t>& bytes) {
    std::vector<std::uint8_t> body(protocol::kMaxBody);
    body.resize(
        protocol::encode_chunk({id, offset, {bytes.data(), bytes.size()}}, {body.data(), body.size()}));
    listen();
    frames.clear();
    send(protocol::Kind::data, seq++, 0, body);
    listen();
  }
  std::uint32_t commit(std::uint32_t id, std::uint32_t crc) {
    symrig_wire_Request request = make(symrig_wire_Request_program_commit_tag);
    request.body.program_commit = {id, crc};
    return code(request);
  }
  std::uint32_t upload(const std::vector<std::uint8_t>& program) {
    if (const std::uint32_t bad = begin(1, static_cast<std::uint32_t>(program.size()))) return bad;
    for (std::size_t at = 0; at < program.size(); at += protocol::kMaxChunk) {
      const std::size_t end = std::min(program.size(), at + protocol::kMaxChunk);
      chunk(1, static_cast<std::uint32_t>(at),
            {program.begin() + static_cast<std::ptrdiff_t>(at),
             program.begin() + static_cast<std::ptrdiff_t>(end)});
    }
    program_hash = protocol::crc32c({program.data(), program.size()});
    return commit(1, program_hash);
  }

  std::uint32_t arm(bool autonomous = false) {
    symrig_wire_Request request = make(symrig_wire_Request_arm_tag);
    request.body.arm = {program_hash, config_hash, autonomous};
    return code(request);
  }
  std::uint32_t set_by_hand(std::uint32_t mask, std::uint32_t levels) {
    symrig_wire_Request request = make(symrig_wire_Request_manual_set_tag);
    request.body.manual_set = {mask, levels};
    return code(request);
  }
  std::uint32_t start() { return code(make(symrig_wire_Request_start_tag)); }
  std::uint32_t start_at(std::uint64_t tick) {
    symrig_wire_Request request = make(symrig_wire_Request_start_tag);
    request.body.start.which_when = symrig_wire_Start_at_tick_tag;
    request.body.start.when.at_tick = tick;
    return code(request);
  }
  std::uint32_t keep_alive(std::uint32_t ttl_ms) {
    symrig_wire_Request request = make(symrig_wire_Request_keep_alive_tag);
    request.body.keep_alive.ttl_ms = ttl_ms;
    return code(request);
  }
  std::uint32_t clear_fault(std::uint32_t fault) {
    symrig_wire_Request request = make(symrig_wire_Request_clear_fault_tag);
    request.body.clear_fault.code = fault;
    return code(request);
  }
  void abort() { ask(make(symrig_wire_Request_abort_tag), protocol::flag::urgent); }

  symrig_wire_StatusReply status() {
    const auto reply = ask(make(symrig_wire_Request_get_status_tag));
    return reply ? reply->body.status : symrig_wire_StatusReply symrig_wire_StatusReply_init_zero;
  }
  symrig_wire_State state() { return status().state; }

  /// Lets the board run until RunDone has come, at most `ticks`. Events are acknowledged as they come.
  bool run_out(std::uint64_t ticks) {
    const std::uint64_t deadline = board_.now() + ticks;
    while (!done() && board_.next_event() <= deadline) {
      board_.advance();
      const std::uint16_t before = ack;
      listen();
      frames.clear();
      if (ack != before) send(protocol::Kind::ack, seq, 0, {});
    }
    return done();
  }
  bool done() const {
    return std::any_of(events.begin(), events.end(), [](const symrig_wire_Event& event) {
      return event.which_body == symrig_wire_Event_run_done_tag;
    });
  }
  /// The last event of a kind, if any came.
  const symrig_wire_Event* last(pb_size_t which) const {
    const auto found = std::find_if(events.rbegin(), events.rend(), [which](const symrig_wire_Event& event) {
      return event.which_body == which;
    });
    return found == events.rend() ? nullptr : &*found;
  }

  std::uint32_t config_hash = 0;
  std::uint32_t program_hash = 0;

 private:
  board_sim::SimBoard& board_;
  protocol::FrameDecoder decoder_;
};

/// The default board with nothing limited: lines 0..2 outputs, 3 and 4 inputs.
inline protocol::BoardConfig plain_config() {
  protocol::BoardConfig config;
  for (unsigned k = 0; k < 5; ++k) {
    config.lines[k].configured = true;
    config.lines[k].output = k < 3;
  }
  return config;
}

/// Every change of the outputs, as something wired to them sees it.
class Recorder final : public board_sim::Peripheral {
 public:
  struct Change {
    std::uint64_t tick;
    std::uint32_t levels;
    bool operator==(const Change&) const = default;
  };
  std::vector<Change> changes;

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard&) override {
    changes.push_back({tick, levels & 7U});
  }
  std::uint64_t next_event() const override { return board_sim::kNever; }
  void on_event(std::uint64_t, board_sim::SimBoard&) override {}
};

/// Turns the inputs 3 and 4 all the time.
class Chatter final : public board_sim::Peripheral {
 public:
  /// half_period: ticks.
  explicit Chatter(std::uint64_t half_period) : half_period_(half_period) {}
  /// The configuration, with the edges of these inputs logged.
  static protocol::BoardConfig captured(protocol::BoardConfig config) {
    for (const int line : {3, 4}) {
      config.lines[line].configured = true;
      config.lines[line].capture = true;
    }
    return config;
  }

  void outputs_changed(std::uint64_t, std::uint32_t, board_sim::SimBoard&) override {}
  std::uint64_t next_event() const override { return next_; }
  void on_event(std::uint64_t tick, board_sim::SimBoard& board) override {
    level_ = !level_;
    for (const int line : {3, 4}) board.set_input(line, level_);
    next_ = tick + half_period_;
  }

 private:
  std::uint64_t half_period_, next_ = 1'000;
  bool level_ = false;
};

}  // namespace symrig::test
