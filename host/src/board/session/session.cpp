// SPDX-License-Identifier: Apache-2.0
#include "board/session/session.hpp"

#include "symrig/base/time.hpp"
#include "symrig/board/internal/board_forms.hpp"
#include "symrig/board/internal/explain.hpp"
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/messages.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

symrig_wire_Request make_request(pb_size_t body) {
  symrig_wire_Request request = symrig_wire_Request_init_zero;
  request.which_body = body;
  return request;
}

Error nonsense(std::string_view name) {
  return {ErrorCode::protocol, fmt::format("the board's answer to {} is not valid", name),
          "host and board have different schemas: update the older one"};
}

symrig_wire_ConfigLine to_wire(std::uint32_t line, const protocol::LineConfig& config) {
  symrig_wire_ConfigLine out = symrig_wire_ConfigLine_init_zero;
  out.line = line;
  out.direction =
      config.output ? symrig_wire_Direction_DIRECTION_OUTPUT : symrig_wire_Direction_DIRECTION_INPUT;
  out.role = static_cast<symrig_wire_LineRole>(config.role);
  out.hazard = static_cast<symrig_wire_Hazard>(config.hazard);
  out.safe_level = config.safe_level;
  out.capture = config.capture;
  out.max_on = config.max_on;
  out.min_off = config.min_off;
  out.max_duty_permille = config.max_duty_permille;
  out.trip_level = config.trip_level;
  return out;
}

constexpr std::uint32_t kKnownRequired = 0;  // bits of Hello.required that this host understands

}  // namespace

Board::Session::Session(std::unique_ptr<Link> link, const BoardOptions& options)
    : options_(options),
      wire_(std::move(link), options, [this](const symrig_wire_Event& event) { log_.take(event); }) {}

Result<symrig_wire_Reply> Board::Session::ask(const symrig_wire_Request& request, std::string_view name) {
  SYMRIG_TRY(auto reply, wire_.request(request));
  if (protocol::raw(reply.code) != symrig_wire_Code_CODE_OK)
    return board::explain_refusal(reply, name, info_);
  return reply;
}

Result<void> Board::Session::introduce() {
  info_ = {};
  has_program_ = false;
  ttl_ = {};
  SYMRIG_CHECK(learn_identity());
  SYMRIG_CHECK(learn_capabilities());
  const std::size_t lines = info_.lines.size();
  for (std::uint32_t k = 0; k < lines; ++k) SYMRIG_CHECK(learn_line(k));
  return {};
}

Result<void> Board::Session::learn_identity() {
  SYMRIG_TRY(const auto reply, wire_.hello());
  if (protocol::raw(reply.code) == symrig_wire_Code_CODE_BUSY)
    return Error{ErrorCode::device_refused, "the board is in use by another program",
                 std::string(board::explain_code(symrig_wire_Code_CODE_BUSY).hint)};
  if (reply.which_body != symrig_wire_Reply_hello_tag) return nonsense("hello");
  const symrig_wire_HelloReply& hello = reply.body.hello;
  info_.board = hello.board;
  info_.firmware_version = hello.firmware_version;
  info_.firmware_hash = hello.firmware_hash;
  info_.schema_hash = hello.schema_hash;
  info_.protocol_major = hello.proto_major;
  info_.protocol_minor = hello.proto_minor;
  info_.features = hello.features;
  info_.required = hello.required;
  for (pb_size_t i = 0; i < hello.unique_id.size; ++i)
    info_.unique_id += fmt::format("{:02x}", hello.unique_id.bytes[i]);
  reboot_token_ = protocol::crc32c({hello.unique_id.bytes, hello.unique_id.size});
  if (info_.protocol_major != protocol::kProtoMajor)
    return Error{ErrorCode::protocol,
                 fmt::format("board '{}' uses protocol {}, this host {}", info_.board, info_.protocol_major,
                             protocol::kProtoMajor),
                 "update the older one"};
  if ((info_.required & ~kKnownRequired) != 0)
    return Error{ErrorCode::protocol,
                 fmt::format("board '{}' requires features {:#x} that this host does not know", info_.board,
                             info_.required & ~kKnownRequired),
                 "update the host"};
  return {};
}

