// SPDX-License-Identifier: Apache-2.0
#include "program/file_keys.hpp"
#include "symrig/base/text.hpp"

#include <array>

#include <fmt/format.h>

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
