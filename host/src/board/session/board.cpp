// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/board.hpp"

#include "board/session/session.hpp"
#include "symrig/board/internal/explain.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig::board {

FaultInfo to_fault(const symrig_wire_Fault& fault) {
  const std::uint32_t code = protocol::raw(fault.code);
  const Explained explained = explain_fault(code);
  return {code, Ticks{fault.tick}, fault.arg, std::string(explained.name), std::string(explained.hint)};
}

void RunLog::open(const Receipt& blank) {
  receipt_ = blank;
  started_ = false;
  finished_ = false;
}

void RunLog::take(const symrig_wire_Event& event) {
  if (event.which_body == symrig_wire_Event_run_started_tag) {
    started_ = true;
    receipt_.started = Ticks{event.body.run_started.tick};
  }
  if (!started_ || finished_) return;  // an event of an earlier run, or between runs
  switch (event.which_body) {
    case symrig_wire_Event_step_mark_tag: {
      const symrig_wire_StepMark& mark = event.body.step_mark;
      receipt_.marks.push_back({mark.id, mark.ordinal, Ticks{mark.tick}});
      if (on_mark) on_mark(receipt_.marks.back());
      return;
    }
    case symrig_wire_Event_edge_tag:
      receipt_.edges.push_back(
          {static_cast<int>(event.body.edge.line), event.body.edge.level, Ticks{event.body.edge.tick}});
      return;
    case symrig_wire_Event_fault_tag:
      receipt_.fault = to_fault(event.body.fault);
      return;
    case symrig_wire_Event_run_done_tag:
      return take_done(event.body.run_done);
    default:
      return;  // RunDone counts EventsLost again; other events come from newer boards
  }
}

void RunLog::take_done(const symrig_wire_RunDone& done) {
  finished_ = true;
  const std::uint32_t end = protocol::raw(done.end);
  receipt_.end = end <= static_cast<std::uint32_t>(RunEnd::fault) ? static_cast<RunEnd>(end) : RunEnd::fault;
  receipt_.actual = Ticks{done.duration};
  receipt_.steps = done.steps;
  receipt_.underruns = done.underruns;
  receipt_.late = done.late;
  receipt_.events_lost = done.events_lost;
}

}  // namespace symrig::board