Result<void> Board::Session::learn_capabilities() {
  SYMRIG_TRY(const auto reply, ask(make_request(symrig_wire_Request_capabilities_tag), "capabilities"));
  const symrig_wire_CapabilitiesReply& can = reply.body.capabilities;
  const bool sound = reply.which_body == symrig_wire_Reply_capabilities_tag &&
                     can.lines <= protocol::kMaxLines && can.tick_hz >= 1000 &&
                     can.tick_hz <= 10'000'000'000U && can.min_dwell >= 1 &&
                     can.max_dwell >= 2 * std::uint64_t{can.min_dwell} &&
                     can.loop_depth <= protocol::kMaxLoopDepth && can.mtu >= protocol::kLeastMtu;
  if (!sound) return nonsense("capabilities");
  info_.rate = {can.tick_hz};
  info_.lines.assign(can.lines, {});
  info_.min_dwell = {can.min_dwell};
  info_.max_dwell = {can.max_dwell};
  info_.wait_latency = {can.wait_latency};
  info_.program_bytes = can.program_bytes;
  info_.loop_depth = can.loop_depth;
  info_.mtu = can.mtu;
  info_.window = can.window;
  info_.queue_segments = can.queue_segments;
  info_.refill_ticks = can.refill_ticks;
  info_.poll_ticks = can.poll_ticks;
  info_.lateness = {can.lateness};
  info_.label = can.label;
  return {};
}

Result<void> Board::Session::learn_line(std::uint32_t line) {
  symrig_wire_Request request = make_request(symrig_wire_Request_capabilities_line_tag);
  request.body.capabilities_line.line = line;
  SYMRIG_TRY(const auto reply, ask(request, "capabilities"));
  if (reply.which_body != symrig_wire_Reply_line_tag) return nonsense("capabilities");
  const symrig_wire_LineReply& answer = reply.body.line;
  info_.lines[line] = {
      answer.name,  protocol::raw(answer.direction) == symrig_wire_Direction_DIRECTION_OUTPUT,
      answer.pin,   static_cast<std::uint8_t>(answer.waits & 7U),
      answer.trips, answer.stamp_ticks};
  return {};
}

Result<void> Board::Session::configure(std::span<const LineConfig> lines) {
  SYMRIG_TRY(const auto config, board::line_setup(info_, lines));
  has_program_ = false;
  SYMRIG_CHECK(ask(make_request(symrig_wire_Request_reset_config_tag), "the configuration"));
  for (std::uint32_t k = 0; k < info_.lines.size(); ++k) {
    symrig_wire_Request request = make_request(symrig_wire_Request_config_line_tag);
    request.body.config_line = to_wire(k, config.lines[k]);
    SYMRIG_CHECK(ask(request, fmt::format("the configuration of {}", board::line_text(info_, k))));
  }
  symrig_wire_Request request = make_request(symrig_wire_Request_finalize_config_tag);
  config_hash_ = protocol::config_hash(config);
  request.body.finalize_config.hash = config_hash_;
  SYMRIG_CHECK(ask(request, "the configuration"));
  return {};
}

Result<bool> Board::Session::holds(const Program& program) {
  if (!has_program_ || program_hash_ != program.hash()) return false;
  SYMRIG_TRY(const auto now, status());
  const bool ready = now.state == BoardState::loaded || now.state == BoardState::done;
  return ready && now.program_hash == program_hash_ && now.config_hash == config_hash_;
}

Result<void> Board::Session::upload(const Program& program) {
  SYMRIG_TRY(const bool held, holds(program));
  if (held) return {};
  has_program_ = false;
  symrig_wire_Request request = make_request(symrig_wire_Request_program_begin_tag);
  const std::uint32_t program_id = next_program_id_++;
  request.body.program_begin = {program_id, static_cast<std::uint32_t>(program.bytes().size())};
  SYMRIG_CHECK(ask(request, "the program"));
  SYMRIG_TRY(const auto refused, wire_.send_chunks(program_id, program.bytes(), {info_.mtu, info_.window}));
  if (refused) return board::explain_refusal(*refused, "the program", info_);
  return commit(program_id, program.hash());
}

Result<void> Board::Session::commit(std::uint32_t program_id, std::uint32_t hash) {
  symrig_wire_Request request = make_request(symrig_wire_Request_program_commit_tag);
  request.body.program_commit = {program_id, hash};
  SYMRIG_TRY(const auto reply, ask(request, "the program"));
  if (reply.which_body != symrig_wire_Reply_commit_tag || reply.body.commit.program_hash != hash)
    return nonsense("commit");
  committed_ = reply.body.commit;
  program_hash_ = hash;
  has_program_ = true;
  return {};
}

