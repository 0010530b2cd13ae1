// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "board_file.hpp"
#include "clock.hpp"
#include "gpio.hpp"
#include "kept_files.hpp"
#include "measure.hpp"
#include "player.hpp"
#include "symrig/firmware/core.hpp"
#include "transport.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace symrig::board_linux {

/// Runs the firmware core on this computer's lines and links.
class Daemon final : private hal::System {
 public:
  static constexpr std::size_t kSegments = 4096;  ///< in the player's queue

  struct Parts {
    BoardFile file;
    std::vector<std::uint8_t> id;
    Abilities abilities;
    std::unique_ptr<Gpio> gpio;
    std::vector<std::unique_ptr<Transport>> transports;
    /// The outputs go to their safe levels if the main loop has been blocked for this long. The process ends
    /// if the player has been blocked for five times as long. Tests use a longer time, so that a busy
    /// computer does not disturb them.
    hal::Tick patience = 400 * kMillisecond;
  };

  explicit Daemon(Parts parts);
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  /// Serves hosts until `stop` is readable, then makes the outputs safe.
  /// fails: device_lost (a GPIO chip or the player failed), io. The outputs are then as safe as possible.
  Result<void> run(int stop);

 private:
  static constexpr std::size_t kProgramRecords = 24'576;
  static constexpr std::uint16_t kEvents = 512;

  // hal::System
  hal::ResetCause reset_cause() const override { return cause_; }
  void reboot(bool bootloader) override;

  void describe();
  void start_core(hal::ResetCause cause);
  Result<void> serve(int stop);
  Result<void> turn();
  bool wait_for_work(int stop);
  hal::Tick next_work() const;
  Result<void> check_player() const;
  void note_safe_levels();
  void tell_holder();
  void tell_fault();
  void pet_manager();

  Parts parts_;
  std::vector<hal::Line> lines_;
  std::uint32_t output_mask_ = 0;
  hal::BoardTraits traits_;
  KernelClock clock_;
  SettingsFile settings_;
  FaultFile faults_;
  SafeLevelsFile safe_file_;
  RunMark mark_;
  Led led_;
  LinkSwitch links_;
  std::unique_ptr<Player> player_;
  std::optional<PinCapture> capture_;
  std::optional<hal::Board> board_;
  std::vector<std::uint8_t> program_;
  std::vector<symrig_wire_Event> events_;
  std::vector<firmware::QueuedMark> marks_;
  std::optional<firmware::Core> core_;
  hal::ResetCause cause_ = hal::ResetCause::power;
  bool reboot_asked_ = false;
  std::optional<std::uint32_t> noted_safe_;
  std::string told_holder_;
  std::uint32_t told_fault_ = 0;
  hal::Tick petted_ = 0;
  Alarm alarm_;
  std::vector<pollfd> fds_;
};

/// The safe levels at the start: those of the last daemon, else those of the stored configuration, else low.
std::uint32_t kept_safe_levels(const BoardFile& file);

}  // namespace symrig::board_linux
