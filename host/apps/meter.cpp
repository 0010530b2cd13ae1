// SPDX-License-Identifier: Apache-2.0
#include "meter.hpp"

#include "options.hpp"
#include "output.hpp"
#include "symrig/base/files.hpp"
#include "terminal_line.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

namespace symrig::apps {
namespace {

constexpr const char* kPhotographs = "photographs";

bool json_wanted = false;  // set while the command line is read

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

void add_progress(CLI::App& command) {
  static constexpr std::array<std::string_view, 2> kForms{"line", "json"};
  const auto chosen = [](const std::string& form) {
    if (std::find(kForms.begin(), kForms.end(), form) == kForms.end())
      throw CLI::ValidationError("--progress", "'" + form + "' is none of: line, json");
    json_wanted = form == "json";
  };
  takes_words(command
                  .add_option_function<std::string>(
                      "--progress", chosen,
                      "How progress is shown on standard error: line (on a terminal, the default), or json "
                      "(an event a line, also in a pipe)")
                  ->type_name("FORM"),
              kForms);
}

Meter::Meter(std::string command, std::string unit)
    : command_(std::move(command)),
      unit_(std::move(unit)),
      json_(json_wanted),
      terminal_(!json_ && isatty(STDERR_FILENO) == 1) {}

Meter::~Meter() {
  if (shown_) write_standard_error("\r\033[K");
}

void Meter::say(const std::string& text) {
  if (terminal_) write_standard_error(fmt::format("\r\033[Ksymrig {}: {}\n", command_, text));
}

Progress Meter::progress() {
  return [this](const ProgressEvent& event) { return report(event); };
}

/// True for a new stage, and ten times a second. Where each event is a line, also for each unit.
bool Meter::is_news(const ProgressEvent& event) {
  const bool moved = event.done != done_ || event.steps.done != steps_;
  const bool now =
      event.stage != stage_ || (json_ ? event.done != done_ || (moved && next_.passed()) : next_.passed());
  if (!now) return false;
  stage_ = event.stage;
  next_ = Deadline(std::chrono::milliseconds(100));
  return true;
}

bool Meter::report(const ProgressEvent& event) {
  if (!terminal_ && !json_) return !interrupted();
  const double seconds = watch_.seconds();
  to_go_.report(event, seconds);
  if (!is_news(event)) return !interrupted();
  shown_ = terminal_;
  write_standard_error(json_ ? json_line(event, seconds) : fmt::format("\r\033[K{}", line(event, seconds)));
  done_ = event.done;
  steps_ = event.steps.done;
  return !interrupted();
}

std::string Meter::json_line(const ProgressEvent& event, double seconds) const {
  const auto known = [](std::int64_t total) {
    return total > 0 ? nlohmann::ordered_json(total) : nlohmann::ordered_json();
  };
  const auto left = to_go_.seconds();
  nlohmann::ordered_json line{{"command", command_}, {"stage", event.stage}};
  line["unit"] = event.computing ? "steps" : unit_;
  line["done"] = event.computing ? event.steps.done : event.done;
  line["total"] = known(event.computing ? event.steps.expected : event.expected);
  if (unit_ == kPhotographs) line["patterns"] = event.done;
  line["steps"] = event.steps.done;
  line["seconds"] = std::round(1000 * seconds) / 1000;
  line["seconds_to_go"] = left ? nlohmann::ordered_json(std::round(*left)) : nlohmann::ordered_json();
  return line.dump() + "\n";
}

/// "symrig capture: refit, 1700 of 5200 steps, ..." or "symrig capture: level 5, 120 of 318 photographs, 12
/// s, about 20 s to go", or a shorter form on a narrow terminal. The last column stays free, because some
/// terminals wrap when it is written.
std::string Meter::line(const ProgressEvent& event, double seconds) const {
  const StepCount shown = event.computing ? event.steps : StepCount{event.done, event.expected};
  std::string count = fmt::format("{}", shown.done);
  if (shown.expected > 0) count += fmt::format(" of {}", shown.expected);
  const auto left = to_go_.seconds();
  const std::string to_go = left ? fmt::format(", about {} to go", duration(*left)) : std::string();
  std::string counted = fmt::format("{}, {} {}", stage_, count, event.computing ? "steps" : unit_);
  // While no photograph comes, the computer works on those that are there.
  if (!event.computing && event.steps.done > 0 && event.done == done_)
    counted += fmt::format(", {} steps", event.steps.done);
  const std::array<std::string, 4> forms{
      fmt::format("symrig {}: {}, {}{}", command_, counted, duration(seconds), to_go),
      fmt::format("{}, {}{}", counted, duration(seconds), to_go),
      left ? fmt::format("{}, {}{}", stage_, count, to_go) : counted,
      left ? fmt::format("{}{}", count, to_go) : counted};
  return fitting(forms, terminal_columns(STDERR_FILENO) - 1);
}

}  // namespace symrig::apps
