// SPDX-License-Identifier: Apache-2.0
#include "analyser_report.hpp"

#include "console.hpp"
#include "numbers.hpp"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::apps {
namespace {

const std::string& name_of(const BoardInfo& board, int line) {
  return board.lines.at(static_cast<std::size_t>(line)).name;
}

std::string unseen_lines(const AnalyserComparison& found, const BoardInfo& board) {
  std::vector<std::string> names;
  for (const int line : found.unseen) names.push_back(name_of(board, line));
  return names.empty()
             ? ""
             : fmt::format("not compared, because no channel shows it: {}\n", fmt::join(names, ", "));
}

}  // namespace

Result<ChannelName> channel_name(const std::string& text) {
  const std::size_t at = text.find('=');
  if (at == std::string::npos || at == 0 || at + 1 == text.size())
    return Error{ErrorCode::bad_argument, fmt::format("--channel {} is not LINE=CHANNEL", text),
                 "name a line of the board and the analyser's channel, such as camera_trigger=D0"};
  return ChannelName{text.substr(0, at), text.substr(at + 1)};
}

std::string analyser_summary(const AnalyserComparison& found, const BoardInfo& board) {
  std::vector<std::string> names;
  for (const int line : found.lines) names.push_back(name_of(board, line));
  std::string text =
      fmt::format("{} edges of {} paired: {} missing, {} unplanned, {} before or after the run\n",
                  grouped(static_cast<double>(found.pairs.size())), fmt::join(names, ", "), found.missing,
                  found.unplanned, found.outside);
  text +=
      fmt::format("largest difference {:.4g} ns, allowed {:.4g} ns; the analyser's clock is {:.3g} ppm {}\n",
                  found.largest_ns, found.allowed_ns, std::abs(found.rate_ppm),
                  found.rate_ppm < 0 ? "slower than the board's" : "faster than the board's");
  return text + unseen_lines(found, board);
}

std::string analyser_csv(const AnalyserComparison& found, const BoardInfo& board) {
  std::string text = "line,level,planned_ns,seen_ns,difference_ns\n";
  for (const AnalyserPair& pair : found.pairs)
    text += fmt::format("{},{},{:.3f},{:.3f},{:.3f}\n", name_of(board, pair.line), pair.level ? 1 : 0,
                        pair.planned_ns, pair.seen_ns, pair.difference_ns);
  return text;
}

Result<void> analyser_verdict(const AnalyserComparison& found, const std::string& file) {
  if (found.agrees()) return {};
  return Error{
      ErrorCode::fault,
      fmt::format(
          "{} differs from the plan: {} edges missing, {} unplanned, {:.4g} ns apart (allowed {:.4g})", file,
          found.missing, found.unplanned, found.largest_ns, found.allowed_ns),
      "--differences OUT.csv lists each edge; docs/howto-analyser.md names common causes"};
}

}  // namespace symrig::apps
