// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/internal/json_reader.hpp"
#include "symrig/board/internal/board_forms.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/run/run.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

namespace symrig {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "symrig-receipt";

std::string hex(std::uint32_t hash) {
  return fmt::format("{:08x}", hash);
}

/// The shortest and the longest time of one line at each level.
class LineStatistics {
 public:
  void take(const CapturedEdge& edge) {
    if (count_++ > 0) {
      Range& range = edge.level ? low_ : high_;  // of the level that ends at this edge
      const std::uint64_t ticks = (edge.tick - last_).count;
      range.least = std::min(range.least, ticks);
      range.most = std::max(range.most, ticks);
    }
    last_ = edge.tick;
  }
  Json json(const TickRate& rate) const {
    return {{"edges", count_}, {"high_ns", high_.json(rate)}, {"low_ns", low_.json(rate)}};
  }
  std::uint64_t count() const { return count_; }

 private:
  struct Range {
    std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t most = 0;
    Json json(const TickRate& rate) const {
      if (least > most) return {};
      return Json::array({rate.nanoseconds(Ticks{least}).count(), rate.nanoseconds(Ticks{most}).count()});
    }
  };
  std::uint64_t count_ = 0;
  Ticks last_;
  Range high_, low_;
};

Json lines_json(const RunRecord& record) {
  const BoardInfo& board = record.program.board;
  std::vector<LineStatistics> statistics(board.lines.size());
  for (const CapturedEdge& edge : record.receipt.edges)
    if (edge.line >= 0 && static_cast<std::size_t>(edge.line) < statistics.size())
      statistics[edge.line].take(edge);
  Json lines = Json::array();
  for (const LineConfig& line : record.program.lines) {
    const int k = board.line(line.line);
    Json one = board::line_json(line);
    one["index"] = k;
    one["stamp_ns"] =
        k < 0 ? Json() : Json(board.rate.nanoseconds(Ticks{board.lines[k].stamp_ticks}).count());
    one["captured"] = k < 0 ? Json() : statistics[k].json(board.rate);
    lines.push_back(std::move(one));
  }
  return lines;
}

/// Edges as [line, level, ticks since the start], at most `most`.
Json edges_json(std::span<const CapturedEdge> edges, Ticks start, std::size_t most) {
  Json list = Json::array();
  for (const CapturedEdge& edge : edges.first(std::min(edges.size(), most)))
    list.push_back(Json::array(
        {edge.line, edge.level ? 1 : 0, static_cast<std::int64_t>(edge.tick.count - start.count)}));
  return {{"count", edges.size()}, {"listed", list.size()}, {"edges", std::move(list)}};
}

Json plan_json(const RunRecord& record, std::size_t most) {
  std::vector<CapturedEdge> edges;
  for (const PlannedEdge& edge : record.plan.edges) edges.push_back({edge.line, edge.level, edge.tick});
  Json plan = edges_json(edges, record.receipt.started, most);
  plan["complete"] = record.plan.complete;
  plan["cut_off"] = record.plan.cut_off;
  plan["end"] = record.plan.end.count - record.receipt.started.count;
  plan["initial_levels"] = record.plan.initial_levels;
  plan["waits"] = record.plan.waits.size();
  return plan;
}

Json differences_json(const RunRecord& record) {
  const Comparison& all = record.differences;
  const double tick = 1e9 / static_cast<double>(record.program.board.rate.hz);
  return {{"paired", all.pairs.size()},        {"missing", all.missing.size()},
          {"unplanned", all.unplanned.size()}, {"largest_ns", static_cast<double>(all.largest) * tick},
          {"mean_ns", all.mean * tick},        {"exact", all.exact()}};
}

Json ledger_json(const RunRecord& record) {
  if (!record.ledger) return {};
  const FrameLedger& ledger = *record.ledger;
  Json missing = Json::array();
  for (const LedgerEntry& entry : ledger.entries())
    if (!entry.frame && missing.size() < 1000)
      missing.push_back(Json::array({entry.photograph, entry.exposure}));
  return {{"exposures", ledger.entries().size()}, {"missing", ledger.missing()},
          {"unasked", ledger.unasked().size()},   {"complete", ledger.complete()},
          {"summary", ledger.summary()},          {"first_missing", std::move(missing)}};
}

Json fault_json(const Receipt& receipt) {
  if (!receipt.fault) return {};
  return {{"code", receipt.fault->code},
          {"name", receipt.fault->name},
          {"hint", receipt.fault->hint},
          {"tick", receipt.fault->tick.count},
          {"arg", receipt.fault->arg}};
}

Json reason_json(const RunRecord& record) {
  const auto error = run_error(record);
  return error ? Json(error->line()) : Json();
}

Json clock_json(const ClockNote& clock) {
  return {{"known", clock.known},
          {"bound_ns", clock.known ? Json(clock.bound.count()) : Json()},
          {"drift", Json::array({clock.drift_lowest, clock.drift_highest})},
          {"readings", clock.readings},
          {"contradiction", clock.contradiction.empty() ? Json() : Json(clock.contradiction)}};
}

Json time_json(const RunRecord& record) {
  const Receipt& receipt = record.receipt;
  return {{"started_tick", receipt.started.count},
          {"duration_ns", receipt.duration().count()},
          {"planned_min_ns", receipt.rate.nanoseconds(receipt.planned_min).count()},
          {"planned_max_ns", receipt.rate.nanoseconds(receipt.planned_max).count()},
          {"expected_ns", record.program.expected.count()}};
}

}  // namespace

