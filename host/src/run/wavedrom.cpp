// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/time.hpp"
#include "symrig/board/internal/explain.hpp"
#include "symrig/run/waveform.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig {
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
