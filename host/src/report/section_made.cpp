// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"
#include "report/sections.hpp"

#include <fmt/format.h>

namespace symrig::report {
namespace {

using Rows = std::vector<std::pair<std::string, std::string>>;

void add_text(Rows& rows, const CaptureFacts& facts, const char* path, const char* name) {
  if (const auto text = facts.text(path); text && !text->empty()) rows.emplace_back(name, breakable(*text));
}

void add_command(Rows& rows, const std::string& command, const char* name) {
  if (!command.empty()) rows.emplace_back(name, "<code>" + breakable(command) + "</code>");
}

}  // namespace

std::string made_section(const Context& context) {
  Rows rows;
  add_text(rows, context.facts, "/scene", "Scene");
  add_text(rows, context.facts, "/date", "Captured");
  add_text(rows, context.facts, "/version", "By symrig");
  add_command(rows, context.facts.text("/command_line").value_or(""), "Command");
  const Made& made = context.options.made;
  if (!made.date.empty()) rows.emplace_back("This page", escape(made.date));
  if (!made.version.empty()) rows.emplace_back("By symrig (page)", escape(made.version));
  add_command(rows, made.command_line, "Command (page)");
  const std::string json =
      "<details><summary>All that the capture wrote about itself</summary><pre class=\"wide\" "
      "tabindex=\"0\">" +
      escape(context.facts.json().dump(2, ' ', false, nlohmann::json::error_handler_t::replace)) +
      "</pre></details>\n";
  return section("made", "How it was made", (rows.empty() ? std::string() : facts_table(rows)) + json);
}

}  // namespace symrig::report
