// SPDX-License-Identifier: Apache-2.0
#include "program/passes.hpp"
#include "program/timing.hpp"
#include "symrig/program/compile.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

namespace symrig::program {

using Kind = Move::Kind;

void MoveList::set(std::string_view line, bool on, int place) {
  const RigLine* rig_line = rig_->find(line);
  const bool active_low = rig_line != nullptr && rig_line->active_low;
  moves_.push_back(
      {.kind = Kind::set, .line = board_->line(line), .level = on != active_low, .place = place});
}

void MoveList::is_off(std::string_view line, int place) {
  set(line, false, place);
  moves_.back().at_once = true;
}

void MoveList::hold(Ticks ticks, int place) {
  if (ticks.count > 0) moves_.push_back({.kind = Kind::hold, .ticks = ticks, .place = place});
}

void MoveList::pulse(std::string_view line, Ticks width, int place) {
  set(line, true, place);
  hold(width, place);
  set(line, false, place);
}

void MoveList::wait(std::string_view line, EdgeKind edge, Nanoseconds timeout, OnTimeout action, int place) {
  moves_.push_back({.kind = Kind::wait,
                    .line = board_->line(line),
                    .ticks = board_->rate.ticks(timeout),
                    .edge = edge,
                    .on_timeout = action,
                    .place = place});
}

void MoveList::mark(std::uint64_t id, int place) {
  moves_.push_back({.kind = Kind::mark, .count = id, .place = place});
}

void MoveList::loop(std::uint64_t rounds, int place) {
  moves_.push_back({.kind = Kind::loop, .count = rounds, .place = place});
}

void MoveList::end_loop(int place) {
  moves_.push_back({.kind = Kind::end_loop, .place = place});
}

Ticks MoveList::ticks_up(Nanoseconds time) const {
  const Ticks nearest = board_->rate.ticks(time);
  return board_->rate.nanoseconds(nearest) < time ? nearest + Ticks{1} : nearest;
}

namespace {

/// The longest delay of a line: outputs of a stretch are out for certain after that.
Nanoseconds longest_delay(const RigSetup& rig) {
  Nanoseconds longest{0};
  for (const RigLine& line : rig.lines) longest = std::max(longest, line.delay);
  return longest;
}

/// Moves that scans and programs written by hand share: the next pattern, an exposure.
class RigMoves {
 public:
  RigMoves(const RigSetup& rig, const BoardInfo& board, MoveList& moves)
      : rig_(rig),
        moves_(moves),
        board_(board),
        camera_(rig.line_name(RigRole::camera)),
        projector_(rig.line_name(RigRole::projector)),
        vsync_(rig.line_name(RigRole::vsync)),
        plane_(rig.line_name(RigRole::plane)),
        drain_(longest_delay(rig)) {}

  /// Asks for the next pattern and waits until it is on the screen.
  void advance(Nanoseconds stretch, OnTimeout action, int place) {
    const ProjectorProfile& projector = rig_.projector;
    if (projector.sync == PatternSync::plane) return await_plane(projector.vsync_timeout, action, place);
    const Ticks width = projector_.empty() ? Ticks{0} : board_.rate.ticks(projector.advance_pulse + stretch);
    if (!projector_.empty()) moves_.pulse(projector_, width, place);
    if (projector.sync == PatternSync::vsync) {
      if (vsync_.empty()) return;
      moves_.hold_up(drain_, place);
      moves_.wait(vsync_, EdgeKind::rising, projector.vsync_timeout, action, place);
    } else if (!projector_.empty()) {
      const Ticks shown = moves_.ticks_up(projector.trigger_delay);
      if (shown > width) moves_.hold(shown - width, place);
    }
  }

  /// Waits until the planes of a picture begin again.
  void await_refresh(OnTimeout action, int place) {
    if (vsync_.empty()) return;
    moves_.hold_up(drain_, place);
    moves_.wait(vsync_, first_edge(RigRole::vsync), rig_.projector.vsync_timeout, action, place);
  }

  void await_plane(Nanoseconds timeout, OnTimeout action, int place) {
    if (plane_.empty()) return;
    moves_.hold_up(drain_, place);
    moves_.wait(plane_, first_edge(RigRole::plane), timeout, action, place);
  }

  /// One exposure, from its trigger to its end.
  void expose(Nanoseconds exposure, Nanoseconds stretch, int place) {
    const CameraProfile& camera = rig_.camera;
    if (camera.mode == ExposureMode::trigger_width) {
      moves_.pulse(camera_, board_.rate.ticks(exposure - camera.exposure_offset), place);
      outlast_pulse(place);
    } else {
      const Nanoseconds width = camera.trigger_pulse + stretch, end = camera.trigger_delay + exposure;
      moves_.pulse(camera_, board_.rate.ticks(width), place);
      if (end > width) moves_.hold_up(end - width, place);
    }
  }

  /// From the end of an exposure to the next trigger. Without any, two pulses would be one.
  void gap(Nanoseconds time, int place) {
    moves_.hold(std::max(moves_.ticks_up(time), board_.min_dwell), place);
  }

