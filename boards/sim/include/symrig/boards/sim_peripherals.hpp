// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/sim_board.hpp"

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace symrig::board_sim {

struct SimProjectorConfig {
  std::string trigger_line = "projector_trigger";
  std::string vsync_line = "vsync";
  std::uint32_t refresh_hz = 60;
  std::uint32_t vsync_pulse_us = 100;
};

/// A projector that draws `refresh_hz` pictures a second. A rising edge on its trigger line requests the next
/// pattern, which appears at the next rising vsync. Two edges in one refresh advance by two patterns.
class SimProjector final : public Peripheral {
 public:
  /// Pattern `index` is on the screen from `tick` to the next change. Nothing is shown before the first
  /// change.
  struct Change {
    std::uint64_t tick;
    std::int64_t index;
  };

  explicit SimProjector(const SimBoard& board, const SimProjectorConfig& config = {});

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, SimBoard& board) override;
  std::uint64_t next_event() const override;
  void on_event(std::uint64_t tick, SimBoard& board) override;

  /// All pattern changes so far, in order. index counts from 0.
  const std::vector<Change>& changes() const { return changes_; }
  /// The pattern on the screen at `tick`, -1 before the first advance.
  std::int64_t pattern_at(std::uint64_t tick) const;
  /// Shows pattern `index` for a host: runs the board to the next refresh, at which the pattern appears.
  void show(std::int64_t index, SimBoard& board);
  /// Number of refreshes so far.
  std::uint64_t refreshes() const { return refreshes_; }
  /// Starts counting again, with nothing on the screen.
  void reset();

 private:
  std::uint64_t refresh_tick(std::uint64_t number) const;

  int trigger_;
  int vsync_;
  std::uint64_t tick_hz_;
  std::uint64_t origin_;
  std::uint64_t refresh_hz_;
  std::uint64_t pulse_;
  std::uint64_t refreshes_ = 0;
  std::uint32_t levels_ = 0;
  bool vsync_high_ = false;
  std::int64_t shown_ = -1;
  std::int64_t asked_ = 0;
  std::vector<Change> changes_;
};

struct SimPlaneProjectorConfig {
  std::string frame_line = "vsync";
  std::string plane_line = "plane_trigger";
  std::uint32_t refresh_hz = 60;
  int planes = 24;
  std::uint64_t period_ns = 684'000;     ///< from plane to plane
  std::uint64_t frame_lead_ns = 20'000;  ///< the frame edge comes this long before plane 0
  int latency = 1;                       ///< refreshes from the scan-out of a picture to its planes
};

/// A projector that shows the bit planes of a picture one after the other, again in every refresh. An edge on
/// its frame line begins each refresh, and an edge on its plane line begins each plane. Planes that do not
/// fit into a refresh are not shown: the next refresh begins with plane 0.
class SimPlaneProjector final : public Peripheral {
 public:
  /// Plane `plane` of picture `picture` was bright for `ticks`.
  struct Lit {
    std::int64_t picture;
    int plane;
    std::uint64_t ticks;
  };
  /// Trigger edges that do not reach the board, and edges that are none.
  struct Faults {
    std::set<std::uint64_t> frames;                    ///< lost, by refresh
    std::set<std::pair<std::uint64_t, int>> planes;    ///< lost, by refresh and plane
    std::set<std::pair<std::uint64_t, int>> glitches;  ///< one more edge an eighth of a plane too early
    std::set<std::uint64_t> flips;  ///< refreshes at which no new picture comes: it comes at the next one
    /// [place]: the plane that is bright between the edges of this place, -1: none. Empty: each in its own
    /// place.
    std::vector<int> order;
    bool runs_free = false;  ///< each refresh begins with the plane after the first one of the refresh before
  };
  /// A picture's scan-out began at `tick`, in refresh `refresh`.
  struct Flip {
    std::uint64_t refresh;
    std::uint64_t tick;
    std::int64_t picture;
  };

