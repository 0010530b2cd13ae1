// SPDX-License-Identifier: Apache-2.0

#include "command.hpp"
#include "device_text.hpp"
#include "options.hpp"
#include "output.hpp"
#include "symrig/camera/camera_info.hpp"
#include "symrig/projector/find_projectors.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {

namespace {

using Json = nlohmann::ordered_json;

/// The modes that can show a pattern, each once. A star marks the preferred mode.
std::string modes_text(const Display& display) {
  std::vector<std::string> names;
  for (const DisplayMode& mode : display.modes) {
    const std::string name = to_string(mode);
    const auto same = [&](const std::string& other) { return other == name || other == name + "*"; };
    if (!mode.interlaced && std::none_of(names.begin(), names.end(), same))
      names.push_back(mode.preferred ? name + "*" : name);
  }
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
  return text;
}

std::string row(const Display& display, std::size_t width) {
  if (!display.error.empty()) return fmt::format("{}: {}\n", display.connector, display.error);
  const std::string model = display.model.empty() ? "-" : display.model;
  const std::string what = display.connected ? modes_text(display) : "nothing connected";
  return fmt::format("{:<{}}  {:<8}  {:<13}  {}\n", display.connector, width, display.driver, model, what);
}

Json mode_json(const DisplayMode& mode) {
  return {{"mode", to_string(mode)},
          {"size", {mode.grid.rows, mode.grid.cols}},
          {"period_ns", mode.period.count()},
          {"preferred", mode.preferred},
          {"interlaced", mode.interlaced}};
}

/// The table of `symrig list`: one line for each connector, with its modes. Empty if there is no connector.
std::string projectors_table(const std::vector<Display>& displays) {
  if (displays.empty()) return {};
  std::size_t width = std::string_view("projector").size();
  for (const Display& display : displays) width = std::max(width, display.connector.size());
  std::string text =
      fmt::format("\n{:<{}}  {:<8}  {:<13}  modes (* preferred)\n", "projector", width, "driver", "model");
  for (const Display& display : displays) text += row(display, width);
  return text;
}

/// The same as JSON: an array with one object for each connector.
Json projectors_json(const std::vector<Display>& displays) {
  Json all = Json::array();
  for (const Display& display : displays) {
    Json modes = Json::array();
    for (const DisplayMode& mode : display.modes) modes.push_back(mode_json(mode));
    all.push_back({{"connector", display.connector},
                   {"driver", display.driver.empty() ? Json() : Json(display.driver)},
                   {"connected", display.connected},
                   {"model", display.model.empty() ? Json() : Json(display.model)},
                   {"modes", std::move(modes)},
                   {"error", display.error.empty() ? Json() : Json(display.error)}});
  }
  return all;
}

struct ListArguments {
  std::vector<std::string> devices;
  std::string json;
};

/// A board with its answers, or with the error.
struct Row {
  FoundBoard found;
  std::optional<BoardInfo> info;
  std::optional<BoardStatus> status;
  std::string error;
};

// A connected board answers within milliseconds, so do not wait long.
constexpr BoardOptions kBrief{.reply_timeout = std::chrono::milliseconds(100), .attempts = 3};

Row ask(const FoundBoard& found) {
  Row row{found, {}, {}, {}};
  auto board = open_board(found.uri, kBrief);
  if (!board) {
    row.error = board.error().line();
    return row;
  }
  row.info = board->info();
  if (auto status = board->status())
    row.status = *std::move(status);
  else
    row.error = status.error().line();
  return row;
}

/// The boards that were found, those that the user named, and the simulated board.
Result<std::vector<FoundBoard>> boards_to_ask(const std::vector<std::string>& named) {
  SYMRIG_TRY(auto boards, find_boards());
  for (const std::string& text : named) {
    SYMRIG_TRY(auto uri, DeviceUri::parse(text));
    FoundBoard board;
    board.uri = std::move(uri);
    boards.push_back(std::move(board));
  }
  boards.emplace_back();  // its uri is sim:
  return boards;
}

std::string or_dash(const std::string& text) {
  return text.empty() ? "-" : text;
}

std::array<std::string, 6> cells(const Row& row) {
  if (!row.info) return {row.found.uri.text(), "-", or_dash(row.found.serial), "-", "-", "no answer"};
  return {row.found.uri.text(),       row.info->board,
          row.info->unique_id,        or_dash(row.info->label),
          row.info->firmware_version, row.status ? std::string(name(row.status->state)) : "unknown"};
}

std::string table(const std::vector<Row>& rows) {
  std::vector<std::array<std::string, 6>> lines{{"uri", "board", "serial", "label", "firmware", "state"}};
  for (const Row& row : rows) lines.push_back(cells(row));
  std::array<std::size_t, 6> width{};
  for (const auto& line : lines)
    for (std::size_t k = 0; k < width.size(); ++k) width[k] = std::max(width[k], line[k].size());
  std::string text;
  for (const auto& line : lines) {
    for (std::size_t k = 0; k + 1 < width.size(); ++k) text += fmt::format("{:<{}}  ", line[k], width[k]);
    text += line.back() + "\n";
  }
  for (const Row& row : rows)
    if (!row.error.empty()) text += fmt::format("{}: {}\n", row.found.uri.text(), row.error);
  return text;
}

nlohmann::ordered_json to_json(const Row& row) {
  const auto known = [&](const std::string& text) {
    return row.info ? nlohmann::ordered_json(text) : nullptr;
  };
  const BoardInfo info = row.info.value_or(BoardInfo{});
  return {{"uri", row.found.uri.text()},
          {"board", known(info.board)},
          {"serial", row.info ? info.unique_id : row.found.serial},
          {"label", known(info.label)},
          {"firmware", known(info.firmware_version)},
          {"firmware_hash", known(fmt::format("{:016x}", info.firmware_hash))},
          {"state", row.status ? nlohmann::ordered_json(name(row.status->state)) : nullptr},
          {"port", row.found.port},
          {"simulated", row.found.uri.transport == Transport::sim},
          {"error", row.error.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(row.error)}};
}

std::string ports_text(const std::vector<DeviceUri>& ports) {
  std::string text;
  for (const DeviceUri& port : ports)
    text +=
        fmt::format("{}: not asked, because opening it can restart what is there; symrig info --device {}\n",
                    port.text(), port.text());
  return text;
}

Result<void> run(const ListArguments& arguments) {
  SYMRIG_CHECK(JobFiles().writes("--json", arguments.json, FileFormat::json).check());
  SYMRIG_TRY(const auto boards, boards_to_ask(arguments.devices));
  std::vector<Row> rows;
  rows.reserve(boards.size());
  for (const auto& board : boards) rows.push_back(ask(board));
  const auto cameras = look_at_cameras();
  nlohmann::ordered_json json{{"command", "list"}, {"boards", nlohmann::ordered_json::array()}};
  for (const Row& row : rows) json["boards"].push_back(to_json(row));
  const auto ports = other_serial_ports();
  json["serial_ports"] = nlohmann::ordered_json::array();
  for (const DeviceUri& port : ports) json["serial_ports"].push_back(port.text());
  const auto displays = find_displays();
  json["projectors"] = projectors_json(displays);
  const auto controllers = find_dlp_controllers();
  json["controllers"] = controllers_json(controllers);
  json["cameras"] = cameras_json(cameras);
  SYMRIG_CHECK(write_text(arguments.json, json_text(json, 2)));
  if (is_standard_output(arguments.json)) return {};
  return print(table(rows) + ports_text(ports) + projectors_table(displays) + controllers_table(controllers) +
               cameras_summary(cameras));
}

}  // namespace

Job add_list(CLI::App& command) {
  const auto arguments = std::make_shared<ListArguments>();
  command.add_option("--device", arguments->devices, "Also ask this board behind a socket; can be repeated")
      ->type_name("URI")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  add_json(command, arguments->json);
  command.footer(
      std::string(
          "Example:\n"
          "  symrig list\n"
          "\n"
          "Searches USB and USB serial ports, and asks each board for its identity. It lists a board that "
          "another program\n"
          "uses, but does not ask it. The simulated board sim: is always listed.\n"
          "Other USB serial ports, which an Arduino may have, are listed but not opened.\n"
          "Projectors are the connectors of graphics cards, with the modes of the connected displays.\n"
          "Controllers are DLP controllers on USB; symrig info --projector PATH shows everything about one.\n"
          "Cameras are V4L2 and GenICam devices; symrig info --camera PATH shows everything about one.\n"
          "\n") +
      kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