  /// An exposure with the projector's pulse inside: it takes in a whole triggered pattern.
  void expose_around(Nanoseconds exposure, int place) {
    const CameraProfile& camera = rig_.camera;
    const bool timed = camera.mode == ExposureMode::timed;
    const Ticks pulse = board_.rate.ticks(rig_.projector.advance_pulse);
    const Ticks dwell = timed ? board_.rate.ticks(camera.trigger_pulse) : board_.min_dwell;
    const Ticks lead = std::max(dwell, moves_.ticks_up(camera.trigger_delay) + board_.min_dwell);
    const Ticks whole = timed ? board_.rate.ticks(camera.trigger_delay + exposure)
                              : board_.rate.ticks(exposure - camera.exposure_offset);
    moves_.set(camera_, true, place);
    moves_.hold(dwell, place);
    if (timed) moves_.set(camera_, false, place);
    if (lead > dwell) moves_.hold(lead - dwell, place);
    moves_.pulse(projector_, pulse, place);
    if (whole > lead + pulse) moves_.hold(whole - lead - pulse, place);
    if (timed) return;
    moves_.set(camera_, false, place);
    outlast_pulse(place);
  }

  /// Lines whose "off" is high begin there.
  void idle(const BoardInfo& board) {
    for (const RigLine& line : rig_.lines)
      if (const int k = board.line(line.config.line); k >= 0 && board.lines[k].output && line.active_low)
        moves_.is_off(line.config.line, line.place);
  }

 private:
  /// The edge at which a trigger output becomes active.
  EdgeKind first_edge(RigRole role) const {
    return rig_.is_active_low(role) ? EdgeKind::falling : EdgeKind::rising;
  }

  /// A camera that exposes later or longer than its pulse; one that exposes shorter has ended already.
  void outlast_pulse(int place) {
    const Nanoseconds after = rig_.camera.trigger_delay + rig_.camera.exposure_offset;
    if (after.count() > 0) moves_.hold(after, place);
  }

  const RigSetup& rig_;
  MoveList& moves_;
  const BoardInfo& board_;
  std::string camera_, projector_, vsync_, plane_;
  Nanoseconds drain_;
};

class ScanMoves {
 public:
  ScanMoves(const ProgramFile& file, const BoardInfo& board, MoveList& moves)
      : rig_(file.rig),
        scan_(*file.scan),
        timing_(file.rig, *file.scan),
        reaction_(board.rate.nanoseconds(board.wait_latency)),
        moves_(moves),
        steps_(rig_, board, moves) {}

  void write(const BoardInfo& board) {
    steps_.idle(board);
    write_startup();
    if (!scan_.plane_exposures.empty()) return write_planes();
    const bool looped = scan_.repeat > 1;
    if (looped) moves_.loop(scan_.repeat, scan_.place);
    write_sequence();
    if (looped) moves_.end_loop(scan_.place);
  }

 private:
  using Exposures = std::vector<std::size_t>;  // indices into the bracket

  void write_startup() {
    if (!scan_.startup) return;
    const int place = scan_.startup->place;
    moves_.loop(scan_.startup->pulses, place);
    moves_.mark(kMarkStartup, place);
    steps_.expose(scan_.startup->exposure, Nanoseconds{0}, place);
    steps_.gap(timing_.gap(), place);
    moves_.end_loop(place);
  }

  /// Exposures in bit planes. `now` is the time since the first edge of the vsync line. The word after a wait
  /// comes `reaction_` after its edge.
  void write_planes() {
    const ProjectorProfile& projector = rig_.projector;
    const Nanoseconds lead = plane_lead(projector.plane_period);
    steps_.await_refresh(scan_.on_timeout, scan_.place);
    Nanoseconds now = reaction_;
    for (const PlaneExposure& one : scan_.plane_exposures) {
      const Nanoseconds due =
          one.refresh * projector.refresh + projector.frame_lead + one.plane * projector.plane_period;
      // Plane 0 of the first refresh comes so soon after the vsync line that there may be nothing to hold.
      const Nanoseconds ahead = std::min(lead, due - now);
      moves_.mark(kMarkPattern, scan_.place);
      moves_.hold(due - ahead - now, scan_.gap_place);
      steps_.await_plane(ahead + lead / 2, OnTimeout::keep_going, scan_.place);
      moves_.hold_up(timing_.before_trigger(), scan_.settle_place);
      moves_.mark(mark_of_exposure(0), scan_.bracket_place);
      steps_.expose(one.exposure, Nanoseconds{0}, scan_.bracket_place);
      now = due + reaction_ + timing_.settle() + one.exposure;
    }
    steps_.gap(timing_.gap(), scan_.gap_place);
  }

  void write_sequence() {
    if (rig_.projector.sync == PatternSync::plane) steps_.await_refresh(scan_.on_timeout, scan_.place);
    first_ = scan_.start_marker.has_value();
    if (scan_.order == ScanOrder::pattern_outer) return write_patterns({});
    for (std::size_t j = 0; j < scan_.bracket.size(); ++j) write_patterns(j);
  }