Result<void> Board::Session::arm(bool autonomous) {
  if (options_.keep_alive.count() > 0) SYMRIG_CHECK(keep_alive(options_.keep_alive));
  symrig_wire_Request request = make_request(symrig_wire_Request_arm_tag);
  request.body.arm = {program_hash_, config_hash_, autonomous};
  SYMRIG_CHECK(ask(request, "to arm"));
  return {};
}

Result<void> Board::Session::start(std::optional<Ticks> at) {
  Receipt blank;
  blank.program_hash = program_hash_;
  blank.config_hash = config_hash_;
  blank.firmware_hash = info_.firmware_hash;
  blank.rate = info_.rate;
  blank.planned_min = {committed_.planned_min};
  blank.planned_max = {committed_.planned_max};
  blank.end = RunEnd::lost;
  log_.open(blank);
  symrig_wire_Request request = make_request(symrig_wire_Request_start_tag);
  if (at) {
    request.body.start.which_when = symrig_wire_Start_at_tick_tag;
    request.body.start.when.at_tick = at->count;
  } else {
    request.body.start.which_when = symrig_wire_Start_now_tag;
    request.body.start.when.now = true;
  }
  SYMRIG_CHECK(ask(request, "to start"));
  return {};
}

/// Repeats the keep-alive three times as often as the board requires it.
Result<void> Board::Session::stay_alive() {
  if (ttl_.count() == 0 || wire_.now() - last_alive_ < ttl_ / 3) return {};
  return keep_alive(ttl_);
}

Result<Receipt> Board::Session::wait(Nanoseconds timeout) {
  const Nanoseconds deadline = wire_.now() + timeout;
  while (!log_.finished()) {
    const Nanoseconds left = deadline - wire_.now();
    if (left.count() <= 0)
      return Error{ErrorCode::timeout,
                   fmt::format("the run has not ended within {}", base::duration_text(timeout)),
                   "wait longer, or abort it"};
    SYMRIG_CHECK(stay_alive());
    if (log_.finished()) break;
    const Nanoseconds slice = ttl_.count() == 0 ? left : std::min(left, ttl_ / 3);
    SYMRIG_CHECK(wire_.listen(slice));
  }
  return log_.receipt();
}

Result<void> Board::Session::abort() {
  SYMRIG_TRY(const auto reply, wire_.urgent(make_request(symrig_wire_Request_abort_tag)));
  if (protocol::raw(reply.code) != symrig_wire_Code_CODE_OK)
    return board::explain_refusal(reply, "to abort", info_);
  return {};
}

Result<void> Board::Session::clear_fault() {
  SYMRIG_TRY(const auto now, status());
  symrig_wire_Request request = make_request(symrig_wire_Request_clear_fault_tag);
  request.body.clear_fault.code = now.fault ? now.fault->code : 0;
  SYMRIG_CHECK(ask(request, "to clear the fault"));
  return {};
}

Result<BoardStatus> Board::Session::status() {
  SYMRIG_TRY(const auto reply, ask(make_request(symrig_wire_Request_get_status_tag), "status"));
  if (reply.which_body != symrig_wire_Reply_status_tag) return nonsense("status");
  const symrig_wire_StatusReply& now = reply.body.status;
  if (protocol::raw(now.state) > static_cast<std::uint32_t>(BoardState::fault)) return nonsense("status");
  BoardStatus status;
  status.state = static_cast<BoardState>(protocol::raw(now.state));
  status.config_hash = now.config_hash;
  status.program_hash = now.program_hash;
  status.now = {now.tick};
  status.levels = now.levels;
  status.bad_frames = now.bad_frames;
  if (now.has_fault) status.fault = board::to_fault(now.fault);
  const std::uint32_t cause = protocol::raw(now.reset_cause);
  if (cause <= static_cast<std::uint32_t>(ResetCause::request))
    status.reset_cause = static_cast<ResetCause>(cause);
  if (now.has_reset_fault) status.reset_fault = board::to_fault(now.reset_fault);
  status.stored_config = now.stored_config;
  return status;
}

Result<void> Board::Session::keep_alive(Nanoseconds ttl) {
  symrig_wire_Request request = make_request(symrig_wire_Request_keep_alive_tag);
  const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(ttl).count();
  request.body.keep_alive.ttl_ms =
      static_cast<std::uint32_t>(std::clamp<std::int64_t>(milliseconds, 0, UINT32_MAX));
  last_alive_ = wire_.now();
  SYMRIG_CHECK(ask(request, "a keep-alive"));
  ttl_ = ttl;
  return {};
}

