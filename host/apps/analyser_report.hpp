// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/run/analyser.hpp"

#include <string>
#include <vector>

namespace symrig::apps {

/// "LINE=CHANNEL" of --channel.
/// fails: bad_argument.
Result<ChannelName> channel_name(const std::string& text);

/// What the comparison found, in a few lines for people.
std::string analyser_summary(const AnalyserComparison& found, const BoardInfo& board);
/// The pairs as CSV: line, level, planned_ns, seen_ns, difference_ns.
std::string analyser_csv(const AnalyserComparison& found, const BoardInfo& board);
/// fails: fault, if the analyser saw something else than the plan.
Result<void> analyser_verdict(const AnalyserComparison& found, const std::string& file);

}  // namespace symrig::apps
