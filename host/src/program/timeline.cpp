// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/timeline.hpp"

#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/program.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {
namespace {

using protocol::Op;
using protocol::Record;

class Expansion {
 public:
  Expansion(const Program& program, const BoardInfo& board, const TimelineOptions& options)
      : view_{{program.bytes().data(), program.bytes().size()}},
        options_(options),
        wait_latency_(board.wait_latency),
        now_(options.start),
        levels_(options.initial_levels) {
    out_.rate = board.rate;
    out_.start = options.start;
    out_.initial_levels = options.initial_levels;
  }

  Result<Timeline> run() {
    const std::uint64_t most = 64 * (static_cast<std::uint64_t>(options_.max_edges) + view_.size());
    for (std::uint64_t looks = 0; going_ && pc_ < view_.size(); ++looks) {
      if (looks == most || out_.edges.size() > options_.max_edges) {
        out_.cut_off = true;
        break;
      }
      SYMRIG_CHECK(step(view_[pc_]));
    }
    if (out_.edges.size() > options_.max_edges) {
      out_.cut_off = true;
      out_.edges.resize(options_.max_edges);
    }
    out_.end = now_;
    out_.final_levels = levels_;
    return std::move(out_);
  }

 private:
  struct Loop {
    std::uint32_t body;
    std::uint64_t left;
  };

  Error broken(std::string_view what) const {
    return {ErrorCode::bad_format, fmt::format("record {}: {}", pc_, what), "lint the program"};
  }

  Result<void> step(const Record& record) {
    switch (static_cast<Op>(record.op)) {
      case Op::set_word:
        put(record.arg);
        now_ = now_ + Ticks{record.ticks};
        ++out_.steps;
        break;
      case Op::mark:
        out_.marks.push_back({record.arg, static_cast<std::uint32_t>(out_.marks.size()), now_});
        break;
      case Op::wait_edge:
        return wait(record);
      case Op::loop:
        loops_.push_back({pc_ + 1, rounds(record)});
        break;
      case Op::end_loop:
        return turn_round();
      case Op::end:
        put(record.arg);
        out_.complete = true;
        going_ = false;
        break;
      default:
        return broken("the operation does not exist");
    }
    ++pc_;
    return {};
  }

  std::uint64_t rounds(const Record& record) const {
    return std::min(protocol::loop_rounds(record), options_.max_rounds);
  }

  Result<void> turn_round() {
    if (loops_.empty()) return broken("end_loop without loop");
    if (loops_.back().left > 1) {
      --loops_.back().left;
      pc_ = loops_.back().body;
      return {};
    }
    loops_.pop_back();
    ++pc_;
    return {};
  }

  Result<void> wait(const Record& record) {
    protocol::WaitEdge awaited;
    if (!protocol::parse_wait(record.arg, awaited)) return broken("a wait with bits without a meaning");
    const PlannedWait wait{pc_,
                           awaited.line,
                           static_cast<EdgeKind>(awaited.edge),
                           awaited.abort_on_timeout,
                           now_,
                           Ticks{record.ticks},
                           out_.marks.size()};
    const std::optional<Ticks> edge = options_.edge_at ? options_.edge_at(wait) : now_;
    const bool late = !edge || *edge < now_ || *edge - now_ > wait.timeout;
    const bool ends = late && wait.abort;
    now_ = (late ? now_ + wait.timeout : *edge) + (ends ? Ticks{} : wait_latency_);
    out_.waits.push_back({wait, late, now_});
    going_ = !ends;
    ++pc_;
    return {};
  }

  void put(std::uint32_t word) {
    const std::uint32_t levels = (levels_ & ~protocol::kOutputMask) | word;
    const std::uint32_t changed = levels ^ levels_;
    for (unsigned k = 0; k < protocol::kMaxOutputs; ++k)
      if (((changed >> k) & 1U) != 0)
        out_.edges.push_back({static_cast<int>(k), ((levels >> k) & 1U) != 0, now_, pc_});
    levels_ = levels;
  }

  protocol::ProgramView view_;
  const TimelineOptions& options_;
  Ticks wait_latency_;
  Ticks now_;
  std::uint32_t levels_;
  std::uint32_t pc_ = 0;
  bool going_ = true;
  std::vector<Loop> loops_;
  Timeline out_;
};

}  // namespace

Result<Timeline> expand(const Program& program, const BoardInfo& board, const TimelineOptions& options) {
  return Expansion(program, board, options).run();
}

}  // namespace symrig
