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

/// The line's own settings, if there are any, or defaults.
LineConfig& line_in(std::vector<LineConfig>& lines, const std::string& name) {
  const auto found =
      std::find_if(lines.begin(), lines.end(), [&name](const LineConfig& line) { return line.line == name; });
  if (found != lines.end()) return *found;
  LineConfig line;
  line.line = name;
  lines.push_back(line);
  return lines.back();
}

/// What the file says about lines, and what a capture needs of those that it uses.
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
  return lines;
}

bool host_went_away(const std::optional<FaultInfo>& fault) {
  return fault && (fault->name == "keep_alive" || fault->name == "link_lost");
}

/// An error after which the device may come back.
bool may_come_back(ErrorCode code) {
  return code == ErrorCode::device_lost || code == ErrorCode::protocol || code == ErrorCode::timeout;
}

}  // namespace

Result<void> DeviceSet::open() {
  if (!board_) SYMRIG_CHECK(of(Part::board, open_board()));
  if (!camera_) SYMRIG_CHECK(of(Part::camera, open_camera()));
  if (!projector_) SYMRIG_CHECK(of(Part::projector, open_projector()));
  SYMRIG_CHECK(check_grids());
  grid_ = camera_->grid();
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
  if (grid_ && *grid_ != camera_->grid())
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the camera came back with a grid of {}, it had {}", to_string(camera_->grid()),
                             to_string(*grid_)),
                 "connect the camera that the capture began with"};
  if (projector_->grid() == camera_->grid()) return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("the projector is {}, the camera {}", to_string(projector_->grid()),
                           to_string(camera_->grid())),
               "a coaxial rig needs one grid: calibrate first"};
}

/// What an earlier session left: its run is stopped, and the fault that says no more than that its host went
/// away is cleared. Any other fault stays until somebody has looked at it.
Result<void> DeviceSet::calm() {
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
      "when its cause is gone, clear it: symrig run --clear-fault"};
}

Result<void> DeviceSet::configure() {
  SYMRIG_CHECK(calm());
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

/// A board that answers but has forgotten its configuration was restarted; one that missed us went safe.
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
    if (options_.wanted && !options_.wanted())
      return Error{ErrorCode::interrupted, "stopped while waiting for a device: " + error.what, error.hint};
    if (options_.pause) {
      options_.pause(kBetweenLooks);
    } else {
      std::this_thread::sleep_for(kBetweenLooks);
    }
  }
  return Error{
      error.code,
      fmt::format("{}; it was not back after {:.3g} s", error.what, seconds(options_.device_patience)),
      error.hint};
}

}  // namespace symrig
