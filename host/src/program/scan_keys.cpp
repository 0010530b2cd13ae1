// SPDX-License-Identifier: Apache-2.0
#include "program/file_keys.hpp"

#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

namespace symrig::program {
namespace {

template <class T>
using Choices = std::array<std::pair<std::string_view, T>, 2>;

constexpr Choices<ScanOrder> kOrders{
    {{"pattern-outer", ScanOrder::pattern_outer}, {"bracket-outer", ScanOrder::bracket_outer}}};
constexpr Choices<Advance> kAdvances{
    {{"pattern", Advance::each_pattern}, {"exposure", Advance::each_exposure}}};
constexpr Choices<OnTimeout> kActions{{{"abort", OnTimeout::abort}, {"continue", OnTimeout::keep_going}}};
constexpr std::uint64_t kMaxBracket = 1000;
constexpr std::uint64_t kMaxStartup = 1000;

PatternGroup read_group(const base::TomlNode& node, int bits, base::ReadContext& context) {
  base::TableReader table(node, "program.patterns", context);
  PatternGroup group;
  group.place = node.line;
  auto depth = static_cast<std::uint64_t>(bits);
  table.read("name", group.name);
  table.read_count("count", group.count, 1, kMaxRounds);
  table.read_count("bits", depth, 1, 16);
  group.bits = static_cast<int>(depth);
  table.finish();
  return group;
}

void read_patterns(base::TableReader& table, Scan& scan) {
  std::uint64_t bits = 1;
  table.read_count("bits", bits, 1, 16);
  table.require("patterns", "the number of patterns, or [{ count = 4, bits = 1 }, ...]");
  const base::TomlNode* node = table.find("patterns");
  if (node == nullptr) return;
  if (node->kind == base::TomlNode::Kind::integer) {
    PatternGroup group;
    group.place = node->line;
    group.bits = static_cast<int>(bits);
    table.read_count("patterns", group.count, 1, kMaxRounds);
    scan.patterns.push_back(group);
  } else if (node->kind == base::TomlNode::Kind::array && !node->children.empty()) {
    for (const base::TomlNode& item : node->children)
      scan.patterns.push_back(read_group(item, static_cast<int>(bits), table.context()));
  } else {
    table.fail("patterns", fmt::format("is {}", node->kind_text()),
               "give the number of patterns, or a list [{ count = 4, bits = 1 }, ...]");
  }
}

/// shortest × ratio^j, each rounded to the nearest nanosecond.
void read_series(base::TableReader& table, Scan& scan) {
  Nanoseconds shortest{0};
  std::uint64_t count = 0;
  table.require("shortest", "the shortest exposure");
  table.require("ratio", "the ratio between exposures");
  table.require("count", "how many exposures");
  table.read("shortest", shortest);
  table.read_count("count", count, 1, kMaxBracket);
  double ratio = 0;
  if (const base::TomlNode* node = table.find("ratio"))
    ratio = node->kind == base::TomlNode::Kind::integer ? static_cast<double>(node->integer) : node->real;
  table.finish();
  if (!table.ok()) return;
  if (!(ratio > 1 && ratio <= 1000))
    return table.fail("ratio", "is out of range", "give a number above 1 and at most 1000");
  for (std::uint64_t j = 0; j < count; ++j) {
    const double ns = static_cast<double>(shortest.count()) * std::pow(ratio, static_cast<double>(j));
    if (ns > 1e15)
      return table.fail("count", "the longest exposure is above 11 days", "use a smaller count or ratio");
    scan.bracket.emplace_back(std::llround(ns));
  }
}

void read_bracket(base::TableReader& table, Scan& scan) {
  table.require("bracket", R"(["1 ms", ...] or { shortest = "100 us", ratio = 4, count = 5 })");
  const base::TomlNode* node = table.find("bracket");
  if (node == nullptr) return;
  scan.bracket_place = node->line;
  if (node->kind == base::TomlNode::Kind::table) {
    base::TableReader series(*node, "program.bracket", table.context());
    return read_series(series, scan);
  }
  if (node->kind != base::TomlNode::Kind::array || node->children.empty() ||
      node->children.size() > kMaxBracket)
    return table.fail("bracket", "is not a list of exposures",
                      R"(give ["1 ms", ...] or { shortest = "100 us", ratio = 4, count = 5 })");
  for (const base::TomlNode& item : node->children) {
    Nanoseconds exposure{0};
    read_duration(item, "program.bracket", table.context(), exposure);
    scan.bracket.push_back(exposure);
  }
}

void read_optional(base::TableReader& table, std::string_view key, std::optional<Nanoseconds>& value,
                   int& place) {
  Nanoseconds duration{0};
  place = table.line_of(key);
  if (table.read(key, duration)) value = duration;
}

void read_start_marker(base::TableReader& table, Scan& scan) {
  const base::TomlNode* node = table.find("start_marker");
  if (node == nullptr) return;
  base::TableReader keys(*node, "program.start_marker", table.context());
  StartMarker marker;
  marker.place = node->line;
  keys.require("line", "the line whose first pulse is longer");
  keys.require("stretch", "the additional length of that pulse");
  keys.read("line", marker.line);
  keys.read("stretch", marker.stretch);
  keys.finish();
  scan.start_marker = marker;
}

void read_startup(base::TableReader& table, Scan& scan) {
  const base::TomlNode* node = table.find("startup");
  if (node == nullptr) return;
  base::TableReader keys(*node, "program.startup", table.context());
  StartupPulses startup;
  startup.place = node->line;
  keys.require("pulses", "the number of exposures before the first pattern");
  keys.require("exposure", "their length");
  keys.read_count("pulses", startup.pulses, 1, kMaxStartup);
  keys.read("exposure", startup.exposure);
  keys.finish();
  scan.startup = startup;
}

}  // namespace

void read_scan(base::TableReader& table, Scan& scan) {
  scan.place = table.line();
  read_patterns(table, scan);
  read_bracket(table, scan);
  table.read_choice<ScanOrder>("order", scan.order, kOrders);
  table.read_choice<Advance>("advance", scan.advance, kAdvances);
  table.read_choice<OnTimeout>("on_timeout", scan.on_timeout, kActions);
  table.read_count("repeat", scan.repeat, 1, kMaxRounds);
  read_optional(table, "settle", scan.settle, scan.settle_place);
  read_optional(table, "gap", scan.gap, scan.gap_place);
  read_optional(table, "on_time", scan.on_time, scan.on_time_place);
  scan.lamp_place = table.line_of("lamp");
  table.read("lamp", scan.lamp);
  read_start_marker(table, scan);
  read_startup(table, scan);
}

}  // namespace symrig::program

namespace symrig {

std::uint64_t Scan::pattern_count() const {
  return std::accumulate(patterns.begin(), patterns.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const PatternGroup& group) { return sum + group.count; });
}

}  // namespace symrig
