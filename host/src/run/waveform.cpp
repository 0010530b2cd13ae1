// SPDX-License-Identifier: Apache-2.0
#include "symrig/run/waveform.hpp"

#include "symrig/base/time.hpp"
#include "symrig/board/internal/explain.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig {

Waveform waveform(const Timeline& plan, const BoardInfo& board, std::string name) {
  Waveform out{std::move(name), plan.rate, plan.start, plan.end, plan.initial_levels, {}, {}, {}};
  std::uint32_t moved = 0;
  for (const PlannedEdge& edge : plan.edges) {
    moved |= 1U << static_cast<unsigned>(edge.line);
    out.edges.push_back({edge.line, edge.level, edge.tick});
  }
  for (std::size_t k = 0; k < board.lines.size(); ++k) {
    if (((moved >> k) & 1U) == 0) continue;
    out.lines.push_back(static_cast<int>(k));
    out.names.push_back(board.lines[k].name);
  }
  return out;
}

namespace {

constexpr std::uint64_t kNano = 1'000'000'000;

/// Identifier codes of a VCD: printable characters, "!" first.
std::string code_of(std::size_t index) {
  constexpr std::size_t kCodes = '~' - '!' + 1;
  std::string code;
  do {
    code += static_cast<char>('!' + index % kCodes);
    index /= kCodes;
  } while (index > 0);
  return code;
}

struct Change {
  std::uint64_t time;
  std::size_t signal;
  bool level;
};

/// Rounds times to the nearest ns, or to the nearest ps if a tick is not a whole number of nanoseconds.
class TimeScale {
 public:
  explicit TimeScale(std::span<const Waveform> waveforms)
      : pico_(std::any_of(waveforms.begin(), waveforms.end(),
                          [](const Waveform& one) { return kNano % one.rate.hz != 0; })) {}

  const char* unit() const { return pico_ ? "1 ps" : "1 ns"; }
  std::uint64_t time(const Waveform& waveform, Ticks tick) const {
    const Ticks since = tick < waveform.origin ? Ticks{} : tick - waveform.origin;
    if (!pico_) return since.count * (kNano / waveform.rate.hz);
    const std::uint64_t whole = since.count / waveform.rate.hz;
    const std::uint64_t rest = since.count % waveform.rate.hz;
    // Two steps of 1e6, because rest * 1e12 would overflow (rest < hz <= 1e10).
    const std::uint64_t micro = rest * 1'000'000 / waveform.rate.hz;
    const std::uint64_t left = rest * 1'000'000 % waveform.rate.hz;
    return (whole * 1'000'000 + micro) * 1'000'000 +
           (left * 1'000'000 + waveform.rate.hz / 2) / waveform.rate.hz;
  }

 private:
  bool pico_;
};

std::vector<Change> changes_of(std::span<const Waveform> waveforms, const TimeScale& scale) {
  std::vector<Change> changes;
  std::size_t first = 0;
  for (const Waveform& waveform : waveforms) {
    for (const CapturedEdge& edge : waveform.edges) {
      const auto found = std::find(waveform.lines.begin(), waveform.lines.end(), edge.line);
      if (found == waveform.lines.end()) continue;
      const auto signal = first + static_cast<std::size_t>(found - waveform.lines.begin());
      changes.push_back({scale.time(waveform, edge.tick), signal, edge.level});
    }
    first += waveform.lines.size();
  }
  std::stable_sort(changes.begin(), changes.end(),
                   [](const Change& a, const Change& b) { return a.time < b.time; });
  return changes;
}

std::string declarations(std::span<const Waveform> waveforms) {
  std::string text;
  std::size_t signal = 0;
  for (const Waveform& waveform : waveforms) {
    text += fmt::format("$scope module {} $end\n", waveform.name);
    for (const std::string& name : waveform.names)
      text += fmt::format("$var wire 1 {} {} $end\n", code_of(signal++), name);
    text += "$upscope $end\n";
  }
  return text;
}

std::string initial_values(std::span<const Waveform> waveforms) {
  std::string text = "$dumpvars\n";
  std::size_t signal = 0;
  for (const Waveform& waveform : waveforms)
    for (const int line : waveform.lines)
      text += fmt::format("{}{}\n", (waveform.initial_levels >> static_cast<unsigned>(line)) & 1U,
                          code_of(signal++));
  return text + "$end\n";
}

}  // namespace

