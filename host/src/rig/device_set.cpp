// SPDX-License-Identifier: Apache-2.0
#include "rig/device_set.hpp"

#include <algorithm>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr Nanoseconds kBetweenLooks{500'000'000};

/// The settings of the named line, or new default settings.
LineConfig& line_in(std::vector<LineConfig>& lines, const std::string& name) {
  const auto found =
      std::find_if(lines.begin(), lines.end(), [&name](const LineConfig& line) { return line.line == name; });
  if (found != lines.end()) return *found;
  LineConfig line;
  line.line = name;
  lines.push_back(line);
  return lines.back();
}

/// The rig file's settings of lines, with what a capture needs of the lines that it uses.
std::vector<LineConfig> lines_of(const RigOptions& options) {
  const RigSetup& setup = options.setup;
  std::vector<LineConfig> lines;
  for (const RigLine& line : setup.lines)
    if (line.place != 0) lines.push_back(line.config);
  for (const RigRole role : {RigRole::projector, RigRole::camera})
    if (const RigLine* line = setup.with_role(role))
      line_in(lines, line->config.line).safe_level = line->active_low;
  const RigLine* strobe = setup.with_role(RigRole::strobe);
  const RigLine* seen = strobe == nullptr ? setup.with_role(RigRole::camera) : strobe;
  if (seen != nullptr) line_in(lines, seen->config.line).capture = true;
  // Bit planes are proved by the edges of both trigger outputs.
  if (const RigLine* plane = setup.with_role(RigRole::plane)) {
    line_in(lines, plane->config.line).capture = true;
    if (const RigLine* frame = setup.with_role(RigRole::vsync))
      line_in(lines, frame->config.line).capture = true;
  }
  return lines;
}

bool host_went_away(const std::optional<FaultInfo>& fault) {
  return fault && (fault->name == "keep_alive" || fault->name == "link_lost");
}

/// true: the device may come back after this error.
bool may_come_back(ErrorCode code) {
  return code == ErrorCode::device_lost || code == ErrorCode::protocol || code == ErrorCode::timeout;
}

}  // namespace

Result<void> DeviceSet::open() {
  if (!board_) SYMRIG_CHECK(of(Part::board, open_board()));
  if (!camera_) SYMRIG_CHECK(of(Part::camera, open_camera()));
  if (!projector_) SYMRIG_CHECK(of(Part::projector, open_projector()));
  SYMRIG_CHECK(check_grids());
  camera_grid_ = camera_->grid();
  projector_grid_ = projector_->grid();
  return of(Part::board, configure());
}

Result<void> DeviceSet::open_board() {
  SYMRIG_TRY(auto board, devices_.board());
  board_.emplace(std::move(board));
  return {};
}

Result<void> DeviceSet::open_projector() {
  SYMRIG_TRY(projector_, devices_.projector());
  return {};
}

Result<void> DeviceSet::open_camera() {
  SYMRIG_TRY(camera_, devices_.camera());
  return {};
}

Result<void> DeviceSet::check_grids() const {
  const auto check = [](std::string_view device, const std::optional<Grid>& before,
                        Grid now) -> Result<void> {
    if (!before || *before == now) return {};
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the {} came back with a grid of {}, it had {}", device, to_string(now),
                             to_string(*before)),
                 fmt::format("connect the {} that the capture began with", device)};
  };
  SYMRIG_CHECK(check("camera", camera_grid_, camera_->grid()));
  return check("projector", projector_grid_, projector_->grid());
}

/// Ends what an earlier run of symrig left: stops its program, and clears a fault that only reports a lost
/// host. Any other fault stays until the user clears it.
Result<void> DeviceSet::end_last_run() {
  SYMRIG_TRY(BoardStatus status, board_->status());
  if (status.state == BoardState::running || status.state == BoardState::armed) {
    SYMRIG_CHECK(board_->abort());
    SYMRIG_TRY(status, board_->status());
  }
  if (status.state != BoardState::fault) return {};
  if (host_went_away(status.fault)) return board_->clear_fault();
  return Error{
      ErrorCode::fault,
      fmt::format("the board has latched the fault {} ({})", status.fault ? status.fault->name : "unknown",
                  status.fault ? status.fault->hint : ""),
      "remove its cause, then clear it: symrig run --clear-fault"};
}

Result<void> DeviceSet::configure() {
  SYMRIG_CHECK(end_last_run());
  SYMRIG_CHECK(board_->configure(lines_of(options_)));
  return clock_.begin(*board_);
}

bool DeviceSet::can_reopen(Part part) const {
  if (part == Part::board) return devices_.board != nullptr;
  if (part == Part::projector) return devices_.projector != nullptr;
  return part == Part::camera && devices_.camera != nullptr;
}

void DeviceSet::close(Part part) {
  if (part == Part::board) board_.reset();
  if (part == Part::projector) projector_.reset();
  if (part == Part::camera) camera_.reset();
}

Result<void> DeviceSet::reopen(Part part) {
  if (part == Part::board) {
    SYMRIG_CHECK(open_board());
    return configure();
  }
  SYMRIG_CHECK(part == Part::projector ? open_projector() : open_camera());
  return check_grids();
}

Result<DeviceSet::Part> DeviceSet::recover(const Error& error) {
  const Part part = std::exchange(failed_, Part::none);
  if (part == Part::none) return error;
  if (part == Part::board && error.code != ErrorCode::device_lost) {
    if (auto configured = configure_again(error); configured) return part;
  }
  if (!may_come_back(error.code) || !can_reopen(part)) return error;
  return wait_for(part, error);
}

/// A board that responds without its configuration was restarted. A board that lost contact to the host is in
/// a safe state.
Result<DeviceSet::Part> DeviceSet::configure_again(const Error& error) {
  SYMRIG_TRY(const BoardStatus status, board_->status());
  const bool restarted = status.config_hash == 0 && status.state != BoardState::fault;
  if (!restarted && !host_went_away(status.fault)) return error;
  SYMRIG_CHECK(configure());
  return Part::board;
}

Result<DeviceSet::Part> DeviceSet::wait_for(Part part, const Error& error) {
  close(part);
  Error last = error;
  for (Nanoseconds waited{0}; waited <= options_.device_patience; waited += kBetweenLooks) {
    auto opened = reopen(part);
    if (opened) return part;
    last = opened.error();
    close(part);
    if (!may_come_back(last.code) && last.code != ErrorCode::not_found) return last;
    if (options_.keep_waiting && !options_.keep_waiting())
      return Error{ErrorCode::interrupted, "stopped while waiting for a device: " + error.what, error.hint};
    if (options_.pause) {
      options_.pause(kBetweenLooks);
    } else {
      std::this_thread::sleep_for(kBetweenLooks);
    }
  }
  return Error{
      error.code,
      fmt::format("{}; it did not come back within {:.3g} s", error.what, seconds(options_.device_patience)),
      error.hint};
}

}  // namespace symrig
