// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/internal/board_forms.hpp"

#include "symrig/base/internal/json_reader.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/internal/explain.hpp"
#include "symrig/protocol/messages.hpp"
#include "symrig/protocol/program.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace symrig {

int BoardInfo::line(std::string_view name) const {
  const auto found =
      std::find_if(lines.begin(), lines.end(), [name](const LineInfo& info) { return info.name == name; });
  return found == lines.end() ? -1 : static_cast<int>(found - lines.begin());
}

}  // namespace symrig

namespace symrig::board {
namespace {

std::uint8_t role_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, symrig_wire_LineRole>, 5> kRoles{
      {{"projector_trigger", symrig_wire_LineRole_LINE_ROLE_PROJECTOR_TRIGGER},
       {"camera_trigger", symrig_wire_LineRole_LINE_ROLE_CAMERA_TRIGGER},
       {"lamp_enable", symrig_wire_LineRole_LINE_ROLE_LAMP_ENABLE},
       {"vsync", symrig_wire_LineRole_LINE_ROLE_VSYNC},
       {"camera_strobe", symrig_wire_LineRole_LINE_ROLE_CAMERA_STROBE}}};
  for (const auto& [known, role] : kRoles)
    if (known == name) return static_cast<std::uint8_t>(role);
  return symrig_wire_LineRole_LINE_ROLE_GENERAL;
}

bool has_limits(const LineConfig& line) {
  return line.max_on.count() != 0 || line.min_off.count() != 0 || line.max_duty != 1;
}

Result<void> check(const LineConfig& line, const LineInfo& wired) {
  const bool output = wired.output;
  const auto bad = [&line](const char* what, const char* hint) {
    return Error{ErrorCode::bad_argument, fmt::format("line '{}': {}", line.line, what), hint};
  };
  if (line.max_on.count() < 0 || line.min_off.count() < 0)
    return bad("a limit is negative", "give max_on and min_off as durations, 0 for none");
  if (!(line.max_duty >= 0.001 && line.max_duty <= 1))
    return bad("max_duty is out of range", "give a share from 0.001 to 1 (1 = no limit)");
  if (line.trip_level && !wired.trips && !output)
    return bad("this board cannot stop on a change of this input",
               "use a line whose `trips` is true in `symrig info`");
  if (output && line.trip_level) return bad("an output cannot have a trip level", "remove it");
  if (output && line.hazard == Hazard::laser && line.max_on.count() == 0)
    return bad("a laser line needs a limit on its time on", "give max_on");
  if (!output && (has_limits(line) || line.safe_level))
    return bad("an input cannot have limits or a safe level", "remove them");
  return {};
}

std::uint64_t limit_ticks(const BoardInfo& info, Nanoseconds limit) {
  return std::min(info.rate.ticks(limit).count, protocol::kMaxDuration);
}

void fill(const BoardInfo& info, const LineConfig& line, protocol::LineConfig& config) {
  config.hazard = static_cast<std::uint8_t>(line.hazard);
  config.safe_level = line.safe_level;
  config.capture = line.capture;
  config.max_on = limit_ticks(info, line.max_on);
  config.min_off = limit_ticks(info, line.min_off);
  // Rounded down: the board must not allow more than the user asked for.
  const auto permille = static_cast<std::uint16_t>(std::floor(line.max_duty * 1000 + 1e-9));
  config.max_duty_permille = permille >= 1000 ? 0 : permille;
  if (!line.trip_level) return;
  config.role = symrig_wire_LineRole_LINE_ROLE_INTERLOCK;
  config.trip_level = *line.trip_level;
}

}  // namespace

