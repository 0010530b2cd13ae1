// SPDX-License-Identifier: Apache-2.0
// Requests that start, stop or prevent changes of outputs.
#include "replies.hpp"
#include "symrig/firmware/core.hpp"

namespace symrig::firmware {
namespace {

constexpr uint32_t kMaxTtlMs = 60'000;
// The longest keep-alive with a laser line.
constexpr uint32_t kMaxLaserTtlMs = 500;
constexpr uint32_t kMaxIdentifySeconds = 60;
// Time for the answer to leave before the restart.
constexpr uint32_t kRebootDelayMs = 20;

}  // namespace

/// The first lamp or laser in `mask` without the keep-alive that it needs, or -1.
int Core::unguarded_line(uint32_t mask) const {
  for (unsigned k = 0; k < protocol::kMaxOutputs; ++k) {
    const protocol::LineConfig& line = config_.lines[k];
    if (((mask >> k) & 1U) == 0 || !line.configured || !line.output || line.hazard == 0) continue;
    const bool laser = line.hazard == symrig_wire_Hazard_HAZARD_LASER;
    if (ttl_ms_ == 0 || (laser && ttl_ms_ > kMaxLaserTtlMs)) return static_cast<int>(k);
  }
  return -1;
}

/// The first lamp or laser line, or -1.
int Core::hazardous_line() const {
  for (unsigned k = 0; k < protocol::kMaxOutputs; ++k)
    if (config_.lines[k].configured && config_.lines[k].output && config_.lines[k].hazard != 0)
      return static_cast<int>(k);
  return -1;
}

/// The first interlock line at its trip level, or -1.
int Core::open_interlock() const {
  const uint32_t levels = board_.capture.levels();
  for (unsigned k = 0; k < protocol::kMaxLines; ++k)
    if (is_interlock(config_.lines[k]) && (((levels >> k) & 1U) != 0) == config_.lines[k].trip_level)
      return static_cast<int>(k);
  return -1;
}

/// An interlock can trip at any moment of a request, and the engine then goes to its safe word by itself. A
/// request that moves outputs must not be answered OK after that. true: it tripped, and the reply says so.
bool Core::stopped_by_trip(symrig_wire_Reply& reply) {
  const uint32_t tripped = board_.engine.tripped();
  if (tripped == 0) return false;
  watch_trips();
  refuse(reply, symrig_wire_Code_CODE_INTERLOCK_OPEN, protocol::lowest_bit(tripped));
  return true;
}

/// From now on the engine goes to its safe word by itself when an interlock opens. false: one is open, or one
/// has opened since the last round. Then the reply says so.
bool Core::arm_trips(symrig_wire_Reply& reply) {
  if (stopped_by_trip(reply)) return false;
  uint32_t lines = 0;
  uint32_t levels = 0;
  for (unsigned k = 0; k < protocol::kMaxLines; ++k) {
    if (!is_interlock(config_.lines[k])) continue;
    lines |= uint32_t{1} << k;
    if (config_.lines[k].trip_level) levels |= uint32_t{1} << k;
  }
  board_.engine.set_trips(lines, levels);
  return !stopped_by_trip(reply);
}

/// Checks all conditions for changing the lines in `mask` at `tick`. false: the reply names the one that
/// fails.
bool Core::may_move(uint32_t mask, hal::Tick tick, symrig_wire_Reply& reply) const {
  if (leaving()) {
    refuse(reply, symrig_wire_Code_CODE_BAD_STATE, static_cast<uint64_t>(state_));
    return false;
  }
  const int open = open_interlock();
  if (open >= 0) {
    refuse(reply, symrig_wire_Code_CODE_INTERLOCK_OPEN, static_cast<uint64_t>(open));
    return false;
  }
  const int unguarded = autonomous_ ? -1 : unguarded_line(mask);
  if (unguarded >= 0) {
    refuse(reply, symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED, static_cast<uint64_t>(unguarded));
    return false;
  }
  hal::Tick needed = 0;
  const int cooling = guard_.cooling_line(mask, tick, needed);
  if (cooling >= 0) {
    reply.which_body = symrig_wire_Reply_violation_tag;
    reply.body.violation = {static_cast<uint32_t>(protocol::Rule::duty), 0, static_cast<uint32_t>(cooling), 0,
                            needed};
    refuse(reply, symrig_wire_Code_CODE_COOLING, static_cast<uint64_t>(cooling));
    return false;
  }
  return true;
}

void Core::arm(const symrig_wire_Arm& arm, symrig_wire_Reply& reply) {
  if (!transition(state_, Condition::arm).allowed) {
    permit(Condition::arm, reply);
    return;
  }
  reply.field = arm.program_hash != store_.hash() ? symrig_wire_Arm_program_hash_tag : 0;
  if (reply.field != 0) return refuse(reply, symrig_wire_Code_CODE_HASH_MISMATCH, store_.hash());
  reply.field = arm.config_hash != config_hash_ ? symrig_wire_Arm_config_hash_tag : 0;
  if (reply.field != 0) return refuse(reply, symrig_wire_Code_CODE_HASH_MISMATCH, config_hash_);
  const int hazard = arm.autonomous ? hazardous_line() : -1;
  if (hazard >= 0)
    return refuse(reply, symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED, static_cast<uint64_t>(hazard));
  autonomous_ = arm.autonomous;
  if (!may_move(protocol::kOutputMask, hal::kNever, reply)) return;
  if (permit(Condition::arm, reply)) arm_trips(reply);
}

void Core::start(const symrig_wire_Start& start, symrig_wire_Reply& reply) {
  if (!transition(state_, Condition::start).allowed) {
    permit(Condition::start, reply);
    return;
  }
  const hal::Tick now = board_.clock.now();
  const bool timed = start.which_when == symrig_wire_Start_at_tick_tag;
  const bool at_once = start.which_when == symrig_wire_Start_now_tag && start.when.now;
  // A newer host may ask for a way that is not known here, for example a condition: nothing may move then.
  if (!timed && !at_once) return bad_value(reply, symrig_wire_Start_now_tag);
  const hal::Tick at = timed ? start.when.at_tick : now;
  if (at < now) return refuse(reply, symrig_wire_Code_CODE_IN_PAST, now);
  if (at - now > protocol::kMaxDuration) return bad_value(reply, symrig_wire_Start_at_tick_tag);
  if (!may_move(protocol::kOutputMask, at, reply)) return;
  permit(Condition::start, reply);
  events_.restart_count();
  sequencer_.begin(store_.program(), board_.traits.min_dwell, timed ? at : 0);
  begin_round();
  symrig_wire_Event& event = new_event(symrig_wire_Event_run_started_tag);
  event.body.run_started = {store_.hash(), sequencer_.tally().started};
  events_.push_important(event, now);
  stopped_by_trip(reply);
}

void Core::set_by_hand(const symrig_wire_ManualSet& set, symrig_wire_Reply& reply) {
  if (!transition(state_, Condition::manual_set).allowed) {
    permit(Condition::manual_set, reply);
    return;
  }
  for (uint32_t left = set.mask; left != 0; left &= left - 1) {
    const unsigned k = protocol::lowest_bit(left);
    const protocol::LineConfig line = config_.line(k);
    if (!(line.configured && line.output)) return refuse(reply, symrig_wire_Code_CODE_WRONG_DIRECTION, k);
  }
  const uint32_t levels = (board_.engine.levels() & ~set.mask) | (set.levels & set.mask);
  const uint32_t turned_on = (levels ^ safe_levels_) & set.mask;
  autonomous_ = false;
  if (turned_on != 0 && !may_move(turned_on, board_.clock.now(), reply)) return;
  permit(Condition::manual_set, reply);
  if (!arm_trips(reply)) return;
  board_.engine.force(levels);
  stopped_by_trip(reply);
}

void Core::abort() {
  const bool running = state_ == State::running;
  apply(Condition::abort);
  if (running) report_run(symrig_wire_RunEnd_RUN_END_ABORTED);
}

void Core::clear_fault(uint32_t code, symrig_wire_Reply& reply) {
  if (state_ == State::fault && code != fault_.code)
    return refuse(reply, symrig_wire_Code_CODE_BAD_VALUE, fault_.code);
  if (!permit(Condition::clear_fault, reply)) return;
  fault_ = {};
  board_.faults.save(fault_);
}

void Core::keep_alive(uint32_t ttl_ms, symrig_wire_Reply& reply) {
  if (ttl_ms > kMaxTtlMs) return bad_value(reply, symrig_wire_KeepAlive_ttl_ms_tag);
  const uint32_t before = ttl_ms_;
  ttl_ms_ = ttl_ms;
  const int unguarded = exposed() ? unguarded_line(protocol::kOutputMask) : -1;
  if (unguarded >= 0) {
    ttl_ms_ = before;
    return refuse(reply, symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED, static_cast<uint64_t>(unguarded));
  }
  alive_until_ = ttl_ms == 0 ? hal::kNever : board_.clock.now() + ticks_of_ms(ttl_ms);
}

void Core::identify(uint32_t seconds, symrig_wire_Reply& reply) {
  if (seconds > kMaxIdentifySeconds) return bad_value(reply, symrig_wire_Identify_seconds_tag);
  beacon_.identify_until(board_.clock.now() + ticks_of_ms(seconds * 1000));
}

/// Restarts the board after its answer had time to leave. The watchdog takes longer than that by itself.
void Core::reboot(const symrig_wire_Reboot& reboot, symrig_wire_Reply& reply) {
  const protocol::ByteView id{board_.traits.unique_id, board_.traits.unique_id_size};
  if (reboot.token != protocol::crc32c(id)) return bad_value(reply, symrig_wire_Reboot_token_tag);
  if (reboot.starve_watchdog && reboot.bootloader)
    return bad_value(reply, symrig_wire_Reboot_starve_watchdog_tag);
  if (!permit(Condition::reboot, reply)) return;
  starving_ = starving_ || reboot.starve_watchdog;
  if (reboot.starve_watchdog) return;
  reboot_at_ = board_.clock.now() + ticks_of_ms(kRebootDelayMs);
  to_bootloader_ = reboot.bootloader;
}

}  // namespace symrig::firmware
