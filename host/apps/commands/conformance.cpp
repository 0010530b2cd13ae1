// SPDX-License-Identifier: Apache-2.0
#include "symrig/conformance/conformance.hpp"

#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"

#include <memory>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {
namespace {

struct ConformanceArguments {
  std::string uri, filter, jumper, json;
};

constexpr const char* kConformanceExample =
    "Example:\n"
    "  symrig conformance sim:                                    the simulated board\n"
    "  symrig conformance usb: --jumper projector_trigger:vsync   a board with a wire from an "
    "output to an input\n"
    "  symrig conformance usb: --filter '^limits'                 some of the checks\n"
    "\n"
    "The checks switch outputs: first disconnect everything that lights, heats or shoots. "
    "Afterwards the board is\n"
    "safe and has no configuration; its stored configuration and its label do not change.\n"
    "docs/conformance.md lists the checks.";

Result<Jumper> parse_jumper(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == 0 || colon == std::string::npos || colon + 1 == text.size())
    return Error{ErrorCode::bad_argument, fmt::format("--jumper '{}' is not OUTPUT:INPUT", text),
                 "give for example projector_trigger:vsync"};
  return Jumper{text.substr(0, colon), text.substr(colon + 1)};
}

std::string line_of(const CheckResult& result) {
  return fmt::format("{}  {}{}{}\n", name(result.outcome), result.name, result.detail.empty() ? "" : ": ",
                     result.detail);
}

std::string json_of(const ConformanceReport& report) {
  nlohmann::ordered_json json;
  json["board"] = report.board;
  json["firmware_version"] = report.firmware_version;
  json["unique_id"] = report.unique_id;
  json["passed"] = report.count(CheckOutcome::passed);
  json["failed"] = report.count(CheckOutcome::failed);
  json["skipped"] = report.count(CheckOutcome::skipped);
  json["checks"] = nlohmann::ordered_json::array();
  for (const CheckResult& result : report.results)
    json["checks"].push_back(
        {{"name", result.name}, {"outcome", name(result.outcome)}, {"detail", result.detail}});
  return json_text(json, 2);
}

Result<void> sum_up(const ConformanceReport& report, bool prints) {
  const std::size_t failed = report.count(CheckOutcome::failed);
  if (prints)
    SYMRIG_CHECK(
        print(fmt::format("board '{}' {} ({}): {} passed, {} failed, {} skipped\n", report.board,
                          report.unique_id, report.firmware_version, report.count(CheckOutcome::passed),
                          failed, report.count(CheckOutcome::skipped))));
  if (report.passed()) return {};
  if (failed == 0)
    return Error{ErrorCode::bad_argument, "all checks were skipped", "give --jumper, or another --filter"};
  return Error{ErrorCode::protocol,
               fmt::format("the board fails {} of {} checks", failed, report.results.size()),
               "update its firmware; docs/conformance.md describes each check"};
}

Result<void> run(const ConformanceArguments& arguments) {
  SYMRIG_CHECK(JobFiles().writes("--json", arguments.json, FileFormat::json).check());
  ConformanceOptions options;
  options.filter = arguments.filter;
  if (!arguments.jumper.empty()) {
    SYMRIG_TRY(options.jumper, parse_jumper(arguments.jumper));
  }
  const bool prints = !is_standard_output(arguments.json);
  Result<void> printed;
  options.on_result = [&](const CheckResult& result) {
    if (prints && printed) printed = print(line_of(result));
  };
  options.stop = [] { return interrupted(); };
  SYMRIG_TRY(const auto uri, choose_board(arguments.uri));
  SYMRIG_TRY(auto link, open_link(uri));
  SYMRIG_TRY(const ConformanceReport report, check_conformance(std::move(link), options));
  if (!printed) return printed;
  SYMRIG_CHECK(write_text(arguments.json, json_of(report)));
  return sum_up(report, prints);
}

}  // namespace

Job add_conformance(CLI::App& command) {
  const auto arguments = std::make_shared<ConformanceArguments>();
  command.add_option("uri", arguments->uri, "The board (see below)")->type_name("URI|SERIAL");
  command
      .add_option("--filter", arguments->filter,
                  "Run only the checks whose name matches this regular expression")
      ->type_name("REGEX");
  command
      .add_option("--jumper", arguments->jumper, "Use this wire from an output to an input with time stamps")
      ->type_name("OUTPUT:INPUT");
  add_json(command, arguments->json);
  command.footer(std::string(kConformanceExample) + "\n\n" + kDeviceHelp + "\n" + kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