  explicit SimPlaneProjector(const SimBoard& board, const SimPlaneProjectorConfig& config = {});

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, SimBoard& board) override;
  std::uint64_t next_event() const override;
  void on_event(std::uint64_t tick, SimBoard& board) override;

  /// Hands picture `index` over: runs the board to the next refresh, at which its scan-out begins. Returns
  /// that refresh's tick.
  std::uint64_t show(std::int64_t index, SimBoard& board);
  /// Hands a picture over in each refresh: order[k] for refresh k after the one at which the scan-out of
  /// order[0] begins. Runs the board to that refresh. A picture that is late in its refresh is on the screen
  /// in the next one, in place of that one's own. Returns order[0]'s flip.
  Flip play(const std::vector<std::int64_t>& order, SimBoard& board);
  /// Runs the board to the last flip of play(). Returns all its flips.
  std::vector<Flip> played(SimBoard& board);
  /// The planes that were bright during [begin, end), in order.
  std::vector<Lit> lit(std::uint64_t begin, std::uint64_t end) const;
  /// Number of refreshes so far.
  std::uint64_t refreshes() const { return refresh_; }
  /// Shows nothing any more, and gives no edges: a controller that was reset. go_on() ends it.
  void stop(std::uint64_t tick) { stopped_at_ = tick; }
  void go_on() { stopped_at_ = kNever; }
  /// Forgets all pictures: nothing is on the screen.
  void reset() { pictures_.clear(); }

  Faults faults;

 private:
  struct Event {
    std::uint64_t offset;  // from the begin of the refresh
    int line;
    bool level;
    int plane;    // -1: the frame
    bool glitch;  // happens only if Faults says so
  };
  struct Picture {
    std::uint64_t from;  // the first refresh with its planes
    std::int64_t index;
  };
  std::uint64_t refresh_tick(std::uint64_t number) const;
  std::uint64_t ticks_of(std::uint64_t nanoseconds) const;
  std::int64_t picture_in(std::uint64_t refresh) const;
  bool happens(const Event& event) const;
  int plane_in(std::uint64_t refresh, int place) const;

  SimPlaneProjectorConfig config_;
  std::uint64_t tick_hz_;
  std::uint64_t origin_;
  std::uint64_t period_, lead_;
  std::vector<Event> events_;  // of a refresh
  std::size_t next_ = 0;       // in events_
  std::uint64_t refresh_ = 1;  // that events_[next_] belongs to
  std::uint64_t stopped_at_ = kNever;
  std::vector<Picture> pictures_;
  std::vector<Flip> flips_;  // of play()
};

struct SimCameraConfig {
  std::string trigger_line = "camera_trigger";
  std::string strobe_line = "camera_strobe";
  std::uint64_t readout_us = 3'000;  ///< from the end of an exposure until its frame is read out
  std::uint64_t delay_us = 0;        ///< from an edge of the trigger to what it does
  /// It takes a trigger as soon as the last exposure has ended. It drops an exposure that ends before the
  /// last frame is read out.
  bool overlap = false;
};

/// A camera in trigger-width mode: it exposes while its trigger line is high, and its strobe line follows.
/// Without overlap, it misses a rising trigger until the previous frame is read out, as real cameras do.
class SimCamera final : public Peripheral {
 public:
  /// One frame, exposed during [begin, end) in board ticks.
  struct Frame {
    std::uint64_t begin;
    std::uint64_t end;
  };

  explicit SimCamera(const SimBoard& board, const SimCameraConfig& config = {});

  /// Sets the delay of later pulses, and whether they may overlap a readout.
  void set_trigger(std::uint64_t delay_us, bool overlap, const SimBoard& board);

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, SimBoard& board) override;
  std::uint64_t next_event() const override { return std::min(opens_, closes_); }
  void on_event(std::uint64_t tick, SimBoard& board) override;

  /// Finished frames so far, in order.
  const std::vector<Frame>& frames() const { return frames_; }
  std::int64_t missed_triggers() const { return missed_; }
  void reset();

 private:
  int trigger_;
  int strobe_;
  std::uint64_t readout_, delay_;
  bool overlap_;
  bool taken_ = false;  // the last trigger began an exposure, which has not ended
  bool high_ = false, ignoring_ = false;
  std::uint64_t opens_ = kNever, closes_ = kNever;
  std::uint64_t begin_ = 0;
  std::uint64_t busy_until_ = 0;
  std::int64_t missed_ = 0;
  std::vector<Frame> frames_;
};

}  // namespace symrig::board_sim
