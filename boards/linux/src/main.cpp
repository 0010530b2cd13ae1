// SPDX-License-Identifier: Apache-2.0
// symrigd: a Linux computer with GPIO lines as a trigger board.
#include "board_file.hpp"
#include "daemon.hpp"
#include "find_lines.hpp"
#include "process.hpp"
#include "socket_transport.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"
#include "transport.hpp"
#include "usb_transport.hpp"

#include <algorithm>
#include <csignal>
#include <exception>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <sys/signalfd.h>

namespace symrig::board_linux {
namespace {

constexpr unsigned kQuickWakes = 300;    // at every start: takes a third of a second
constexpr unsigned kWakesASecond = 800;  // for --measure
constexpr const char* kDefaultFile = "/etc/symrig/board.toml";

struct Arguments {
  std::string config;
  bool safe = false;
  bool id = false;
  unsigned measure_seconds = 0;
};

Result<BoardFile> board_file(const Arguments& arguments) {
  if (!arguments.config.empty()) return read_board_file(arguments.config);
  if (std::filesystem::exists(kDefaultFile)) return read_board_file(kDefaultFile);
  return default_board();
}

template <class T>
Result<void> add(Result<std::unique_ptr<T>> made, std::vector<std::unique_ptr<Transport>>& out) {
  if (!made) return made.error();
  log_line("serves " + (*made)->name());
  out.push_back(std::move(made).value());
  return {};
}

Result<std::vector<std::unique_ptr<Transport>>> open_transports(const BoardLinks& links) {
  std::vector<std::unique_ptr<Transport>> out;
  if (!links.usb.empty()) SYMRIG_CHECK(add(UsbTransport::open(links.usb), out));
  if (!links.unix_socket.empty()) SYMRIG_CHECK(add(SocketTransport::listen_unix(links.unix_socket), out));
  if (!links.serial.empty()) SYMRIG_CHECK(add(SerialTransport::open(links.serial, links.baud), out));
  if (links.tcp_port != 0)
    SYMRIG_CHECK(add(SocketTransport::listen_tcp(links.tcp_host, links.tcp_port), out));
  if (!out.empty()) return out;
  return Error{ErrorCode::bad_format, "the board has no link to a host",
               "add one under [link] in board.toml"};
}

/// These signals ask the daemon to end. The main loop reads them.
Fd open_stop_signals() {
  sigset_t wanted;
  sigemptyset(&wanted);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&wanted, number);
  pthread_sigmask(SIG_BLOCK, &wanted, nullptr);
  static_cast<void>(std::signal(SIGPIPE, SIG_IGN));
  return Fd(::signalfd(-1, &wanted, SFD_NONBLOCK | SFD_CLOEXEC));
}

Result<void> make_safe(const BoardFile& file) {
  const std::uint32_t levels = kept_safe_levels(file);
  SYMRIG_TRY(const auto gpio, take_lines(file.lines, levels));
  return write_standard_output(fmt::format("outputs are at their safe levels ({:08x})\n", levels));
}

Abilities abilities_of(const Measured& measured, const BoardFile& file) {
  return abilities(measured, file.lateness_us * static_cast<std::uint32_t>(kMicrosecond), Daemon::kSegments);
}

std::filesystem::path measured_path(const BoardFile& file) {
  return file.state_folder / "measured";
}

/// Asks for what makes this computer punctual. What it does not get goes to the journal.
Fd become_punctual(const BoardFile& file) {
  if (file.lock_memory)
    if (const std::string slow = lock_memory(); !slow.empty()) log_line(slow);
  if (!file.awake) return {};
  auto awake = stay_awake();
  if (awake) return std::move(awake).value();
  log_line(awake.error().line());
  return {};
}

Result<void> measure_and_keep(const BoardFile& file, unsigned seconds) {
  const std::uint32_t levels = kept_safe_levels(file);
  SYMRIG_TRY(const auto gpio, take_lines(file.lines, levels));
  const Fd awake = become_punctual(file);
  const Measured measured = measure(*gpio, levels, seconds * kWakesASecond, file.priority);
  Result<void> kept = save_measured(measured_path(file), measured);
  SYMRIG_CHECK(write_standard_output(measured_text(measured, abilities_of(measured, file))));
  if (!kept) return kept;
  return write_standard_output(printable(
      fmt::format("stored in {}; the next start uses these or worse\n", measured_path(file).string())));
}

Result<void> serve(const BoardFile& file) {
  const Fd stop = open_stop_signals();
  SYMRIG_TRY(auto id, unique_id(file));
  const Fd awake = become_punctual(file);
  const std::uint32_t levels = kept_safe_levels(file);
  SYMRIG_TRY(auto gpio, take_lines(file.lines, levels));
  const Measured measured =
      worse(measure(*gpio, levels, kQuickWakes, file.priority), load_measured(measured_path(file)));
  const Abilities can = abilities_of(measured, file);
  log_line(fmt::format("best-effort board '{}' {}: words of at least {} us, at most {} us late", file.name,
                       hexadecimal(id), can.promise.min_dwell / kMicrosecond,
                       can.promise.lateness / kMicrosecond));
  const hal::Tick seen = std::max(measured.word.most, measured.set.most);
  if (seen > can.promise.lateness)
    log_line(fmt::format("this computer was {} us late during the measurement: runs will count late words",
                         seen / kMicrosecond));
  SYMRIG_TRY(auto transports, open_transports(file.links));
  Daemon daemon({file, std::move(id), can, std::move(gpio), std::move(transports)});
  return daemon.run(stop.get());
}

Result<void> run(const Arguments& arguments) {
  SYMRIG_TRY(const BoardFile file, board_file(arguments));
  if (arguments.safe) return make_safe(file);
  if (arguments.measure_seconds > 0) return measure_and_keep(file, arguments.measure_seconds);
  if (!arguments.id) return serve(file);
  SYMRIG_TRY(const auto id, unique_id(file));
  return write_standard_output(hexadecimal(id) + "\n");
}

int finish(const Result<void>& done) {
  if (done) return 0;
  log_line(done.error().line());
  return exit_code(done.error().code);
}

}  // namespace
}  // namespace symrig::board_linux

