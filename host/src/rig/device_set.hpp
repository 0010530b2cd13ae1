// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/evidence.hpp"
#include "symrig/rig/rig.hpp"

#include <memory>
#include <optional>

namespace symrig {

/// The devices of a rig, which may be lost at any time. Knows which one failed last, and opens it again.
class DeviceSet {
 public:
  enum class Part : std::uint8_t { none, board, projector, camera };

  /// options must outlive this object.
  DeviceSet(RigDevices devices, const RigOptions& options)
      : devices_(std::move(devices)), options_(options) {}
  DeviceSet(Board board, std::unique_ptr<Projector> projector, std::unique_ptr<Camera> camera,
            const RigOptions& options)
      : options_(options),
        board_(std::move(board)),
        projector_(std::move(projector)),
        camera_(std::move(camera)) {}

  /// Opens the devices that are not open, and configures the board.
  /// fails: as the openers and Board::configure(), size_mismatch.
  Result<void> open();

  Board& board() { return *board_; }
  Projector& projector() { return *projector_; }
  const Projector& projector() const { return *projector_; }
  Camera& camera() { return *camera_; }
  const Camera& camera() const { return *camera_; }
  SteadyClock& clock() { return clock_; }

  /// Returns the result unchanged. Remembers the device if it is an error.
  template <class T>
  Result<T> of(Part part, Result<T> result) {
    if (!result) failed_ = part;
    return result;
  }
  /// Recovers from `error`, the last error that passed through of(). Waits for a lost device and opens it
  /// again, or configures a restarted board again. Returns which device it was.
  /// fails: with `error` if recovery is not possible or the device does not come back in time; interrupted.
  Result<Part> recover(const Error& error);

 private:
  Result<void> open_board();
  Result<void> open_projector();
  Result<void> open_camera();
  Result<void> check_grids() const;
  Result<void> configure();
  Result<void> end_last_run();
  bool can_reopen(Part part) const;
  Result<void> reopen(Part part);
  Result<Part> wait_for(Part part, const Error& error);
  Result<Part> configure_again(const Error& error);
  void close(Part part);

  RigDevices devices_;
  const RigOptions& options_;
  std::optional<Board> board_;
  std::unique_ptr<Projector> projector_;
  std::unique_ptr<Camera> camera_;
  SteadyClock clock_;
  std::optional<Grid> camera_grid_, projector_grid_;  // of the first devices that were opened
  Part failed_ = Part::none;
};

}  // namespace symrig
