// SPDX-License-Identifier: Apache-2.0

#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "program.hpp"
#include "symrig/board/self_test.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {

namespace {

using Json = nlohmann::ordered_json;

double nanoseconds(const BoardInfo& info, Ticks ticks) {
  return 1e9 * static_cast<double>(ticks.count) / static_cast<double>(info.rate.hz);
}

std::string wire_name(const Jumper& wire) {
  return wire.output + ":" + wire.input;
}

std::string row(bool passed, const std::string& name, const std::string& text) {
  return fmt::format("{} {:<10} {}\n", passed ? "ok  " : "FAIL", name, text);
}

Error refused(const std::string& check, const std::string& text) {
  return {ErrorCode::device_refused, fmt::format("the board failed the check '{}': {}", check, text),
          "docs/howto-boards.md describes each check"};
}

/// "OUT:IN,OUT:IN" of --plug. Empty: none.
/// fails: bad_argument.
Result<std::vector<Jumper>> plug_of(const std::string& text) {
  std::vector<Jumper> plug;
  std::istringstream wires(text);
  for (std::string wire; std::getline(wires, wire, ',');) {
    const std::size_t colon = wire.find(':');
    if (colon == std::string::npos || colon == 0 || colon + 1 == wire.size())
      return Error{ErrorCode::bad_argument, fmt::format("--plug {} is not OUT:IN,OUT:IN", text),
                   "name each wire by its output and its input, as symrig info lists them"};
    plug.push_back({wire.substr(0, colon), wire.substr(colon + 1)});
  }
  return plug;
}

/// A line for each check of the plug.
std::string fixture_text(const FixtureTest& test) {
  std::string text;
  for (const WireTest& wire : test.wires)
    text += row(wire.passed, "wire", wire_name(wire.wire) + ": " + wire.text);
  if (test.wires.empty()) return text;
  return text + row(test.crossing.passed, test.crossing.name, test.crossing.text) +
         row(test.trip.passed, "trip", test.trip.text) +
         row(test.watchdog.passed, "watchdog", test.watchdog.text);
}

/// What the plug showed, for the results file: wires, crossing, trip, watchdog.
Json fixture_json(const BoardInfo& info, const FixtureTest& test) {
  Json wires = Json::array();
  for (const WireTest& wire : test.wires) {
    Json pulses = Json::array();
    for (const JumperPulse& pulse : wire.pulses)
      pulses.push_back({{"planned_ns", nanoseconds(info, pulse.planned)},
                        {"measured_ns", nanoseconds(info, pulse.measured)},
                        {"delay_ns", nanoseconds(info, pulse.delay)}});
    wires.push_back(
        {{"wire", wire_name(wire.wire)}, {"passed", wire.passed}, {"text", wire.text}, {"pulses", pulses}});
  }
  const WatchdogTest& dog = test.watchdog;
  const Json answered = dog.answered ? Json(nanoseconds(info, *dog.answered)) : Json(nullptr);
  const Json cause = dog.cause ? Json(name(*dog.cause)) : Json(nullptr);
  const Json latency = test.trip.latency ? Json(nanoseconds(info, *test.trip.latency)) : Json(nullptr);
  return {{"wires", wires},
          {"crossing", {{"passed", test.crossing.passed}, {"text", test.crossing.text}}},
          {"trip",
           {{"passed", test.trip.passed},
            {"text", test.trip.text},
            {"interlock", test.trip.interlock},
            {"latency_ns", latency},
            {"resolution_ns", nanoseconds(info, test.trip.resolution)}}},
          {"watchdog",
           {{"passed", dog.passed}, {"text", dog.text}, {"answered_ns", answered}, {"reset_cause", cause}}}};
}

/// BOARD-SERIAL-20261124T160000Z.json. made: "2026-11-24T16:00:00Z".
std::filesystem::path results_name(const BoardInfo& info, std::string made) {
  std::erase_if(made, [](char c) { return c == '-' || c == ':'; });
  return fmt::format("{}-{}-{}.json", info.board, info.unique_id, made);
}

/// The first check that failed, as a device error. OK: all passed.
Result<void> fixture_verdict(const FixtureTest& test) {
  for (const SelfCheck& check : test.basics.checks)
    if (!check.passed) return refused(check.name, check.text);
  for (const WireTest& wire : test.wires)
    if (!wire.passed) return refused("wire " + wire_name(wire.wire), wire.text);
  if (!test.crossing.passed) return refused("crossing", test.crossing.text);
  if (!test.trip.passed) return refused("trip", test.trip.text);
  if (!test.watchdog.passed) return refused("watchdog", test.watchdog.text);
  return {};
}

struct SelftestArguments {
  std::string device, jumper, json, plug, results, revision;
  bool fixture = false;
  int pings = SelfTestOptions{}.pings;
};

Result<SelfTestOptions> options_of(const SelftestArguments& arguments) {
  SelfTestOptions options;
  if (arguments.pings < 1 || arguments.pings > 10'000)
    return Error{ErrorCode::bad_argument,
                 fmt::format("--pings {} is not between 1 and 10000", arguments.pings), ""};
  options.pings = arguments.pings;
  if (arguments.jumper.empty()) return options;
  const std::size_t colon = arguments.jumper.find(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == arguments.jumper.size())
    return Error{ErrorCode::bad_argument, fmt::format("--jumper {} is not OUT:IN", arguments.jumper),
                 "name an output and the input that it is wired to, as symrig info lists them"};
  options.jumper = {arguments.jumper.substr(0, colon), arguments.jumper.substr(colon + 1)};
  return options;
}

/// Measured minus planned, in nanoseconds.
double error_ns(const BoardInfo& info, const JumperPulse& pulse) {
  const auto ticks = static_cast<std::int64_t>((pulse.measured - pulse.planned).count);
  return 1e9 * static_cast<double>(ticks) / static_cast<double>(info.rate.hz);
}

std::string pulse_table(const BoardInfo& info, const SelfTest& test) {
  if (test.pulses.empty()) return "";
  std::string text =
      fmt::format("  {:>14} {:>14} {:>10} {:>12}\n", "planned ns", "measured ns", "off ns", "delay ns");
  for (const JumperPulse& pulse : test.pulses)
    text +=
        fmt::format("  {:>14} {:>14} {:>+10} {:>12}\n", nanoseconds(info, pulse.planned),
                    nanoseconds(info, pulse.measured), error_ns(info, pulse), nanoseconds(info, pulse.delay));
  return text;
}

std::string report(const BoardInfo& info, const SelfTest& test) {
  std::string text;
  for (const SelfCheck& check : test.checks)
    text += fmt::format("{} {:<10} {}\n", check.passed ? "ok  " : "FAIL", check.name, check.text);
  return text + pulse_table(info, test);
}

Json to_json(const BoardInfo& info, const SelfTest& test) {
  Json json{{"command", "selftest"},
            {"board", info.board},
            {"serial", info.unique_id},
            {"passed", test.passed()},
            {"checks", Json::array()},
            {"ping_ns",
             {{"shortest", test.pings.shortest.count()},
              {"median", test.pings.median.count()},
              {"longest", test.pings.longest.count()}}},
            {"clock_bound_ns", test.clock_bound.count()},
            {"drift_ppm", {1e6 * test.drift.lowest, 1e6 * test.drift.highest}},
            {"pulses", Json::array()}};
  for (const SelfCheck& check : test.checks)
    json["checks"].push_back({{"name", check.name}, {"passed", check.passed}, {"text", check.text}});
  for (const JumperPulse& pulse : test.pulses)
    json["pulses"].push_back({{"planned_ns", nanoseconds(info, pulse.planned)},
                              {"measured_ns", nanoseconds(info, pulse.measured)},
                              {"delay_ns", nanoseconds(info, pulse.delay)}});
  return json;
}

/// A failed check is a device error: exit code 3.
Result<void> verdict(const SelfTest& test) {
  if (test.passed()) return {};
  const auto failed = std::find_if(test.checks.begin(), test.checks.end(),
                                   [](const SelfCheck& check) { return !check.passed; });
  return Error{ErrorCode::device_refused,
               fmt::format("the board failed the check '{}': {}", failed->name, failed->text),
               "docs/howto-boards.md describes each check"};
}

/// Numbers, revision and date of one board, for the file that its maker keeps.
Result<void> keep_results(const SelftestArguments& arguments, const BoardInfo& info,
                          const FixtureTest& test) {
  const Made made = made_now();
  Json json = to_json(info, test.basics);
  json["passed"] = test.passed();
  json["fixture"] = fixture_json(info, test);
  json["revision"] = arguments.revision;
  json["date"] = made.date;
  json["firmware"] = {{"version", info.firmware_version},
                      {"hash", fmt::format("{:016x}", info.firmware_hash)}};
  json["symrig"] = made.version;
  SYMRIG_CHECK(write_text(arguments.json, json_text(json, 2)));
  if (arguments.results.empty()) return {};
  const std::filesystem::path file = std::filesystem::path(arguments.results) / results_name(info, made.date);
  return write_text(file.string(), json_text(json, 2));
}

/// The production test: with a plug that joins outputs and inputs.
Result<void> run_fixture(const SelftestArguments& arguments, SelfTestOptions options) {
  SYMRIG_TRY(auto plug, plug_of(arguments.plug));
  SYMRIG_TRY(const DeviceUri uri, choose_board(arguments.device));
  SYMRIG_TRY(auto board, open_board(uri));
  if (plug.empty()) plug = default_plug(board.info());
  std::optional<Meter> meter(std::in_place, "selftest", "answers");
  options.progress = meter->progress();
  SYMRIG_TRY(const FixtureTest test, fixture_test(board, plug, options, [&uri] { return open_board(uri); }));
  meter.reset();
  SYMRIG_CHECK(keep_results(arguments, board.info(), test));
  if (!is_standard_output(arguments.json))
    SYMRIG_CHECK(print(report(board.info(), test.basics) + fixture_text(test)));
  return fixture_verdict(test);
}

/// Refuses options without effect.
Result<void> check_selftest_effects(const CLI::App& command, const SelftestArguments& arguments) {
  const bool alone = !arguments.fixture;
  const std::array<Idle, 4> options{
      {{"--jumper", arguments.fixture, "with --fixture: the plug has every wire"},
       {"--plug", alone, "without --fixture"},
       {"--results", alone, "without --fixture"},
       {"--revision", alone, "without --fixture"}}};
  return check_effects(command, options);
}

Result<void> run(const CLI::App& command, const SelftestArguments& arguments) {
  SYMRIG_CHECK(check_selftest_effects(command, arguments));
  SYMRIG_TRY(auto options, options_of(arguments));
  SYMRIG_CHECK(JobFiles().writes("--json", arguments.json, FileFormat::json).check());
  if (!arguments.results.empty() && !std::filesystem::is_directory(arguments.results))
    return Error{ErrorCode::not_found,
                 fmt::format("--results {}: there is no such folder", arguments.results), "make it first"};
  if (arguments.fixture) return run_fixture(arguments, std::move(options));
  SYMRIG_TRY(auto board, open_board(arguments.device));
  std::optional<Meter> meter(std::in_place, "selftest", "answers");
  options.progress = meter->progress();
  SYMRIG_TRY(const SelfTest test, self_test(board, options));
  meter.reset();
  SYMRIG_CHECK(write_text(arguments.json, json_text(to_json(board.info(), test), 2)));
  if (!is_standard_output(arguments.json)) SYMRIG_CHECK(print(report(board.info(), test)));
  return verdict(test);
}

}  // namespace

Job add_selftest(CLI::App& command) {
  const auto arguments = std::make_shared<SelftestArguments>();
  add_device(command, arguments->device);
  command
      .add_option("--jumper", arguments->jumper, "Send pulses through this wire from an output to an input")
      ->type_name("OUT:IN");
  command.add_option("--pings", arguments->pings, "Number of clock measurements, 0.1 s apart")
      ->capture_default_str()
      ->type_name("N");
  command.add_flag("--fixture", arguments->fixture,
                   "Production test: a plug joins outputs and inputs; also an interlock and the watchdog");
  command
      .add_option("--plug", arguments->plug,
                  "The wires of the plug (default: the first output with the first input, and so on)")
      ->type_name("OUT:IN,...");
  command.add_option("--results", arguments->results, "Folder for the results file of this board")
      ->type_name("FOLDER");
  command.add_option("--revision", arguments->revision, "Revision of the hardware, for the results file")
      ->type_name("TEXT");
  add_json(command, arguments->json);
  command.footer(
      std::string("Example:\n"
                  "  symrig selftest --device 'sim:?jumper=lamp_enable:vsync' --jumper lamp_enable:vsync\n"
                  "\n"
                  "Removes the board's configuration and program. Without --jumper no output changes. With "
                  "--jumper this output\n"
                  "changes: first make sure that only the wire is connected to it.\n") +
      kDeviceHelp + "\n" + kExitCodes);
  takes_number<int>(command.get_option("--pings"));
  return [&command, arguments] { return run(command, *arguments); };
}

}  // namespace symrig::apps