std::string receipt_json(const RunRecord& record, std::size_t max_edges) {
  const Receipt& receipt = record.receipt;
  Json json{{"format", kFormat}, {"version", 1}};
  json["end"] = name(receipt.end);
  json["clean"] = receipt.clean() && !run_error(record);
  json["interrupted"] = record.interrupted;
  json["reason"] = reason_json(record);
  json["fault"] = fault_json(receipt);
  json["hashes"] = {{"program", hex(receipt.program_hash)},
                    {"config", hex(receipt.config_hash)},
                    {"firmware", fmt::format("{:016x}", receipt.firmware_hash)}};
  json["board"] = board::board_json(record.program.board);
  json["time"] = time_json(record);
  json["clock"] = clock_json(record.clock);
  json["counters"] = {{"steps", receipt.steps},
                      {"underruns", receipt.underruns},
                      {"late", receipt.late},
                      {"events_lost", receipt.events_lost},
                      {"marks", receipt.marks.size()}};
  json["differences"] = differences_json(record);
  json["ledger"] = ledger_json(record);
  json["lines"] = lines_json(record);
  json["planned"] = plan_json(record, max_edges);
  json["captured"] = edges_json(receipt.edges, receipt.started, max_edges);
  return json.dump() + "\n";
}

namespace {

/// Reads the times of a receipt: ticks since the start of the run.
class RunClock {
 public:
  RunClock(const Json& json, TickRate rate)
      : start_{base::whole_number_at<std::uint64_t>(json.at("time"), "started_tick", {0, kLastStart})},
        most_(static_cast<std::int64_t>(std::min(kLongest * rate.hz, kLastStart))) {}

  Ticks start() const { return start_; }
  /// An edge before the start has a negative time.
  Ticks tick(const Json& since) const {
    const std::int64_t least = -static_cast<std::int64_t>(std::min<std::uint64_t>(start_.count, kLastStart));
    const auto ticks =
        base::whole_number<std::int64_t>(since, "ticks since the start", {std::max(least, -most_), most_});
    return Ticks{start_.count + static_cast<std::uint64_t>(ticks)};
  }

 private:
  static constexpr std::uint64_t kLastStart = std::uint64_t{1} << 62U;
  /// 200 days in seconds. As picoseconds they still fit into 64 bits.
  static constexpr std::uint64_t kLongest = std::uint64_t{200} * 86'400;

  Ticks start_;
  std::int64_t most_;
};

std::vector<CapturedEdge> read_edges(const Json& json, const RunClock& clock, std::size_t lines) {
  std::vector<CapturedEdge> edges;
  for (const Json& edge : json.at("edges"))
    edges.push_back({base::whole_number<int>(edge.at(0), "line of an edge", {0, static_cast<int>(lines) - 1}),
                     base::whole_number<int>(edge.at(1), "level of an edge", {0, 1}) != 0,
                     clock.tick(edge.at(2))});
  const auto listed = base::whole_number_at<std::uint64_t>(json, "listed");
  if (listed != edges.size()) throw base::BadJson("'listed' is not the number of edges in the list");
  base::whole_number_at<std::uint64_t>(json, "count", {listed, std::numeric_limits<std::uint64_t>::max()});
  return edges;
}

StoredRun from_json(const Json& json) {
  StoredRun run;
  run.board = board::board_from_json(json.at("board"));
  const RunClock clock(json, run.board.rate);
  const std::size_t known = run.board.lines.size();
  const Json& planned = json.at("planned");
  run.plan.rate = run.board.rate;
  run.plan.start = clock.start();
  run.plan.end = std::max(clock.tick(planned.at("end")), clock.start());
  run.plan.initial_levels = base::whole_number_at<std::uint32_t>(planned, "initial_levels");
  run.plan.complete = planned.at("complete").get<bool>();
  for (const CapturedEdge& edge : read_edges(planned, clock, known))
    run.plan.edges.push_back({edge.line, edge.level, edge.tick, 0});
  run.captured = read_edges(json.at("captured"), clock, known);
  std::vector<LineConfig> lines;
  for (const Json& line : json.at("lines")) lines.push_back(board::line_from_json(line));
  run.watched = watched_outputs(run.board, lines);
  run.whole = planned.at("count") == planned.at("listed") &&
              json.at("captured").at("count") == json.at("captured").at("listed");
  return run;
}

Error no_receipt(std::string_view why) {
  return {ErrorCode::bad_format, fmt::format("it is not the receipt of a run: {}", why),
          "give a file from symrig run -o"};
}

}  // namespace

Result<StoredRun> read_receipt(std::string_view text) {
  try {
    const Json json = board::parse_json(text);
    if (!json.is_object() || json.value("format", "") != kFormat)
      return no_receipt("it does not name itself a receipt");
    if (json.at("version") != 1) return no_receipt("its version is not 1");
    return from_json(json);
  } catch (const Json::exception& error) {
    return no_receipt(error.what());
  } catch (const base::BadJson& error) {
    return no_receipt(error.what());
  }
}

}  // namespace symrig
