// SPDX-License-Identifier: Apache-2.0
// Requests about lines and about the permanent memory.
#include "replies.hpp"
#include "symrig/firmware/core.hpp"

namespace symrig::firmware {
namespace {

using protocol::LineConfig;
using protocol::raw;

/// The number of the first field with an invalid value, or 0.
uint32_t first_bad_field(const symrig_wire_ConfigLine& line) {
  const bool limits = line.max_on != 0 || line.min_off != 0 || line.max_duty_permille != 0;
  const bool output = raw(line.direction) == symrig_wire_Direction_DIRECTION_OUTPUT;
  const bool interlock = raw(line.role) == symrig_wire_LineRole_LINE_ROLE_INTERLOCK;
  if (raw(line.direction) > _symrig_wire_Direction_MAX) return symrig_wire_ConfigLine_direction_tag;
  if (raw(line.role) > _symrig_wire_LineRole_MAX || (interlock && output))
    return symrig_wire_ConfigLine_role_tag;
  if (raw(line.hazard) > _symrig_wire_Hazard_MAX) return symrig_wire_ConfigLine_hazard_tag;
  if (!output && line.safe_level) return symrig_wire_ConfigLine_safe_level_tag;
  if (line.max_on > protocol::kMaxDuration || (limits && !output)) return symrig_wire_ConfigLine_max_on_tag;
  // A laser must have a limit on its time on.
  if (raw(line.hazard) == symrig_wire_Hazard_HAZARD_LASER && output && line.max_on == 0)
    return symrig_wire_ConfigLine_max_on_tag;
  if (line.min_off > protocol::kMaxDuration) return symrig_wire_ConfigLine_min_off_tag;
  if (line.max_duty_permille > 1000) return symrig_wire_ConfigLine_max_duty_permille_tag;
  if (line.trip_level && !interlock) return symrig_wire_ConfigLine_trip_level_tag;
  return 0;
}

LineConfig to_config(const symrig_wire_ConfigLine& line) {
  LineConfig config;
  config.configured = true;
  config.output = raw(line.direction) == symrig_wire_Direction_DIRECTION_OUTPUT;
  config.role = static_cast<uint8_t>(raw(line.role));
  config.hazard = static_cast<uint8_t>(raw(line.hazard));
  config.safe_level = line.safe_level;
  config.capture = line.capture;
  config.max_on = line.max_on;
  config.min_off = line.min_off;
  config.max_duty_permille = static_cast<uint16_t>(line.max_duty_permille);
  config.trip_level = line.trip_level;
  return config;
}

}  // namespace

void Core::configure_line(const symrig_wire_ConfigLine& line, symrig_wire_Reply& reply) {
  if (line.line >= board_.traits.line_count)
    return refuse(reply, symrig_wire_Code_CODE_NO_SUCH_LINE, line.line);
  if (const uint32_t field = first_bad_field(line)) return bad_value(reply, field);
  const hal::Line& wired = board_.traits.lines[line.line];
  const LineConfig config = to_config(line);
  if (config.output != wired.output) return refuse(reply, symrig_wire_Code_CODE_WRONG_DIRECTION, line.line);
  if (is_interlock(config) && !wired.trips) return bad_value(reply, symrig_wire_ConfigLine_role_tag);
  // The guard cannot keep a limit on a pin whose edges the board does not stamp.
  if (config.limited() && wired.stamp_ticks == 0) return bad_value(reply, symrig_wire_ConfigLine_max_on_tag);
  if (!permit(Condition::config_line, reply)) return;
  config_.lines[line.line] = config;
}

void Core::finalize_config(uint32_t hash, symrig_wire_Reply& reply) {
  const uint32_t own = protocol::config_hash(config_);
  if (!transition(state_, Condition::config_final).allowed) {
    permit(Condition::config_final, reply);
    return;
  }
  if (hash != own) return refuse(reply, symrig_wire_Code_CODE_HASH_MISMATCH, own);
  use_safe_levels(config_.safe_levels());
  permit(Condition::config_final, reply);
  config_hash_ = own;
  board_.capture.watch(config_.watched_lines());
  guard_.configure(config_, board_.capture.levels(), board_.clock.now());
}

/// Loads the safe levels that hold before a host configures the board.
void Core::load_stored_config() {
  if (load_config(board_.settings, board_.traits, config_, label_)) {
    safe_levels_ = config_.safe_levels();
    stored_config_ = protocol::config_hash(config_);
  }
  config_.clear();  // only the safe levels are used; the host configures the lines
}

void Core::store_config(const symrig_wire_StoreConfig& store, symrig_wire_Reply& reply) {
  const bool configured = state_ == State::configured || state_ == State::loaded || state_ == State::done;
  // A write to flash stops everything else for some time.
  if (!configured || leaving() || board_.engine.levels() != safe_levels_)
    return refuse(reply, symrig_wire_Code_CODE_BAD_STATE, static_cast<uint64_t>(state_));
  Label label;
  put_text(store.label, label.text);
  if (!save_config(board_.settings, config_, label))
    return refuse(reply, symrig_wire_Code_CODE_NOT_STORED, 0);
  stored_config_ = config_hash_;
  label_ = label;
}

}  // namespace symrig::firmware