  /// All patterns, each with this exposure or all of its own. The very first is written apart if it carries
  /// the marker.
  void write_patterns(std::optional<std::size_t> only) {
    for (const PatternGroup& group : scan_.patterns) {
      Exposures exposures(only ? 1 : scan_.bracket_of(group).size(), only.value_or(0));
      if (!only) std::iota(exposures.begin(), exposures.end(), std::size_t{0});
      std::uint64_t left = group.count;
      if (first_) {
        write_photograph(group, exposures);
        first_ = false;
        --left;
      }
      if (left == 0) continue;
      if (left > 1) moves_.loop(left, group.place);
      write_photograph(group, exposures);
      if (left > 1) moves_.end_loop(group.place);
    }
  }

  /// pattern → settle → (expose → readout) × k
  void write_photograph(const PatternGroup& group, const Exposures& exposures) {
    moves_.mark(kMarkPattern, group.place);
    for (std::size_t i = 0; i < exposures.size(); ++i) {
      const bool ask = i == 0 || scan_.advance == Advance::each_exposure;
      const bool last = i + 1 == exposures.size();
      write_frame(group, exposures[i], ask, last);
    }
  }

  void write_frame(const PatternGroup& group, std::size_t j, bool ask, bool last) {
    const Nanoseconds exposure = scan_.bracket_of(group)[j];
    const int place = scan_.bracket_place;
    if (timing_.around(group)) {
      lamp(true);
      moves_.mark(mark_of_exposure(j), place);
      steps_.expose_around(exposure, place);
    } else {
      if (ask) {
        steps_.advance(marker_for(RigRole::projector), scan_.on_timeout, group.place);
        lamp(true);
        moves_.hold_up(timing_.before_trigger(), scan_.settle_place);
      }
      moves_.mark(mark_of_exposure(j), place);
      steps_.expose(exposure, marker_for(RigRole::camera), place);
    }
    if (last || scan_.advance == Advance::each_exposure) lamp(false);
    steps_.gap(timing_.gap(), scan_.gap_place);
  }

  /// By how much a pulse on that line is longer now; the marker is used up by it.
  Nanoseconds marker_for(RigRole role) {
    if (!first_ || marked_) return Nanoseconds{0};
    const RigLine* line = rig_.with_role(role);
    if (line == nullptr || line->config.line != scan_.start_marker->line) return Nanoseconds{0};
    marked_ = true;
    return scan_.start_marker->stretch;
  }

  void lamp(bool on) {
    if (!scan_.lamp.empty()) moves_.set(scan_.lamp, on, scan_.lamp_place);
  }

  const RigSetup& rig_;
  const Scan& scan_;
  ScanTiming timing_;
  Nanoseconds reaction_;
  MoveList& moves_;
  RigMoves steps_;
  bool first_ = false;   // the photograph that carries the start marker
  bool marked_ = false;  // its pulse has been written
};

class HandMoves {
 public:
  HandMoves(const ProgramFile& file, const BoardInfo& board, MoveList& moves)
      : rig_(file.rig), board_(board), moves_(moves), steps_(rig_, board, moves) {}

  void write(const std::vector<FileStep>& steps) {
    for (const FileStep& step : steps) write(step);
  }
  void idle() { steps_.idle(board_); }

 private:
  void write(const FileStep& step) {
    switch (step.kind) {
      case FileStep::Kind::set:
        return moves_.set(step.line, step.on, step.place);
      case FileStep::Kind::hold:
        return moves_.hold(step.time, step.place);
      case FileStep::Kind::pulse:
        return moves_.pulse(step.line, board_.rate.ticks(step.time), step.place);
      case FileStep::Kind::wait:
        return moves_.wait(step.line, step.edge, step.time, step.on_timeout, step.place);
      case FileStep::Kind::mark:
        return moves_.mark(step.count, step.place);
      case FileStep::Kind::loop:
        moves_.loop(step.count, step.place);
        write(step.steps);
        return moves_.end_loop(step.place);
      case FileStep::Kind::pattern:
        steps_.advance(Nanoseconds{0}, OnTimeout::abort, step.place);
        return moves_.hold_up(rig_.projector.settle, step.place);
      case FileStep::Kind::expose:
        steps_.expose(step.time, Nanoseconds{0}, step.place);
        return steps_.gap(shortest_gap(rig_.camera), step.place);
    }
  }

  const RigSetup& rig_;
  const BoardInfo& board_;
  MoveList& moves_;
  RigMoves steps_;
};

}  // namespace

MoveList lower(const ProgramFile& file, const BoardInfo& board) {
  MoveList moves(board, file.rig);
  if (file.scan) {
    ScanMoves(file, board, moves).write(board);
  } else {
    HandMoves hand(file, board, moves);
    hand.idle();
    hand.write(file.steps);
  }
  return moves;
}

}  // namespace symrig::program
