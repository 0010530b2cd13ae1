// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/text.hpp"
#include "symrig/program/internal/file_keys.hpp"

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

namespace symrig::program {
namespace {

using Kind = FileStep::Kind;

template <class T, std::size_t N>
using StepChoices = std::array<std::pair<std::string_view, T>, N>;

constexpr StepChoices<Kind, 8> kKinds{{{"set", Kind::set},
                                       {"hold", Kind::hold},
                                       {"pulse", Kind::pulse},
                                       {"wait", Kind::wait},
                                       {"mark", Kind::mark},
                                       {"loop", Kind::loop},
                                       {"pattern", Kind::pattern},
                                       {"expose", Kind::expose}}};
constexpr StepChoices<bool, 2> kOn{{{"on", true}, {"off", false}}};
constexpr StepChoices<EdgeKind, 3> kEdges{
    {{"rising", EdgeKind::rising}, {"falling", EdgeKind::falling}, {"both", EdgeKind::both}}};
constexpr StepChoices<OnTimeout, 2> kWaitActions{
    {{"abort", OnTimeout::abort}, {"continue", OnTimeout::keep_going}}};
constexpr std::uint64_t kMaxMark = (std::uint64_t{1} << 28U) - 2;  // the next one marks start-up pulses
constexpr int kMaxNesting = 16;

void read_loop(base::TableReader& table, FileStep& step, int depth);

/// "did you mean 'hold'? " for the first key that is almost a step's name.
std::string misspelt_kind(const base::TomlNode& node) {
  std::vector<std::string_view> known;
  for (const auto& [word, kind] : kKinds) known.push_back(word);
  for (const base::TomlNode& child : node.children)
    if (std::string text = suggestion(child.key, known); !text.empty()) return text;
  return {};
}

FileStep read_step(const base::TomlNode& node, const std::string& path, base::ReadContext& context,
                   int depth) {
  base::TableReader table(node, path, context);
  FileStep step;
  step.place = node.line;
  int kinds = 0;
  for (const auto& [word, kind] : kKinds) {
    if (!table.has(word)) continue;
    step.kind = kind;
    ++kinds;
  }
  if (kinds != 1) {
    const std::string misspelt = kinds == 0 ? misspelt_kind(node) : std::string();
    context.fail(node.line,
                 fmt::format("{}: a step does {}", path, kinds == 0 ? "nothing" : "more than one thing"),
                 misspelt + "each step has one of: set, hold, pulse, wait, mark, loop, pattern, expose");
    return step;
  }
  switch (step.kind) {
    case Kind::set:
      table.read("set", step.line);
      table.require("to", R"(to = "on" or to = "off")");
      table.read_choice<bool>("to", step.on, kOn);
      break;
    case Kind::hold:
      table.read("hold", step.time);
      break;
    case Kind::pulse:
      table.read("pulse", step.line);
      table.require("width", "its width as a duration");
      table.read("width", step.time);
      break;
    case Kind::wait:
      table.read("wait", step.line);
      table.require("timeout", "the longest time to wait");
      table.read("timeout", step.time);
      table.read_choice<EdgeKind>("edge", step.edge, kEdges);
      table.read_choice<OnTimeout>("on_timeout", step.on_timeout, kWaitActions);
      break;
    case Kind::mark:
      table.read_count("mark", step.count, 0, kMaxMark);
      break;
    case Kind::loop:
      read_loop(table, step, depth);
      break;
    case Kind::pattern: {
      bool next = true;
      table.read("pattern", next);
      if (!next) table.fail("pattern", "false has no meaning", "write pattern = true, or remove the step");
      break;
    }
    case Kind::expose:
      table.read("expose", step.time);
      break;
  }
  table.finish();
  return step;
}

std::vector<FileStep> read_list(const base::TomlNode& list, const std::string& path,
                                base::ReadContext& context, int depth) {
  std::vector<FileStep> steps;
  if (list.kind != base::TomlNode::Kind::array || list.children.empty()) {
    context.fail(list.line, fmt::format("{} is not a list of steps", path),
                 "give [{ hold = \"1 ms\" }, ...] or [[program.steps]] tables");
    return steps;
  }
  for (const base::TomlNode& item : list.children) steps.push_back(read_step(item, path, context, depth));
  return steps;
}

void read_loop(base::TableReader& table, FileStep& step, int depth) {
  table.read_count("loop", step.count, 1, kMaxRounds);
  table.require("steps", "the steps inside the loop");
  const base::TomlNode* body = table.find("steps");
  if (body == nullptr) return;
  if (depth == kMaxNesting)
    return table.fail("steps", "loops are nested too deeply", "boards allow 4 levels");
  step.steps = read_list(*body, table.path_of("steps"), table.context(), depth + 1);
}

}  // namespace

std::vector<FileStep> read_steps(const base::TomlNode& list, const std::string& path,
                                 base::ReadContext& context) {
  return read_list(list, path, context, 0);
}

}  // namespace symrig::program
