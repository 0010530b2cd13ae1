// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/trouble.hpp"

#include "symrig/report/summary.hpp"

#include <fmt/format.h>

namespace symrig {
namespace {

void add_reopened(std::vector<std::string>& lines, const char* device, std::int64_t times) {
  if (times > 0) lines.push_back(fmt::format("the {} was lost and reconnected {} times", device, times));
}

}  // namespace

std::vector<std::string> repair_lines(const RigTrouble& trouble) {
  std::vector<std::string> lines;
  if (trouble.retaken > 0)
    lines.push_back(fmt::format("{} photographs were retaken; frames: {}", trouble.retaken,
                                trouble.frames.trouble().empty() ? "all correct" : trouble.frames.trouble()));
  add_reopened(lines, "board", trouble.boards_reopened);
  add_reopened(lines, "camera", trouble.cameras_reopened);
  add_reopened(lines, "projector", trouble.projectors_reopened);
  if (trouble.registered_again > 0)
    lines.push_back(fmt::format("the rig moved and was registered again {} times", trouble.registered_again));
  return lines;
}

std::vector<std::string> trouble_lines(const RigTrouble& trouble) {
  std::vector<std::string> lines = repair_lines(trouble);
  for (const std::string& warning : rig_warnings(trouble)) lines.push_back("warning: " + warning);
  return lines;
}

std::int64_t lost_frames(const FrameCounts& frames) {
  std::int64_t lost = frames.missing;
  for (std::size_t k = 0; k < FrameCounts::kVerdicts; ++k) {
    const auto verdict = static_cast<Verdict>(k);
    if (verdict != Verdict::certain && verdict != Verdict::guard) lost += frames[verdict];
  }
  return lost;
}

}  // namespace symrig
