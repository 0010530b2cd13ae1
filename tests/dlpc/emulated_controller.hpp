// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/internal/dlp_link.hpp"

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace symrig::test {

/// The USB interface and the settings of an emulated DLP controller. Written from the public documents, not
/// from the driver: it shares no constants with it.
///
/// Faults are members that a test sets.
class EmulatedController {
 public:
  using Report = projector::dlp::Report;
  using Bytes = std::vector<std::uint8_t>;

  EmulatedController() = default;
  EmulatedController(const EmulatedController&) = delete;
  EmulatedController& operator=(const EmulatedController&) = delete;
  virtual ~EmulatedController() = default;

  // The signal at its video port.
  int columns = 0, rows = 0;
  int hertz = 60;
  bool signal = true;

  // Faults.
  std::map<unsigned, int> refuse;        ///< by command: how many times it is refused
  int stalled = 0;                       ///< commands that get no answer
  int late = 0;                          ///< commands whose answer comes after the next one was asked
  std::optional<std::size_t> bad_entry;  ///< the table's entry that it changes when it is written
  std::optional<int> reset_after;        ///< it is reset after so many more commands
  std::optional<int> unplugged_after;    ///< it is gone after so many more commands
  bool sequencer_fault = false;
  bool standby = false;

  /// Its product's name and USB number.
  virtual std::string product() const = 0;
  virtual std::uint16_t product_id() const = 0;
  /// A loss of power: all settings are those of the flash.
  virtual void reset() = 0;
  /// All settings that the host can put back: two equal texts are one state.
  virtual std::string state() const = 0;
  /// Patterns leave the lens: the sequence runs.
  virtual bool shows_sequence() const = 0;
  /// The sequence as its settings and table say.
  struct SequenceShown {
    std::vector<int> patterns;  ///< numbers of the bits, in order
    std::uint32_t exposure_us = 0, period_us = 0;
    double frame_lead_us = 0;  ///< from the frame trigger to the plane trigger of the first pattern
    bool frames_all = false;   ///< the frame trigger lasts to the end of the last pattern, not only a pulse
  };
  virtual SequenceShown sequence() const = 0;

  /// What a program before symrig left: settings by command, without the table.
  Bytes setting(unsigned command) const { return settings_.at(command); }
  void set(unsigned command, Bytes value) { settings_[command] = std::move(value); }
  int sequences_started() const { return started_; }
  const std::vector<unsigned>& commands() const { return commands_; }

  /// A report from the host. false: it is unplugged.
  bool report(const Report& report);
  /// The next report to the host.
  std::optional<Report> next();
  bool gone() const { return gone_; }

 protected:
  /// None: the controller refuses.
  virtual std::optional<Bytes> read(unsigned command) = 0;
  /// false: refused.
  virtual bool write(unsigned command, const Bytes& data) = 0;
  /// A setting that is read as it was written.
  std::optional<Bytes> read_setting(unsigned command) const;
  bool write_setting(unsigned command, const Bytes& data);
  /// "1a07: [8]", a line for each setting.
  std::string settings_text() const;

  std::map<unsigned, Bytes> settings_;
  int started_ = 0;

 private:
  void run(std::uint8_t flags, std::uint8_t number, unsigned command, const Bytes& data);
  void answer(std::uint8_t flags, std::uint8_t number, const Bytes& data, bool refused);
  bool took_refusal(unsigned command);

  std::vector<unsigned> commands_;
  Bytes message_;
  std::deque<Report> out_, held_;
  bool gone_ = false;
};

/// Numbers in the data of a message: the low byte first.
std::uint32_t number_at(const EmulatedController::Bytes& bytes, std::size_t at, unsigned count);
void put_number(EmulatedController::Bytes& bytes, std::size_t at, unsigned count, std::uint32_t value);

/// A transport to an emulated controller. The controller outlives the transport, as a device outlives its
/// handle.
class EmulatedTransport final : public projector::dlp::HidTransport {
 public:
  explicit EmulatedTransport(std::shared_ptr<EmulatedController> device) : device_(std::move(device)) {}

  Result<void> write(const projector::dlp::Report& report) override;
  Result<projector::dlp::Report> read(Nanoseconds patience) override;
  std::string name() const override { return device_->product() + " at /dev/hidraw7"; }

 private:
  std::shared_ptr<EmulatedController> device_;
};

/// A DLPC350 as its public documents describe it (DLPU010, and TI's published interface library): its
/// settings, its own check of a sequence, and whether light leaves it.
class EmulatedDlpc350 final : public EmulatedController {
 public:
  EmulatedDlpc350();

  int hertz_unit = 100;  ///< the number that it reports for 1 Hz
  int slow_check = 0;    ///< times that its check is not ready

  std::string product() const override { return "DLPC350"; }
  std::uint16_t product_id() const override { return 0x6401; }
  void reset() override;
  bool shows_sequence() const override { return shows_patterns() && running() == 2; }
  SequenceShown sequence() const override;

  std::vector<std::array<std::uint8_t, 3>>& table() { return table_; }
  int running() const { return settings_.at(0x1A24)[0]; }
  bool shows_patterns() const { return settings_.at(0x1A1B)[0] != 0; }
  bool table_is_open() const { return open_table_ != 0; }
  std::string state() const override;  ///< with the table

 private:
  std::optional<Bytes> read(unsigned command) override;
  bool write(unsigned command, const Bytes& data) override;
  bool write_table(const Bytes& data);
  Bytes table_bytes() const;
  std::uint8_t check() const;
  Bytes signal_bytes() const;

  std::vector<std::array<std::uint8_t, 3>> table_;
  std::uint8_t open_table_ = 0, address_ = 0;
  std::optional<std::uint8_t> checked_;  // the result of the last check; none: a setting has changed since
  int not_ready_ = 0;
};

/// A DLPC900 as its public documents describe it (DLPU018J; the main status, the timing of the source and the
/// second trigger output as importly/dmdcontrol reads them): its modes, a table that can only be written, and
/// a sequencer that breaks off if its planes do not end before the next VSYNC.
class EmulatedDlpc900 final : public EmulatedController {
 public:
  EmulatedDlpc900();

  int mirrors = 1;          ///< 1: DLP6500
  int slow_mode = 2;        ///< times that the display mode reads wrong after a change
  int slow_start = 1;       ///< times that the sequencer does not run yet after a start
  bool loses_lock = false;  ///< in video-pattern mode it loses the signal

  std::string product() const override { return "DLPC900"; }
  std::uint16_t product_id() const override { return 0xC900; }
  void reset() override;
  bool shows_sequence() const override { return mode() == 2 && running_ && !broken_off_; }
  SequenceShown sequence() const override;

  int mode() const { return settings_.at(0x1A1B)[0]; }
  bool running() const { return running_; }
  /// A program before symrig starts its own sequence.
  void start_stored_patterns();
  std::string state() const override;  ///< without the table and the number of its entries

 private:
  using Entry = std::array<std::uint8_t, 12>;

  std::optional<Bytes> read(unsigned command) override;
  bool write(unsigned command, const Bytes& data) override;
  bool write_mode(const Bytes& data);
  bool write_run(std::uint8_t run);
  bool write_entry(const Bytes& data);
  bool write_counts(const Bytes& data);
  bool is_locked() const;
  bool fits() const;
  Bytes status(unsigned command);
  Bytes timing() const;

  std::vector<Entry> table_;      // as defined
  std::vector<Entry> effective_;  // after the configuration
  bool running_ = false, broken_off_ = false, aborted_ = false;
  int mode_before_ = 0, mode_reads_ = 0, start_reads_ = 0;
};

/// What goes wrong at a command.
enum class CommandFault : std::uint8_t { refused, not_answered, reset, unplugged };
inline constexpr std::array kCommandFaults{CommandFault::refused, CommandFault::not_answered,
                                           CommandFault::reset, CommandFault::unplugged};

/// A transport to a controller at which one command goes wrong, counted from 0.
class FaultyTransport final : public projector::dlp::HidTransport {
 public:
  FaultyTransport(std::shared_ptr<EmulatedController> device, CommandFault fault, int at)
      : device_(device), inner_(std::move(device)), fault_(fault), at_(at) {
    if (fault == CommandFault::reset) device_->reset_after = at;
    if (fault == CommandFault::unplugged) device_->unplugged_after = at;
  }

  Result<void> write(const projector::dlp::Report& report) override {
    if (count_++ == at_) {
      if (fault_ == CommandFault::refused)
        device_->refuse[static_cast<unsigned>(report[5] * 256 + report[4])] = 1;
      if (fault_ == CommandFault::not_answered) device_->stalled = 1;
    }
    return inner_.write(report);
  }
  Result<projector::dlp::Report> read(Nanoseconds patience) override { return inner_.read(patience); }
  std::string name() const override { return inner_.name(); }

 private:
  std::shared_ptr<EmulatedController> device_;
  EmulatedTransport inner_;
  CommandFault fault_;
  int at_, count_ = 0;
};

}  // namespace symrig::test
