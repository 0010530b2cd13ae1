// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc350/hid_transport.hpp"

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace symrig::test {

/// A DLPC350 as its public documents describe it (DLPU010, and TI's published interface library): the bytes
/// of its USB interface, its settings, its own check of a sequence, and whether light leaves it. Written from
/// the documents, not from the driver: it shares no constants with it.
///
/// Faults are members that a test sets.
class EmulatedDlpc350 {
 public:
  using Report = projector::dlpc350::Report;
  using Bytes = std::vector<std::uint8_t>;

  EmulatedDlpc350();

  // The signal at its video port.
  int columns = 912, rows = 1140;
  int hertz = 60;
  int hertz_unit = 100;  ///< the number that it reports for 1 Hz
  bool signal = true;

  // Faults.
  std::map<unsigned, int> refuse;        ///< by command: how many times it is refused
  int stalled = 0;                       ///< commands that get no answer
  int late = 0;                          ///< commands whose answer comes after the next one was asked
  std::optional<std::size_t> bad_entry;  ///< the table's entry that it changes when it is written
  std::optional<int> reset_after;        ///< it is reset after so many more commands
  std::optional<int> unplugged_after;    ///< it is gone after so many more commands
  int slow_check = 0;                    ///< times that its check is not ready
  bool sequencer_fault = false;
  bool standby = false;

  /// What a program before symrig left: settings by command, without the table.
  Bytes setting(unsigned command) const { return settings_.at(command); }
  void set(unsigned command, Bytes value) { settings_[command] = std::move(value); }
  std::vector<std::array<std::uint8_t, 3>>& table() { return table_; }
  int running() const { return settings_.at(0x1A24)[0]; }
  bool shows_patterns() const { return settings_.at(0x1A1B)[0] != 0; }
  bool table_is_open() const { return open_table_ != 0; }
  /// All settings and the table: two equal texts are one state.
  std::string state() const;
  /// Patterns leave the lens: the sequence runs and an LED is on.
  bool shows_sequence() const { return shows_patterns() && running() == 2; }
  int sequences_started() const { return started_; }
  /// The sequence as its settings and table say.
  struct SequenceShown {
    std::vector<int> patterns;  ///< numbers of the bits, in order
    std::uint32_t exposure_us = 0, period_us = 0;
    int frame_lead = 0;  ///< from TRIG_OUT_2 to TRIG_OUT_1 of the first pattern, in units of 107.2 ns
  };
  SequenceShown sequence() const;
  const std::vector<unsigned>& commands() const { return commands_; }

  /// A loss of power: all settings are those of the flash.
  void reset();

  /// A report from the host. false: it is unplugged.
  bool report(const Report& report);
  /// The next report to the host.
  std::optional<Report> next();
  bool gone() const { return gone_; }

 private:
  void run(std::uint8_t flags, std::uint8_t number, unsigned command, const Bytes& data);
  void answer(std::uint8_t flags, std::uint8_t number, const Bytes& data, bool refused);
  std::optional<Bytes> read(unsigned command);
  bool write(unsigned command, const Bytes& data);
  bool write_table(const Bytes& data);
  std::uint8_t check() const;
  Bytes signal_bytes() const;
  bool took_refusal(unsigned command);

  std::map<unsigned, Bytes> settings_;
  std::vector<std::array<std::uint8_t, 3>> table_;
  std::uint8_t open_table_ = 0, address_ = 0;
  std::optional<std::uint8_t> checked_;  // the result of the last check; none: a setting has changed since
  int not_ready_ = 0;
  int started_ = 0;
  std::vector<unsigned> commands_;
  Bytes message_;
  std::deque<Report> out_, held_;
  bool gone_ = false;
};

/// A transport to an emulated controller. The controller outlives the transport, as a device outlives its
/// handle.
class EmulatedTransport final : public projector::dlpc350::HidTransport {
 public:
  explicit EmulatedTransport(std::shared_ptr<EmulatedDlpc350> device) : device_(std::move(device)) {}

  Result<void> write(const projector::dlpc350::Report& report) override;
  Result<projector::dlpc350::Report> read(Nanoseconds patience) override;
  std::string name() const override { return "DLPC350 at /dev/hidraw7"; }

 private:
  std::shared_ptr<EmulatedDlpc350> device_;
};

}  // namespace symrig::test
