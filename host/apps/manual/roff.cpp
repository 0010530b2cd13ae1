// SPDX-License-Identifier: Apache-2.0
#include "manual/roff.hpp"

#include <sstream>
#include <utility>
#include <vector>

namespace symrig::apps {
namespace {

using Lines = std::vector<std::string>;

/// Lines between blank lines.
std::vector<Lines> blocks_of(std::string_view text) {
  std::vector<Lines> blocks(1);
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty())
      blocks.back().push_back(line);
    else if (!blocks.back().empty())
      blocks.emplace_back();
  }
  if (blocks.back().empty()) blocks.pop_back();
  return blocks;
}

std::string verbatim(const Lines& lines) {
  std::string text = ".PP\n.nf\n.RS 2\n";
  for (const std::string& line : lines) text += roff(line.substr(line.find_first_not_of(' '))) + "\n";
  return text + ".RE\n.fi\n";
}

/// A row "  name  text", the continuation of a row (indented further), or a line of a paragraph.
std::string line_text(const std::string& line, bool& table) {
  const std::size_t indent = line.find_first_not_of(' ');
  if (indent == 0) return std::exchange(table, false) ? ".PP\n" + roff(line) + "\n" : roff(line) + "\n";
  if (indent > 2) return roff(line.substr(indent)) + "\n";
  table = true;
  const std::size_t end = line.find(' ', indent);
  const std::size_t text = end == std::string::npos ? end : line.find_first_not_of(' ', end);
  const std::string row = ".TP\n" + bold(line.substr(indent, end - indent)) + "\n";
  return text == std::string::npos ? row : row + roff(line.substr(text)) + "\n";
}

std::string paragraph(const Lines& lines) {
  std::string text = ".PP\n";
  bool table = false;
  for (const std::string& line : lines) text += line_text(line, table);
  return text;
}

}  // namespace

std::string roff(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if (c == '\'')
      out += "\\(aq";
    else
      out += c;
  }
  return out.starts_with('.') ? "\\&" + out : out;
}

std::string bold(std::string_view text) {
  return "\\fB" + roff(text) + "\\fR";
}

std::string italic(std::string_view text) {
  return "\\fI" + roff(text) + "\\fR";
}

std::string footer_sections(std::string_view footer) {
  std::string examples, notes, codes;
  for (const Lines& block : blocks_of(footer)) {
    if (block.front() == "Example:")
      examples += ".SH EXAMPLES\n" + verbatim({block.begin() + 1, block.end()});
    else if (block.front().starts_with("Exit codes:"))
      codes += ".SH \"EXIT STATUS\"\n" + paragraph(block);
    else
      notes += (notes.empty() ? ".SH NOTES\n" : "") + paragraph(block);
  }
  return notes + examples + codes;
}

}  // namespace symrig::apps