Result<TimeReading> Board::Session::time() {
  symrig_wire_Request request = make_request(symrig_wire_Request_time_ping_tag);
  TimeReading reading{};
  reading.sent = {wire_.now()};
  request.body.time_ping.host_ns = static_cast<std::uint64_t>(reading.sent.since.count());
  SYMRIG_TRY(const auto reply, ask(request, "the time"));
  reading.received = {wire_.now()};
  const symrig_wire_TimeReply& time = reply.body.time;
  if (reply.which_body != symrig_wire_Reply_time_tag || time.host_ns != request.body.time_ping.host_ns)
    return nonsense("time");
  reading.taken = {Ticks{time.rx_tick}};
  reading.answered = {Ticks{time.tx_tick}};
  return reading;
}

Result<void> Board::Session::idle(Nanoseconds duration) {
  const Nanoseconds deadline = wire_.now() + duration;
  for (Nanoseconds left = duration; left.count() > 0; left = deadline - wire_.now())
    SYMRIG_CHECK(wire_.listen(left));
  return {};
}

Result<std::uint32_t> Board::Session::find_line(std::string_view line, bool output) const {
  const int index = info_.line(line);
  if (index >= 0 && info_.lines[index].output == output) return static_cast<std::uint32_t>(index);
  return Error{ErrorCode::unknown_name,
               fmt::format("the board has no {} '{}'", output ? "output" : "input", line),
               board::line_hint(info_, line, output)};
}

Result<LineUse> Board::Session::line_use(std::string_view line) {
  symrig_wire_Request request = make_request(symrig_wire_Request_program_line_tag);
  SYMRIG_TRY(request.body.program_line.line, find_line(line, true));
  SYMRIG_TRY(const auto reply, ask(request, "the use of a line"));
  if (reply.which_body != symrig_wire_Reply_line_use_tag) return nonsense("the use of a line");
  const symrig_wire_LineUse& use = reply.body.line_use;
  return LineUse{{use.worst_on}, static_cast<double>(use.worst_duty_permille) / 1000};
}

Result<void> Board::Session::verify_program() {
  SYMRIG_CHECK(ask(make_request(symrig_wire_Request_program_verify_tag), "to verify the program"));
  return {};
}

Result<void> Board::Session::set_line(std::string_view line, bool level) {
  SYMRIG_TRY(const std::uint32_t index, find_line(line, true));
  symrig_wire_Request request = make_request(symrig_wire_Request_manual_set_tag);
  const std::uint32_t bit = 1U << index;
  request.body.manual_set = {bit, level ? bit : 0};
  SYMRIG_CHECK(ask(request, "to set a line by hand"));
  return {};
}

Result<void> Board::Session::identify(Nanoseconds duration) {
  symrig_wire_Request request = make_request(symrig_wire_Request_identify_tag);
  const auto seconds = std::chrono::ceil<std::chrono::seconds>(duration).count();
  request.body.identify.seconds =
      static_cast<std::uint32_t>(std::clamp<std::int64_t>(seconds, 0, UINT32_MAX));
  SYMRIG_CHECK(ask(request, "to identify"));
  return {};
}

Result<void> Board::Session::store_config(std::string_view label) {
  symrig_wire_Request request = make_request(symrig_wire_Request_store_config_tag);
  constexpr std::size_t kRoom = sizeof request.body.store_config.label - 1;
  if (label.size() > kRoom)
    return Error{ErrorCode::bad_argument, fmt::format("the label '{}' is too long", label),
                 fmt::format("use at most {} bytes", kRoom)};
  label.copy(request.body.store_config.label, label.size());
  SYMRIG_CHECK(ask(request, "to store its configuration"));
  info_.label = label;
  return {};
}

Result<void> Board::Session::reboot(bool bootloader) {
  symrig_wire_Request request = make_request(symrig_wire_Request_reboot_tag);
  request.body.reboot = {reboot_token_, bootloader, false};
  SYMRIG_CHECK(ask(request, "to restart"));
  return {};
}

Result<void> Board::Session::starve_watchdog() {
  symrig_wire_Request request = make_request(symrig_wire_Request_reboot_tag);
  request.body.reboot = {reboot_token_, false, true};
  SYMRIG_CHECK(ask(request, "to starve its watchdog"));
  return {};
}

}  // namespace symrig