int main(int argc, char** argv) {
  symrig::reserve_standard_streams();
  try {
    symrig::board_linux::Arguments arguments;
    CLI::App app(
        "A Linux computer with GPIO lines as symrig's trigger board (best effort: it measures what it can "
        "keep, and refuses what it cannot)",
        "symrigd");
    app.set_version_flag("--version", SYMRIG_VERSION);
    app.add_option("--config", arguments.config,
                   "Lines and links (default: /etc/symrig/board.toml, if it exists)")
        ->type_name("FILE");
    auto* safe = app.add_flag("--safe", arguments.safe, "Set all outputs to their safe levels and exit");
    auto* id = app.add_flag("--id", arguments.id, "Print the board's serial number and exit");
    app.add_option("--measure", arguments.measure_seconds,
                   "Measure this computer for this time, store and print the result")
        ->type_name("SECONDS")
        ->check(CLI::Range(1, 3600))
        ->excludes(safe, id);
    app.footer(
        "Exit codes: 0 ended on request, 2 usage, 3 a line, chip or link is not available, 4 bad file.");
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      std::ostringstream text;
      const bool asked = app.exit(error, text, text) == 0;
      if (asked) return symrig::board_linux::finish(symrig::write_standard_output(text.str()));
      symrig::write_standard_error(symrig::printable(text.str()));
      return 2;
    }
    return symrig::board_linux::finish(symrig::board_linux::run(arguments));
  } catch (const std::exception& error) {
    symrig::board_linux::log_line(error.what());
    return 5;
  }
}
