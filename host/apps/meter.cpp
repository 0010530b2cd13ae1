// SPDX-License-Identifier: Apache-2.0
#include "meter.hpp"

#include "console.hpp"
#include "symrig/base/standard_streams.hpp"
#include "terminal_line.hpp"

#include <array>
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

/// A terminal that closes sends SIGHUP twice (the kernel and the shell), so the second signal must not end
/// the process at once. Under nohup the signal stays ignored.
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
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // a second signal ends the process
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  catch_hang_up();
}

bool interrupted() {
  return stop_asked;
}

Meter::Meter(std::string command, std::string unit)
    : command_(std::move(command)), unit_(std::move(unit)), terminal_(isatty(STDERR_FILENO) == 1) {}

Meter::~Meter() {
  if (shown_) write_standard_error("\r\033[K");
}

void Meter::say(const std::string& text) {
  if (terminal_) write_standard_error(fmt::format("\r\033[Ksymrig {}: {}\n", command_, text));
}

Progress Meter::progress() {
  return [this](const ProgressEvent& event) { return report(event); };
}

bool Meter::report(const ProgressEvent& event) {
  if (!terminal_) return !interrupted();
  const double seconds = watch_.seconds();
  to_go_.report(event, seconds);
  const bool new_stage = event.stage != stage_;
  if (!next_.passed() && !new_stage) return !interrupted();
  stage_ = event.stage;
  next_ = Deadline(std::chrono::milliseconds(100));
  shown_ = true;
  write_standard_error(fmt::format("\r\033[K{}", line(event, seconds)));
  return !interrupted();
}

/// "symrig capture: level 5, 120 of 318 photographs, 12 s, about 20 s to go", or a shorter form on a narrow
/// terminal. The last column stays free, because some terminals wrap when it is written.
std::string Meter::line(const ProgressEvent& event, double seconds) const {
  std::string count = fmt::format("{}", event.done);
  if (event.expected > 0) count += fmt::format(" of {}", event.expected);
  const auto left = to_go_.seconds();
  const std::string to_go = left ? fmt::format(", about {} to go", duration(*left)) : std::string();
  const std::string counted = fmt::format("{}, {} {}", stage_, count, unit_);
  const std::array<std::string, 4> forms{
      fmt::format("symrig {}: {}, {}{}", command_, counted, duration(seconds), to_go),
      fmt::format("{}, {}{}", counted, duration(seconds), to_go),
      left ? fmt::format("{}, {}{}", stage_, count, to_go) : counted,
      left ? fmt::format("{}{}", count, to_go) : counted};
  return fitting(forms, terminal_columns(STDERR_FILENO) - 1);
}

}  // namespace symrig::apps