Result<protocol::BoardConfig> line_setup(const BoardInfo& info, std::span<const LineConfig> lines) {
  protocol::BoardConfig config;
  for (std::size_t k = 0; k < info.lines.size() && k < protocol::kMaxLines; ++k) {
    config.lines[k].configured = true;
    config.lines[k].output = info.lines[k].output;
    config.lines[k].role = role_of(info.lines[k].name);
  }
  std::uint32_t named = 0;
  for (const LineConfig& line : lines) {
    const int k = info.line(line.line);
    if (k < 0)
      return Error{ErrorCode::unknown_name, fmt::format("the board has no line '{}'", line.line),
                   line_hint(info, line.line)};
    const std::uint32_t bit = 1U << static_cast<unsigned>(k);
    if ((named & bit) != 0)
      return Error{ErrorCode::bad_argument, fmt::format("line '{}' is configured twice", line.line),
                   "name each line once"};
    named |= bit;
    protocol::LineConfig& target = config.lines[k];
    SYMRIG_CHECK(check(line, info.lines[k]));
    fill(info, line, target);
  }
  return config;
}

protocol::ProgramRules program_rules(const BoardInfo& info, const protocol::BoardConfig& config) {
  protocol::ProgramRules rules;
  rules.config = &config;
  rules.min_dwell = static_cast<std::uint32_t>(info.min_dwell.count);
  rules.max_dwell = static_cast<std::uint32_t>(info.max_dwell.count);
  rules.wait_latency = static_cast<std::uint32_t>(info.wait_latency.count);
  rules.max_bytes = info.program_bytes;
  rules.loop_depth = info.loop_depth;
  for (std::size_t k = 0; k < info.lines.size() && k < protocol::kMaxLines; ++k)
    rules.no_waits[k] = static_cast<std::uint8_t>(7U & ~info.lines[k].waits);
  rules.queue_segments = info.queue_segments;
  rules.refill_ticks = info.refill_ticks;
  rules.poll_ticks = info.poll_ticks;
  return rules;
}

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

/// The edges that a program can wait for: a number of bits, an object as in `symrig info --json`, or a list
/// of names as in a firmware's manifest.
std::uint8_t waits_from(const Json& line) {
  if (!line.contains("waits")) return 7;
  const Json& waits = line.at("waits");
  if (waits.is_number()) return base::whole_number<std::uint8_t>(waits, "waits", {0, 7});
  const auto bit = [&waits](const char* edge, unsigned value) {
    const bool can = waits.is_array() ? std::find(waits.begin(), waits.end(), edge) != waits.end()
                                      : waits.at(edge).get<bool>();
    return can ? value : 0U;
  };
  return static_cast<std::uint8_t>(bit("rising", 1) | bit("falling", 2) | bit("both", 4));
}

/// More ticks than any board uses. A sum of several still fits into 64 bits.
constexpr std::uint64_t kManyTicks = std::uint64_t{1} << 40U;
/// Within these limits all conversions of ticks are exact.
constexpr std::uint64_t kSlowest = 1000, kFastest = 10'000'000'000;
constexpr std::size_t kMostLines = 32;

Ticks ticks_at(const Json& json, const char* key, std::uint64_t least) {
  return {base::whole_number_at<std::uint64_t>(json, key, {least, kManyTicks})};
}

/// Names go into files and to terminals, so control characters are refused.
std::string name_of(const std::string& name, bool may_be_empty = false) {
  constexpr std::size_t kLongest = 64;
  const auto control = [](unsigned char c) { return c < 0x20 || c == 0x7F; };
  const bool printable = std::none_of(name.begin(), name.end(), control);
  if (printable && name.size() <= kLongest && (may_be_empty || !name.empty())) return name;
  throw base::BadJson("a line's name or pin is empty, has control characters, or more than 64 bytes");
}

void check_board(const BoardInfo& board) {
  if (board.max_dwell < board.min_dwell) throw base::BadJson("'max_dwell' is less than 'min_dwell'");
  if (board.lines.size() > kMostLines) throw base::BadJson("it has more than 32 lines");
  for (std::size_t k = 0; k < board.lines.size(); ++k)
    if (board.line(board.lines[k].name) != static_cast<int>(k))
      throw base::BadJson(fmt::format("two lines have the name '{}'", board.lines[k].name));
}

