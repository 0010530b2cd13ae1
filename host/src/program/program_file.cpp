// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/program_file.hpp"

#include "program/file_keys.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr std::uint64_t kMaxFile = 4U << 20U;

void read_program(base::TableReader& top, ProgramFile& file) {
  top.require("program", "a [program] table");
  const base::TomlNode* node = top.find("program");
  if (node == nullptr) return;
  base::TableReader table(*node, "program", top.context());
  const base::TomlNode* steps = node->kind == base::TomlNode::Kind::table ? table.find("steps") : nullptr;
  if (steps != nullptr) {
    file.steps = program::read_steps(*steps, "program.steps", top.context());
    if (table.has("patterns") || table.has("bracket"))
      table.fail("steps", "cannot be used together with patterns and a bracket",
                 "give either steps, or patterns and a bracket");
  } else {
    file.scan.emplace();
    program::read_scan(table, *file.scan);
  }
  table.finish();
}

}  // namespace

bool has_step(const std::vector<FileStep>& steps, FileStep::Kind kind) {
  return std::any_of(steps.begin(), steps.end(), [kind](const FileStep& step) {
    return step.kind == kind || has_step(step.steps, kind);
  });
}

Result<ProgramFile> parse_program_file(std::string_view text, const std::string& name,
                                       const std::filesystem::path& folder) {
  SYMRIG_TRY(const base::TomlNode document, base::parse_toml(text, name));
  base::ReadContext context{name};
  base::TableReader top(document, "", context);
  ProgramFile file;
  file.path = name;
  std::uint64_t version = 0;
  top.require("symrig", "symrig = 1, the version of this format");
  top.read_count("symrig", version, 1, 1);
  std::string title;
  top.read("title", title);
  program::read_rig(top.find("rig"), folder, context, file.rig);
  read_program(top, file);
  top.finish();
  if (!context.state) return context.state.error();
  return file;
}

Result<ProgramFile> read_program_file(const std::filesystem::path& path) {
  SYMRIG_TRY(const auto bytes, read_file(path, kMaxFile));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return parse_program_file(text, path.string(), path.parent_path());
}

}  // namespace symrig
