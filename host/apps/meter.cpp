// SPDX-License-Identifier: Apache-2.0
#include "meter.hpp"

#include "console.hpp"
#include "symrig/base/standard_streams.hpp"

#include <atomic>
#include <csignal>

#include <fmt/format.h>
#include <unistd.h>

namespace symrig::apps {
namespace {

std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

extern "C" void on_signal(int) {
  stop_asked = true;
}

/// A terminal that closes sends the signal twice (the kernel and the shell), so the second one is no wish to
/// end at once. Under nohup it stays ignored.
void catch_hang_up() {
  struct sigaction action {};
  sigaction(SIGHUP, nullptr, &action);
  if (action.sa_handler == SIG_IGN) return;
  action = {};
  action.sa_handler = on_signal;
  sigaction(SIGHUP, &action, nullptr);
}

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // the second one finds the default: the process ends
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  catch_hang_up();
}

bool interrupted() {
  return stop_asked;
}

Meter::Meter(std::string command, std::string unit)
    : command_(std::move(command)),
      unit_(std::move(unit)),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      stage_start_(start_),
      next_(start_) {}

Meter::~Meter() {
  if (shown_) write_standard_error("\r\033[K");
}

Progress Meter::progress() {
  return [this](const ProgressEvent& event) { return report(event); };
}

bool Meter::report(const ProgressEvent& event) {
  if (!terminal_) return !interrupted();
  const auto now = Clock::now();
  if (event.stage != stage_) enter_stage(event, now);
  if (now < next_) return !interrupted();
  next_ = now + std::chrono::milliseconds(100);
  shown_ = true;
  write_standard_error(fmt::format("\r\033[K{}", line(event, now)));
  return !interrupted();
}

void Meter::enter_stage(const ProgressEvent& event, Clock::time_point now) {
  stage_ = event.stage;
  stage_first_ = event.done;
  stage_start_ = now;
  next_ = now;
}

/// "symrig capture: level 5, 120 of 318 photographs, 12 s, about 20 s to go". What later levels need is not
/// known before this one is judged: the time to go is that of what is planned so far.
std::string Meter::line(const ProgressEvent& event, Clock::time_point now) const {
  std::string text = fmt::format("symrig {}: {}, {}", command_, stage_, event.done);
  if (event.expected > 0) text += fmt::format(" of {}", event.expected);
  text += fmt::format(" {}, {}", unit_, duration(std::chrono::duration<double>(now - start_).count()));
  const double in_stage = std::chrono::duration<double>(now - stage_start_).count();
  const auto done = static_cast<double>(event.done - stage_first_);
  const auto left = static_cast<double>(event.expected - event.done);
  if (done > 0 && left > 0) text += fmt::format(", about {} to go", duration(in_stage / done * left));
  return text;
}

}  // namespace symrig::apps