/// In bytes, or in records of 8.
std::uint32_t program_bytes_of(const Json& json) {
  constexpr std::uint32_t kMost = 1U << 30U;
  if (json.contains("program_records"))
    return base::whole_number_at<std::uint32_t>(json, "program_records", {0, kMost / 8}) * 8;
  return base::whole_number_at<std::uint32_t>(json, "program_bytes", {0, kMost});
}

LineInfo line_info(const Json& line) {
  return {name_of(line.at("name").get<std::string>()),
          line.at("output").get<bool>(),
          name_of(line.value("pin", std::string()), true),
          waits_from(line),
          line.value("trips", false),
          base::whole_number_or<std::uint32_t>(line, "stamp_ticks", 1U)};
}

}  // namespace

Json parse_json(std::string_view text) {
  if (const auto shallow = check_json_nesting(text); !shallow) throw base::BadJson(shallow.error().what);
  return Json::parse(text);
}

BoardInfo board_from_json(const Json& json) {
  BoardInfo board;
  board.board = json.at(json.contains("name") ? "name" : "board").get<std::string>();
  board.firmware_version = json.value(json.contains("firmware") ? "firmware" : "firmware_version", "");
  board.unique_id = json.value(json.contains("serial") ? "serial" : "unique_id", "");
  board.rate = {base::whole_number_at<std::uint64_t>(json, "tick_hz", {kSlowest, kFastest})};
  board.min_dwell = ticks_at(json, "min_dwell", 1);
  board.max_dwell = ticks_at(json, "max_dwell", 1);
  board.wait_latency = ticks_at(json, "wait_latency", 0);
  board.program_bytes = program_bytes_of(json);
  board.loop_depth = base::whole_number_or(json, "loop_depth", protocol::kMaxLoopDepth);
  board.queue_segments = base::whole_number_or(json, "queue_segments", board.queue_segments);
  board.refill_ticks = base::whole_number_or(json, "refill_ticks", board.refill_ticks);
  board.poll_ticks = base::whole_number_or(json, "poll_ticks", board.poll_ticks);
  if (json.contains("lateness")) board.lateness = ticks_at(json, "lateness", 0);
  for (const Json& line : json.at("lines")) board.lines.push_back(line_info(line));
  check_board(board);
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
  line.hazard = static_cast<Hazard>(base::whole_number_at<int>(json, "hazard", {0, 2}));
  line.capture = json.at("capture").get<bool>();
  line.max_on =
      Nanoseconds(base::whole_number_at<std::int64_t>(json, "max_on_ns", {0, base::kLongestNanoseconds}));
  line.min_off =
      Nanoseconds(base::whole_number_at<std::int64_t>(json, "min_off_ns", {0, base::kLongestNanoseconds}));
  line.max_duty = json.at("max_duty").get<double>();
  if (!(line.max_duty > 0 && line.max_duty <= 1)) throw base::BadJson("'max_duty' is not between 0 and 1");
  if (const Json trip = json.value("trip_level", Json()); !trip.is_null()) line.trip_level = trip.get<bool>();
  return line;
}

namespace {

Error no_board(std::string_view why) {
  return {ErrorCode::bad_format, fmt::format("it does not describe a board: {}", why),
          "give the output of symrig info --json, a receipt of that board, or its firmware's manifest"};
}

}  // namespace

}  // namespace symrig::board

namespace symrig {

Result<BoardInfo> parse_board_file(std::string_view text) {
  try {
    board::Json json = board::parse_json(text);
    if (json.contains("capabilities"))
      json.update(board::Json(json.at("capabilities")));  // a firmware's manifest
    const bool inside = json.contains("board") && json.at("board").is_object();
    return board::board_from_json(inside ? json.at("board") : json);
  } catch (const board::Json::exception& error) {
    return board::no_board(error.what());
  } catch (const base::BadJson& error) {
    return board::no_board(error.what());
  }
}

std::string board_file_text(const BoardInfo& board) {
  return board::board_json(board).dump(1) + "\n";
}

}  // namespace symrig
