// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlp/hid_transport.hpp"

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

}  // namespace symrig::test
