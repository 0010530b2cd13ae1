// SPDX-License-Identifier: Apache-2.0
#include "symrig/run/frame_ledger.hpp"

#include "symrig/program/compile.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {
namespace {

/// One entry for each exposure mark, counted within its photograph.
Result<std::vector<LedgerEntry>> asked_for(std::span<const StepMark> marks) {
  std::vector<LedgerEntry> entries;
  std::uint32_t patterns = 0;
  Ticks last;
  for (const StepMark& mark : marks) {
    if (mark.tick < last)
      return Error{ErrorCode::bad_argument, fmt::format("mark {} goes back in time", mark.ordinal),
                   "give the marks of one run in the order of the receipt"};
    last = mark.tick;
    if (mark.id == kMarkPattern) {
      ++patterns;
    } else {
      entries.push_back({patterns == 0 ? 0 : patterns - 1, mark.id - 1, mark.tick, std::nullopt, Ticks{}});
    }
  }
  return entries;
}

bool in_order(std::span<const FrameStamp> frames) {
  return std::is_sorted(frames.begin(), frames.end(),
                        [](const FrameStamp& a, const FrameStamp& b) { return a.begin < b.begin; });
}

}  // namespace

Result<FrameLedger> FrameLedger::pair(std::span<const StepMark> marks, std::span<const FrameStamp> frames,
                                      Ticks tolerance) {
  FrameLedger ledger;
  SYMRIG_TRY(ledger.entries_, asked_for(marks));
  if (!in_order(frames))
    return Error{ErrorCode::bad_argument, "frames are out of order", "sort them by their begin"};
  std::size_t next = 0;  // first entry that begins after the frame
  for (std::size_t k = 0; k < frames.size(); ++k) {
    while (next < ledger.entries_.size() && ledger.entries_[next].asked <= frames[k].begin) ++next;
    LedgerEntry* entry = next == 0 ? nullptr : &ledger.entries_[next - 1];
    const bool belongs = entry != nullptr && !entry->frame && frames[k].begin - entry->asked <= tolerance;
    if (!belongs) {
      ledger.unasked_.push_back(k);
      continue;
    }
    entry->frame = k;
    entry->delay = frames[k].begin - entry->asked;
  }
  return ledger;
}

std::size_t FrameLedger::missing() const {
  return static_cast<std::size_t>(
      std::count_if(entries_.begin(), entries_.end(), [](const LedgerEntry& entry) { return !entry.frame; }));
}

std::string FrameLedger::summary() const {
  const std::size_t have = entries_.size() - missing();
  std::string text = fmt::format("{} frames for {} exposures", have, entries_.size());
  const auto gap =
      std::find_if(entries_.begin(), entries_.end(), [](const LedgerEntry& entry) { return !entry.frame; });
  if (gap != entries_.end())
    text += fmt::format("; {} missing, the first at photograph {}, exposure {}", missing(), gap->photograph,
                        gap->exposure);
  if (!unasked_.empty())
    text += fmt::format("; {} unexpected frames, the first is frame {}", unasked_.size(), unasked_.front());
  return text;
}

std::vector<FrameStamp> frames_from_strobe(const Receipt& receipt, int strobe_line) {
  std::vector<FrameStamp> frames;
  for (const CapturedEdge& edge : receipt.edges)
    if (edge.line == strobe_line && edge.level) frames.push_back({frames.size(), edge.tick});
  return frames;
}

}  // namespace symrig