namespace symrig {
namespace {

BoardCrash to_crash(const symrig_wire_Crash& crash) {
  return {crash.exception, crash.pc, crash.lr,
          crash.psr,       crash.sp, {crash.r0, crash.r1, crash.r2, crash.r3, crash.r12}};
}

/// The RP2040's revision number of B0 and B1; B2 has 2.
constexpr std::uint32_t kRp2040B1 = 1;

}  // namespace

Result<std::optional<BoardDiagnostics>> Board::Session::diagnostics() {
  symrig_wire_Request request = symrig_wire_Request_init_zero;
  request.which_body = symrig_wire_Request_get_diagnostics_tag;
  SYMRIG_TRY(const auto reply, wire_.request(request));
  if (protocol::raw(reply.code) == symrig_wire_Code_CODE_UNKNOWN_REQUEST)
    return std::optional<BoardDiagnostics>();
  if (protocol::raw(reply.code) != symrig_wire_Code_CODE_OK)
    return board::explain_refusal(reply, "diagnostics", info_);
  if (reply.which_body != symrig_wire_Reply_diagnostics_tag)
    return Error{ErrorCode::protocol, "the board's answer to diagnostics is not valid",
                 "host and board have different schemas: update the older one"};
  const symrig_wire_DiagnosticsReply& told = reply.body.diagnostics;
  BoardDiagnostics found{told.longest_round, told.worst_refill,    told.flash_reads,
                         told.flash_hits,    told.queue_overflows, told.dma_errors,
                         told.stack_free,    told.chip_revision,   {}};
  if (told.has_crash) found.crash = to_crash(told.crash);
  return std::optional(found);
}

std::vector<std::string> BoardDiagnostics::objections(const BoardInfo& info) const {
  std::vector<std::string> found;
  if (longest_round > info.poll_ticks)
    found.push_back(
        fmt::format("a round of the main loop took {} ticks, but the board promises {}: programs "
                    "that it accepts may run out of words",
                    longest_round, info.poll_ticks));
  if (worst_refill > info.refill_ticks)
    found.push_back(
        fmt::format("a refill took {} ticks a record, but the board promises {}: programs that it "
                    "accepts may run out of words",
                    worst_refill, info.refill_ticks));
  if (queue_overflows > 0)
    found.push_back(fmt::format("{} words went to a full queue and were lost", queue_overflows));
  if (dma_errors > 0) found.push_back(fmt::format("DMA stopped by a bus error, {} times", dma_errors));
  if (info.board == "pico" && chip_revision == kRp2040B1)
    found.emplace_back(
        "the chip is older than B2: on a busy bus, USB may not come up (erratum RP2040-E5); use a newer "
        "Pico");
  return found;
}

// The public class: it forwards every call to its session.

Board::Board(std::unique_ptr<Session> session) : session_(std::move(session)) {}
Board::Board(Board&&) noexcept = default;
Board& Board::operator=(Board&&) noexcept = default;
Board::~Board() = default;

Result<Board> Board::connect(std::unique_ptr<Link> link, const BoardOptions& options) {
  auto session = std::make_unique<Session>(std::move(link), options);
  SYMRIG_CHECK(session->introduce());
  return Board(std::move(session));
}

const BoardInfo& Board::info() const {
  return session_->info();
}
Result<void> Board::configure(std::span<const LineConfig> lines) {
  return session_->configure(lines);
}
Result<void> Board::upload(const Program& program) {
  return session_->upload(program);
}
Result<void> Board::arm() {
  return session_->arm(false);
}
Result<void> Board::arm_autonomous() {
  return session_->arm(true);
}
Result<void> Board::start() {
  return session_->start(std::nullopt);
}
Result<void> Board::start_at(Ticks tick) {
  return session_->start(tick);
}
Result<Receipt> Board::wait(Nanoseconds timeout) {
  return session_->wait(timeout);
}
Receipt Board::so_far() const {
  return session_->so_far();
}

Result<Receipt> Board::run(const Program& program, Nanoseconds timeout) {
  SYMRIG_CHECK(upload(program));
  SYMRIG_CHECK(arm());
  SYMRIG_CHECK(start());
  return wait(timeout);
}

Result<void> Board::abort() {
  return session_->abort();
}
Result<void> Board::clear_fault() {
  return session_->clear_fault();
}
Result<BoardStatus> Board::status() {
  return session_->status();
}

Result<std::optional<BoardDiagnostics>> Board::diagnostics() {
  return session_->diagnostics();
}
Result<void> Board::keep_alive(Nanoseconds ttl) {
  return session_->keep_alive(ttl);
}
Result<TimeReading> Board::time() {
  return session_->time();
}
SteadyTime Board::opened() const {
  return session_->opened();
}
Result<void> Board::idle(Nanoseconds duration) {
  return session_->idle(duration);
}
Result<LineUse> Board::line_use(std::string_view line) {
  return session_->line_use(line);
}
Result<void> Board::verify_program() {
  return session_->verify_program();
}
Result<void> Board::set_line(std::string_view line, bool level) {
  return session_->set_line(line, level);
}
Result<void> Board::identify(Nanoseconds duration) {
  return session_->identify(duration);
}
Result<void> Board::store_config(std::string_view label) {
  return session_->store_config(label);
}
Result<void> Board::reboot(bool bootloader) {
  return session_->reboot(bootloader);
}
Result<void> Board::starve_watchdog() {
  return session_->starve_watchdog();
}
Result<void> Board::rejoin() {
  return session_->introduce();
}
void Board::on_mark(std::function<void(const StepMark&)> callback) {
  session_->log().on_mark = std::move(callback);
}

}  // namespace symrig
