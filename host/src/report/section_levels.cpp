// SPDX-License-Identifier: Apache-2.0
#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/sections.hpp"
#include "symrig/report/letters.hpp"

#include <fmt/format.h>

namespace symrig::report {
namespace {

std::string counts_table(const std::vector<NodeCounts>& counts) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    const NodeCounts& n = counts[level];
    std::vector<std::string> row{std::to_string(level)};
    for (const std::int64_t count :
         {n.leaves.rank1, n.leaves.low_rank, n.leaves.empty, n.leaves.scalar, n.subdivided})
      row.push_back(grouped(static_cast<double>(count)));
    rows.push_back(std::move(row));
  }
  return number_table({"level", "rank-1", "low rank", "empty", "scalar", "subdivided"}, rows);
}

/// Relit by letters, as if acquisition had ended at each level [Garg06 Fig. 11].
Result<std::string> stopped_row(const Context& context) {
  const TransportTensor& tensor = context.tensor();
  const Image<float> letters = letters_pattern(tensor.projector_grid());
  SYMRIG_TRY(Image<float> reference, tensor.apply(letters));
  if (context.has_truth()) {
    SYMRIG_TRY(reference, context.options.truth(letters));
  }
  const float white = white_level(reference);
  std::vector<std::string> figures;
  for (int level = 0; level < tensor.camera_tree().levels(); ++level) {
    SYMRIG_TRY(const Image<float> relit, tensor.stopped_at(level).apply(letters));
    figures.push_back(
        figure(photograph(shrunk(relit, kPictureSide / 2), white), fmt::format("stopped at level {}", level),
               fmt::format("Level {}: off by {}", level, percent(relative_error(relit, reference)))));
  }
  return row_of(figures, 160);
}

std::string intro(const Context& context) {
  const std::string_view reference = context.has_truth() ? "ground truth" : "the finished tensor";
  return paragraph(
      fmt::format("Relit by the letters, as if the acquisition had ended at each level. A leaf is a product "
                  "of two pictures, so every "
                  "level shows full detail; but light aimed at a part of a block is spread over the whole "
                  "block. Off by: relative to "
                  "{}.",
                  reference));
}

/// A tensor that was not grown level by level: dual photography's, brute force's, or fitted to photographs.
std::string stored_section(const TransportTensor& tensor) {
  const auto count = [](std::size_t n) { return grouped(static_cast<double>(n)); };
  return section(
      "levels", "What is stored",
      paragraph("This tensor was not refined level by level from both sides, so it has no levels to show.") +
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
  SYMRIG_TRY(const std::string pictures, stopped_row(context));
  return section("levels", "Level by level",
                 paragraph("Each level cuts blocks in four, and a pair of blocks (a node) in sixteen. Shares "
                           "of the nodes looked at "
                           "on each level; T is symmetric, each pair is counted once. Empty: below what "
                           "matters or can be measured. "
                           "Scalar: a single entry of T.") +
                     node_bars(counts) + counts_table(counts) + "<h3>Stopped at each level</h3>" +
                     intro(context) + pictures);
}

}  // namespace symrig::report
