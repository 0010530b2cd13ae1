// SPDX-License-Identifier: Apache-2.0
#include "program/passes.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/internal/explain.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace symrig::program {
namespace {

/// An edge or a mark at one moment of a stretch. A stretch is the time between two waits or loop ends.
struct Event {
  Ticks tick;
  const Move* move;
};

class Emitter {
 public:
  Emitter(const RigSetup& rig, const BoardInfo& board, LintFindings& findings)
      : board_(board), findings_(findings), builder_(board) {
    for (const RigLine& line : rig.lines) {
      const int k = board.line(line.config.line);
      if (k >= 0 && k < 32) delays_[k] = board.rate.ticks(line.delay);
    }
  }

  void take(const Move& move) {
    switch (move.kind) {
      case Move::Kind::set:
        events_.push_back({now_ + (move.at_once ? Ticks{} : delays_[move.line]), &move});
        return;
      case Move::Kind::mark:
        events_.push_back({now_, &move});
        return;
      case Move::Kind::hold:
        if (now_.count == 0) first_hold_ = move.place;
        now_ = now_ + move.ticks;
        return;
      default:
        flush(move.place);
        write(move);
    }
  }

  std::optional<Emitted> finish(int place) {
    flush(place);
    auto program = builder_.end();
    note_place(place);
    if (!program && !broken_) findings_.error(place, "length", program.error().what, program.error().hint);
    if (!program || broken_) return std::nullopt;
    return Emitted{*std::move(program), std::move(places_)};
  }

 private:
  void write(const Move& move) {
    const std::string line = move.kind == Move::Kind::wait ? board_.lines[move.line].name : std::string();
    switch (move.kind) {
      case Move::Kind::wait:
        builder_.wait_edge(line, move.edge, board_.rate.nanoseconds(move.ticks), move.on_timeout);
        break;
      case Move::Kind::loop:
        note_added(move.place);
        open_loop(move.place);
        builder_.loop(move.count);
        break;
      case Move::Kind::end_loop:
        note_added(move.place);
        close_loop(move.place);
        builder_.end_loop();
        break;
      default:
        break;
    }
    note_place(move.place);
  }

  /// Writes the events of the stretch and begins a new one, which may start at any time.
  void flush(int place) {
    std::stable_sort(events_.begin(), events_.end(),
                     [](const Event& a, const Event& b) { return a.tick < b.tick; });
    if (!events_.empty() && events_.back().tick > now_) {
      crosses(events_.back());
      now_ = events_.back().tick;
    }
    Ticks at;
    int last = now_.count > 0 ? first_hold_ : place;
    for (const Event& event : events_) {
      if (event.tick > at) hold(event.tick - at, last);
      at = event.tick;
      apply(*event.move);
      last = event.move->place;
    }
    if (now_ > at) hold(now_ - at, last);
    events_.clear();
    now_ = Ticks{};
  }

  void apply(const Move& move) {
    if (move.kind == Move::Kind::mark) {
      builder_.mark(static_cast<std::uint32_t>(move.count));
      note_place(move.place);
    } else {
      builder_.set(board_.lines[move.line].name, move.level);
      const std::uint32_t bit = 1U << static_cast<unsigned>(move.line);
      levels_ = move.level ? levels_ | bit : levels_ & ~bit;
    }
  }

  /// Each round of a loop takes longer than the program says by what the builder adds.
  void note_added(int place) {
    if (!builder_.pending()) return;
    const Nanoseconds added = board_.rate.nanoseconds(board_.min_dwell);
    findings_.warning(
        place, "hold.added",
        fmt::format("{} are added here: the edge before needs that time, and the program has none",
                    base::duration_text(added)),
        setting("hold", added) + " after the edge, and that much less elsewhere");
  }

  void open_loop(int place) {
    loops_.push_back(levels_);
    if (loops_.size() != board_.loop_depth + 1) return;
    broken_ = true;
    findings_.error(place, "loop_depth", "loops are nested too deeply",
                    fmt::format("use at most {} nested loops", board_.loop_depth));
  }

  /// The first word of a loop's body is the same in every round, so the body must end with the levels of its
  /// start.
  void close_loop(int place) {
    const std::uint32_t changed = loops_.back() ^ levels_;
    loops_.pop_back();
    for (std::size_t k = 0; k < board_.lines.size(); ++k) {
      if (((changed >> k) & 1U) == 0) continue;
      broken_ = true;
      findings_.error(
          place, "loop.levels",
          fmt::format("the loop ends with another level of line '{}' than it began", board_.lines[k].name),
          fmt::format("set \"{}\" back before the loop's end", board_.lines[k].name));
    }
  }

  void hold(Ticks ticks, int place) {
    if (ticks < board_.min_dwell) {
      broken_ = true;
      findings_.error(place, "min_dwell",
                      fmt::format("levels last {} between two edges, but the board's shortest is {}",
                                  board::ticks_text(board_, ticks.count),
                                  board::ticks_text(board_, board_.min_dwell.count)),
                      setting("hold", board_.rate.nanoseconds(board_.min_dwell)));
      return;
    }
    builder_.hold(ticks);
    note_place(place);
  }

  void crosses(const Event& event) {
    broken_ = true;
    const std::string& line = board_.lines[event.move->line].name;
    findings_.error(event.move->place, "delay.crosses",
                    fmt::format("the delay of line '{}' moves its edge {} beyond the next wait, loop end or "
                                "program end",
                                line, board::ticks_text(board_, (event.tick - now_).count)),
                    setting("hold", board_.rate.nanoseconds(event.tick - now_)) + " more before it");
  }

  void note_place(int place) { places_.resize(builder_.records(), place); }

  const BoardInfo& board_;
  LintFindings& findings_;
  ProgramBuilder builder_;
  std::array<Ticks, 32> delays_{};
  std::vector<Event> events_;
  std::vector<int> places_;
  std::vector<std::uint32_t> loops_;  // levels at the start of each open loop
  std::uint32_t levels_ = 0;
  Ticks now_;
  int first_hold_ = 0;  // line of the file that has the first hold of this stretch
  bool broken_ = false;
};

}  // namespace

std::optional<Emitted> emit(const MoveList& moves, const RigSetup& rig, const BoardInfo& board,
                            LintFindings& findings) {
  Emitter emitter(rig, board, findings);
  int place = 0;
  for (const Move& move : moves.moves()) {
    emitter.take(move);
    if (move.place != 0) place = move.place;
  }
  return emitter.finish(place);
}

}  // namespace symrig::program
