// SPDX-License-Identifier: Apache-2.0
#include "program/passes.hpp"
#include "symrig/base/internal/json_reader.hpp"
#include "symrig/board/internal/board_forms.hpp"
#include "symrig/board/internal/explain.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/protocol/crc32c.hpp"
#include "symrig/protocol/types.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>

namespace symrig {
namespace {

using Json = nlohmann::ordered_json;

// "SYMPROG\n" | u32 version | u32 bytes of the header | u32 bytes of records | u32 CRC-32C of all that
// follows
constexpr std::string_view kMagic = "SYMPROG\n";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHead = 24;

Json wiring_json(const RigWiring& wiring) {
  return {{"projector", wiring.projector},
          {"vsync", wiring.vsync},
          {"camera", wiring.camera},
          {"strobe", wiring.strobe},
          {"active_low", wiring.active_low},
          {"refresh_ns", wiring.refresh.count()},
          {"readout_ns", wiring.readout.count()}};
}

Nanoseconds nanoseconds_at(const Json& json, const char* key) {
  return Nanoseconds(base::whole_number_at<std::int64_t>(json, key, {0, base::kLongestNanoseconds}));
}

RigWiring wiring_from_json(const Json& json) {
  const auto text = [&json](const char* key) { return json.at(key).get<std::string>(); };
  return {text("projector"), text("vsync"), text("camera"), text("strobe"),
          json.at("active_low").get<std::vector<std::string>>(), nanoseconds_at(json, "refresh_ns"),
          // Files of earlier versions do not have it.
          json.contains("readout_ns") ? nanoseconds_at(json, "readout_ns") : RigWiring{}.readout};
}

Json header(const CompiledProgram& program) {
  Json lines = Json::array();
  for (const LineConfig& line : program.lines) lines.push_back(board::line_json(line));
  const auto hash = config_hash(program);
  return {{"board", board::board_json(program.board)},
          {"lines", std::move(lines)},
          {"keep_alive_ns", program.keep_alive.count()},
          {"program_hash", fmt::format("{:08x}", program.program.hash())},
          {"config_hash", hash ? fmt::format("{:08x}", *hash) : ""},
          {"wiring", wiring_json(program.wiring)},
          {"scan", program.is_scan},
          {"patterns", program.patterns},
          {"exposures", program.exposures},
          {"steps", program.steps},
          {"shortest_ns", program.shortest.count()},
          {"longest_ns", program.longest.count()},
          {"expected_ns", program.expected.count()},
          {"on_time_ns", program.on_time ? Json(program.on_time->count()) : Json()},
          {"places", program.places}};
}

Error broken(std::string_view why) {
  return {ErrorCode::bad_format, fmt::format("it is not a complete compiled program: {}", why),
          "compile it again"};
}

CompiledProgram from_header(const Json& json) {
  CompiledProgram program;
  program.board = board::board_from_json(json.at("board"));
  for (const Json& line : json.at("lines")) program.lines.push_back(board::line_from_json(line));
  program.keep_alive = nanoseconds_at(json, "keep_alive_ns");
  program.wiring = wiring_from_json(json.at("wiring"));
  program.is_scan = json.at("scan").get<bool>();
  program.patterns = base::whole_number_at<std::uint64_t>(json, "patterns");
  program.exposures = base::whole_number_at<std::uint64_t>(json, "exposures");
  program.steps = base::whole_number_at<std::uint64_t>(json, "steps");
  program.shortest = nanoseconds_at(json, "shortest_ns");
  program.longest = nanoseconds_at(json, "longest_ns");
  program.expected = nanoseconds_at(json, "expected_ns");
  if (!json.at("on_time_ns").is_null()) program.on_time = nanoseconds_at(json, "on_time_ns");
  for (const Json& place : json.at("places"))
    program.places.push_back(base::whole_number<int>(place, "places", {0, std::numeric_limits<int>::max()}));
  return program;
}

/// Checks that the header agrees with the records and the configuration of the lines.
Result<void> check_header(const Json& json, const CompiledProgram& program) {
  if (program.places.size() != program.program.records())
    return broken("its places do not match its records");
  if (json.at("program_hash") != fmt::format("{:08x}", program.program.hash()))
    return broken("its records do not match its header");
  const auto hash = config_hash(program);
  if (!hash) return broken(hash.error().what);
  if (json.at("config_hash") != fmt::format("{:08x}", *hash))
    return broken("the configuration of its lines does not match its header");
  CompiledProgram timed = program;
  program::fill_durations(timed);
  if (timed.steps != program.steps || timed.shortest != program.shortest || timed.longest != program.longest)
    return broken("its durations do not match its records");
  return {};
}

}  // namespace

Result<std::uint32_t> config_hash(const CompiledProgram& program) {
  SYMRIG_TRY(const auto config, board::line_setup(program.board, program.lines));
  return protocol::config_hash(config);
}

bool looks_like_symprog(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
}

std::vector<std::uint8_t> symprog_bytes(const CompiledProgram& program) {
  const std::string text = header(program).dump();
  const auto records = program.program.bytes();
  std::vector<std::uint8_t> bytes(kHead + text.size() + records.size());
  std::copy(kMagic.begin(), kMagic.end(), bytes.begin());
  std::copy(text.begin(), text.end(), bytes.begin() + kHead);
  std::copy(records.begin(), records.end(), bytes.end() - std::ssize(records));
  protocol::put_u32(bytes.data() + 8, kVersion);
  protocol::put_u32(bytes.data() + 12, static_cast<std::uint32_t>(text.size()));
  protocol::put_u32(bytes.data() + 16, static_cast<std::uint32_t>(records.size()));
  protocol::put_u32(bytes.data() + 20, protocol::crc32c({bytes.data() + kHead, bytes.size() - kHead}));
  return bytes;
}

Result<CompiledProgram> read_symprog(std::span<const std::uint8_t> bytes) {
  if (!looks_like_symprog(bytes) || bytes.size() < kHead)
    return broken("it does not begin like a compiled program");
  const std::uint32_t version = protocol::get_u32(bytes.data() + 8);
  const std::uint64_t text_size = protocol::get_u32(bytes.data() + 12);
  const std::uint64_t records_size = protocol::get_u32(bytes.data() + 16);
  if (version != kVersion)
    return broken(fmt::format("it has version {}, this host knows version {}", version, kVersion));
  if (bytes.size() - kHead != text_size + records_size) return broken("its length is wrong");
  const auto body = bytes.subspan(kHead);
  if (protocol::crc32c({body.data(), body.size()}) != protocol::get_u32(bytes.data() + 20))
    return broken("its CRC is wrong");
  const auto text = body.first(text_size);
  const auto records = body.subspan(text_size);
  try {
    const Json json = board::parse_json({reinterpret_cast<const char*>(text.data()), text.size()});
    CompiledProgram program = from_header(json);
    SYMRIG_TRY(program.program, Program::from_bytes({records.begin(), records.end()}));
    SYMRIG_CHECK(check_header(json, program));
    return program;
  } catch (const Json::exception& error) {
    return broken(error.what());
  } catch (const base::BadJson& error) {
    return broken(error.what());
  }
}

Result<void> check_board_fits(const CompiledProgram& program, const BoardInfo& board) {
  const BoardInfo& made_for = program.board;
  const auto differs = [](std::string_view what, const std::string& there, const std::string& here) {
    return Error{
        ErrorCode::device_refused,
        fmt::format("the program was compiled for a board with {} {}, this one has {}", what, there, here),
        "compile it for this board: symrig compile FILE --board URI"};
  };
  if (board.rate.hz != made_for.rate.hz)
    return differs("a tick rate of", std::to_string(made_for.rate.hz), std::to_string(board.rate.hz));
  for (std::size_t k = 0; k < made_for.lines.size(); ++k) {
    const LineInfo& line = made_for.lines[k];
    const bool same =
        k < board.lines.size() && board.lines[k].name == line.name && board.lines[k].output == line.output;
    if (!same)
      return differs(fmt::format("line {}", k), line.name,
                     k < board.lines.size() ? board.lines[k].name : "none");
  }
  if (board.wait_latency != made_for.wait_latency)
    return differs("a wait latency of", board::ticks_text(made_for, made_for.wait_latency.count),
                   board::ticks_text(board, board.wait_latency.count));
  return {};
}

}  // namespace symrig
