// SPDX-License-Identifier: Apache-2.0
// The public class: it forwards every call to its session.
#include "symrig/board/board.hpp"

#include "board/session/session.hpp"

#include <utility>

namespace symrig {

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
