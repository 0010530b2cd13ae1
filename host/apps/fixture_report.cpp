// SPDX-License-Identifier: Apache-2.0
#include "fixture_report.hpp"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

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

}  // namespace

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

std::string fixture_text(const FixtureTest& test) {
  std::string text;
  for (const WireTest& wire : test.wires)
    text += row(wire.passed, "wire", wire_name(wire.wire) + ": " + wire.text);
  if (test.wires.empty()) return text;
  return text + row(test.crossing.passed, test.crossing.name, test.crossing.text) +
         row(test.trip.passed, "trip", test.trip.text) +
         row(test.watchdog.passed, "watchdog", test.watchdog.text);
}

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

std::filesystem::path results_name(const BoardInfo& info, std::string made) {
  std::erase_if(made, [](char c) { return c == '-' || c == ':'; });
  return fmt::format("{}-{}-{}.json", info.board, info.unique_id, made);
}

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

}  // namespace symrig::apps