std::string vcd_text(std::span<const Waveform> waveforms) {
  const TimeScale scale(waveforms);
  std::string text = fmt::format("$version symrig $end\n$timescale {} $end\n", scale.unit());
  text += declarations(waveforms) + "$enddefinitions $end\n#0\n" + initial_values(waveforms);
  std::uint64_t now = 0;
  for (const Change& change : changes_of(waveforms, scale)) {
    if (change.time != now) text += fmt::format("#{}\n", change.time);
    now = change.time;
    text += fmt::format("{}{}\n", change.level ? 1 : 0, code_of(change.signal));
  }
  std::uint64_t end = now;
  for (const Waveform& waveform : waveforms) end = std::max(end, scale.time(waveform, waveform.end));
  if (end != now) text += fmt::format("#{}\n", end);
  return text;
}

namespace {

using Json = nlohmann::ordered_json;

/// Time since the origin, so that waveforms of different clocks share one axis.
Nanoseconds since(const Waveform& waveform, Ticks tick) {
  return waveform.rate.nanoseconds(tick < waveform.origin ? Ticks{} : tick - waveform.origin);
}

/// Every moment with a change, beginning with 0.
std::vector<Nanoseconds> moments(std::span<const Waveform> waveforms) {
  std::vector<Nanoseconds> times{Nanoseconds{0}};
  for (const Waveform& waveform : waveforms)
    for (const CapturedEdge& edge : waveform.edges) times.push_back(since(waveform, edge.tick));
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

/// "01.0": the level in each column; "." means no change.
std::string wave_of(const Waveform& waveform, int line, const std::vector<Nanoseconds>& times) {
  std::map<Nanoseconds, bool> levels;
  levels[Nanoseconds{0}] = ((waveform.initial_levels >> static_cast<unsigned>(line)) & 1U) != 0;
  for (const CapturedEdge& edge : waveform.edges)
    if (edge.line == line) levels[since(waveform, edge.tick)] = edge.level;
  std::string wave;
  char last = ' ';
  for (const Nanoseconds time : times) {
    const auto found = levels.find(time);
    const char level = found == levels.end() ? last : (found->second ? '1' : '0');
    wave += level == last ? '.' : level;
    last = level;
  }
  return wave;
}

Json time_row(const std::vector<Nanoseconds>& times) {
  Json data = Json::array();
  for (const Nanoseconds time : times) data.push_back(base::duration_text(time));
  return {{"name", "time"}, {"wave", std::string(times.size(), '=')}, {"data", std::move(data)}};
}

}  // namespace

std::string wavedrom_text(std::span<const Waveform> waveforms, std::size_t max_columns) {
  std::vector<Nanoseconds> times = moments(waveforms);
  const std::size_t all = times.size();
  times.resize(std::min(all, std::max<std::size_t>(1, max_columns)));
  Json signal = Json::array();
  signal.push_back(time_row(times));
  for (const Waveform& waveform : waveforms) {
    Json group = Json::array({waveform.name});
    for (std::size_t k = 0; k < waveform.lines.size(); ++k)
      group.push_back({{"name", waveform.names[k]}, {"wave", wave_of(waveform, waveform.lines[k], times)}});
    signal.push_back(std::move(group));
  }
  Json document{{"signal", std::move(signal)}, {"config", {{"hscale", 2}}}};
  if (times.size() < all)
    document["foot"] = {{"text", fmt::format("the first {} of {} moments", times.size(), all)}};
  return document.dump(1) + "\n";
}

}  // namespace symrig
