// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc350/dialogue.hpp"
#include "projector/dlpc350/sequence.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace symrig::projector::dlpc350 {

struct Version {
  int major = 0, minor = 0, patch = 0;
  bool operator==(const Version&) const = default;
};
std::string to_string(const Version& version);

/// The state bytes of a controller (DLPU010, "Status Commands").
struct Status {
  std::uint8_t hardware = 0, system = 0, main = 0;

  bool initialized() const { return (hardware & 0x01U) != 0; }
  bool sequencer_aborted() const { return (hardware & 0x40U) != 0; }
  bool sequencer_error() const { return (hardware & 0x80U) != 0; }
  bool memory_tested() const { return (system & 0x01U) != 0; }
  bool parked() const { return (main & 0x01U) != 0; }      ///< the mirrors
  bool sequencing() const { return (main & 0x02U) != 0; }  ///< the sequencer runs
  bool frozen() const { return (main & 0x04U) != 0; }      ///< pictures are not swapped
};

/// Port at which the controller takes pictures.
enum class Port : std::uint8_t { parallel = 0, test_pattern = 1, flash = 2, fpd_link = 3 };

enum class Run : std::uint8_t { stop = 0, pause = 1, start = 2 };

/// Bits of the controller's own check of a sequence (DLPU010, "Validation Command").
struct Validation {
  std::uint8_t bits = 0;

  bool bad_times() const { return (bits & 0x01U) != 0; }
  bool bad_patterns() const { return (bits & 0x02U) != 0; }
  bool joined_triggers() const { return (bits & 0x04U) != 0; }  ///< a warning
  bool no_black() const { return (bits & 0x08U) != 0; }         ///< a warning
  bool short_load() const { return (bits & 0x10U) != 0; }       ///< period - exposure below 230 us
  /// A warning about black before the first pattern is no error: VSYNC begins it, and black is in the table.
  bool ok() const { return !bad_times() && !bad_patterns() && !joined_triggers(); }
};
std::string to_string(Validation validation);

/// LEDs and who switches them.
struct LedEnable {
  std::uint8_t leds = kAllLeds;
  bool by_sequencer = true;
  bool operator==(const LedEnable&) const = default;
};
using LedCurrents = std::array<std::uint8_t, 3>;  ///< red, green, blue; 255 is the most

struct Counts {
  int entries = 1;
  bool repeats = false;
  int patterns_a_trigger = 1;  ///< patterns from TRIG_OUT_2 to TRIG_OUT_2
  int images = 1;
  bool operator==(const Counts&) const = default;
};

struct Times {
  std::uint32_t exposure_us = 0, period_us = 0;
  bool operator==(const Times&) const = default;
};

/// A DLPC350, command by command. Each call fails as Dialogue does.
class Controller {
 public:
  explicit Controller(std::unique_ptr<HidTransport> transport,
                      Nanoseconds patience = Nanoseconds{1'000'000'000})
      : dialogue_(std::move(transport), patience) {}

  std::string name() const { return dialogue_.name(); }
  /// Version of the application in the controller's flash.
  Result<Version> version();
  Result<Status> status();
  Result<bool> standby();
  Result<Signal> signal();

  Result<bool> shows_patterns();
  Result<void> show_patterns(bool patterns);
  Result<std::uint8_t> source();  ///< port and width, as one byte
  Result<void> set_source(std::uint8_t source);
  Result<std::uint8_t> pattern_source();
  Result<void> set_pattern_source(std::uint8_t source);
  Result<std::uint8_t> trigger_mode();
  Result<void> set_trigger_mode(std::uint8_t mode);
  Result<Times> times();
  Result<void> set_times(Times times);
  Result<Counts> counts();
  Result<void> set_counts(const Counts& counts);
  Result<std::vector<TableEntry>> table(int entries);
  Result<void> set_table(const std::vector<TableEntry>& entries);
  Result<bool> inverted();
  Result<void> set_inverted(bool inverted);
  /// number: 1 or 2.
  Result<TriggerOut> trigger_out(int number);
  Result<void> set_trigger_out(int number, const TriggerOut& out);
  Result<LedEnable> led_enable();
  Result<void> set_led_enable(const LedEnable& enable);
  Result<LedCurrents> led_currents();
  Result<void> set_led_currents(const LedCurrents& currents);
  Result<Run> run();
  Result<void> set_run(Run run);
  /// Lets the controller check its sequence. fails: also timeout (it did not end).
  Result<Validation> validate();

 private:
  Result<std::uint8_t> byte(Command command);
  Result<void> close_table();

  Dialogue dialogue_;
};

}  // namespace symrig::projector::dlpc350
