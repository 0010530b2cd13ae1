// SPDX-License-Identifier: Apache-2.0
#include "board_json.hpp"

#include "symrig/device/board_file.hpp"
#include "symrig/protocol/program.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::device {

using Json = nlohmann::ordered_json;

Json board_json(const BoardInfo& board) {
  Json lines = Json::array();
  for (const LineInfo& line : board.lines)
    lines.push_back({{"name", line.name},
                     {"output", line.output},
                     {"pin", line.pin},
                     {"waits", line.waits},
                     {"trips", line.trips},
                     {"stamp_ticks", line.stamp_ticks}});
  return {{"name", board.board},
          {"firmware_version", board.firmware_version},
          {"unique_id", board.unique_id},
          {"tick_hz", board.rate.hz},
          {"min_dwell", board.min_dwell.count},
          {"max_dwell", board.max_dwell.count},
          {"wait_latency", board.wait_latency.count},
          {"program_bytes", board.program_bytes},
          {"loop_depth", board.loop_depth},
          {"queue_segments", board.queue_segments},
          {"refill_ticks", board.refill_ticks},
          {"poll_ticks", board.poll_ticks},
          {"lateness", board.lateness.count},
          {"lines", std::move(lines)}};
}

namespace {

/// Edges that can be awaited: a number of bits, an object as `symrig info --json` has it, or a list of names
/// as in a firmware's manifest.
std::uint8_t waits_from(const Json& line) {
  if (!line.contains("waits")) return 7;
  const Json& waits = line.at("waits");
  if (waits.is_number()) return waits.get<std::uint8_t>();
  const auto bit = [&waits](const char* edge, unsigned value) {
    const bool can = waits.is_array() ? std::find(waits.begin(), waits.end(), edge) != waits.end()
                                      : waits.at(edge).get<bool>();
    return can ? value : 0U;
  };
  return static_cast<std::uint8_t>(bit("rising", 1) | bit("falling", 2) | bit("both", 4));
}

}  // namespace

BoardInfo board_from_json(const Json& json) {
  BoardInfo board;
  board.board = json.at(json.contains("name") ? "name" : "board").get<std::string>();
  board.firmware_version = json.value(json.contains("firmware") ? "firmware" : "firmware_version", "");
  board.unique_id = json.value(json.contains("serial") ? "serial" : "unique_id", "");
  board.rate = {json.at("tick_hz").get<std::uint64_t>()};
  board.min_dwell = {json.at("min_dwell").get<std::uint64_t>()};
  board.max_dwell = {json.at("max_dwell").get<std::uint64_t>()};
  board.wait_latency = {json.at("wait_latency").get<std::uint64_t>()};
  board.program_bytes = json.contains("program_records") ? json.at("program_records").get<std::uint32_t>() * 8
                                                         : json.at("program_bytes").get<std::uint32_t>();
  board.loop_depth = json.value("loop_depth", protocol::kMaxLoopDepth);
  board.queue_segments = json.value("queue_segments", board.queue_segments);
  board.refill_ticks = json.value("refill_ticks", board.refill_ticks);
  board.poll_ticks = json.value("poll_ticks", board.poll_ticks);
  board.lateness = {json.value("lateness", board.lateness.count)};
  for (const Json& line : json.at("lines"))
    board.lines.push_back({line.at("name").get<std::string>(), line.at("output").get<bool>(),
                           line.value("pin", std::string()), waits_from(line), line.value("trips", false),
                           line.value("stamp_ticks", 1U)});
  return board;
}

Json line_json(const LineConfig& line) {
  return {{"line", line.line},
          {"safe_level", line.safe_level},
          {"hazard", static_cast<int>(line.hazard)},
          {"capture", line.capture},
          {"max_on_ns", line.max_on.count()},
          {"min_off_ns", line.min_off.count()},
          {"max_duty", line.max_duty},
          {"trip_level", line.trip_level ? Json(*line.trip_level) : Json()}};
}

LineConfig line_from_json(const Json& json) {
  LineConfig line;
  line.line = json.at("line").get<std::string>();
  line.safe_level = json.at("safe_level").get<bool>();
  line.hazard = static_cast<Hazard>(json.at("hazard").get<int>());
  line.capture = json.at("capture").get<bool>();
  line.max_on = Nanoseconds(json.at("max_on_ns").get<std::int64_t>());
  line.min_off = Nanoseconds(json.at("min_off_ns").get<std::int64_t>());
  line.max_duty = json.at("max_duty").get<double>();
  if (const Json trip = json.value("trip_level", Json()); trip.is_boolean())
    line.trip_level = trip.get<bool>();
  return line;
}

std::string board_file_text(const BoardInfo& board) {
  return board_json(board).dump(1) + "\n";
}

Result<BoardInfo> parse_board_file(std::string_view text) {
  try {
    Json json = Json::parse(text);
    if (json.contains("capabilities")) json.update(Json(json.at("capabilities")));  // a firmware's manifest
    const bool inside = json.contains("board") && json.at("board").is_object();
    BoardInfo board = board_from_json(inside ? json.at("board") : json);
    if (board.rate.hz < 1000 || board.min_dwell.count == 0 || board.max_dwell < board.min_dwell ||
        board.lines.size() > 32)
      return Error{ErrorCode::bad_format, "it describes a board that there cannot be",
                   "give what symrig info --json wrote, a receipt of that board, or its firmware's manifest"};
    return board;
  } catch (const Json::exception& error) {
    return Error{ErrorCode::bad_format, fmt::format("it does not describe a board: {}", error.what()),
                 "give what symrig info --json wrote, a receipt of that board, or its firmware's manifest"};
  }
}

}  // namespace symrig::device
