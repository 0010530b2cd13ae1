// SPDX-License-Identifier: Apache-2.0
#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/save_link.hpp"
#include "report/sections.hpp"

#include <array>

#include <fmt/format.h>

namespace symrig::report {
namespace {

struct Column {
  const char* name;
  const char* path;  ///< in the JSON of inspect
  std::int64_t (*count)(const NodeCounts&);
};

constexpr std::array<Column, 5> kColumns{
    {{"rank-1", "/leaves_per_level/rank1", [](const NodeCounts& n) { return n.leaves.rank1; }},
     {"low rank", "/leaves_per_level/lowrank", [](const NodeCounts& n) { return n.leaves.low_rank; }},
     {"empty", "/leaves_per_level/empty", [](const NodeCounts& n) { return n.leaves.empty; }},
     {"scalar", "/leaves_per_level/scalar", [](const NodeCounts& n) { return n.leaves.scalar; }},
     {"subdivided", "/subdivided_per_level", [](const NodeCounts& n) { return n.subdivided; }}}};

std::string counts_table(const Context& context, const std::vector<NodeCounts>& counts) {
  std::vector<std::string> head{"level"};
  for (const Column& column : kColumns) head.emplace_back(column.name);
  Csv csv(head);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    std::vector<std::string> row{std::to_string(level)};
    std::vector<std::string> plain{std::to_string(level)};
    for (const Column& column : kColumns) {
      const auto count = static_cast<double>(column.count(counts[level]));
      row.push_back(number(count, fmt::format("inspect:{}/{}", column.path, level), grouped(count)));
      plain.push_back(exact(count));
    }
    rows.push_back(std::move(row));
    csv.add(plain);
  }
  return number_table_html("Nodes by level", head, rows) +
         save_row(csv.link(context.file("levels"), "nodes by level"));
}

/// A tensor without levels: from dual photography, brute force, or fitted to photographs.
std::string stored_section(const TransportTensor& tensor) {
  const auto count = [](std::size_t n) { return grouped(static_cast<double>(n)); };
  return section(
      "levels", "What is stored",
      paragraph("This tensor was not measured level by level, so it has no levels to show.") +
          facts_table({{"Low-rank leaves", count(tensor.leaves().size())},
                       {"Single entries of T", count(static_cast<std::size_t>(tensor.scalar_count()))},
                       {"Measured columns of T", count(tensor.columns().size())},
                       {"Entries in those columns", count(tensor.column_rows().size())}}));
}

}  // namespace

Result<std::string> levels_section(const Context& context) {
  const TransportTensor& tensor = context.tensor();
  if (!tensor.symmetric()) return stored_section(tensor);
  const std::vector<NodeCounts> counts = node_counts(tensor);
  SYMRIG_TRY(const std::string maps, maps_over_the_picture(context));
  SYMRIG_TRY(const std::string pictures, pictures_by_level(context));
  return section(
      "levels", "Level by level",
      paragraph("Each level divides a block into four, and a pair of blocks (a node) into sixteen. The bars "
                "show shares of the nodes on each level. T is symmetric; each pair counts once. Empty: below "
                "noise and tolerance. Scalar: a single entry of T.") +
          node_bars(counts) + counts_table(context, counts) + maps + pictures + ranks_of_leaves(tensor));
}

}  // namespace symrig::report
