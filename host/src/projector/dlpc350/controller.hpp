// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlp/controller.hpp"
#include "projector/dlp/signal.hpp"
#include "projector/dlpc350/sequence.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace symrig::projector::dlpc350 {

/// Port at which the controller takes pictures.
enum class Port : std::uint8_t { parallel = 0, test_pattern = 1, flash = 2, fpd_link = 3 };

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

/// A DLPC350, command by command. Each call fails as dlp::Dialogue does.
class Controller : public dlp::Controller {
 public:
  explicit Controller(std::unique_ptr<dlp::HidTransport> transport,
                      Nanoseconds patience = Nanoseconds{1'000'000'000})
      : dlp::Controller(std::move(transport), 3, patience) {}

  Result<dlp::Signal> signal();

  Result<bool> shows_patterns();
  Result<void> show_patterns(bool patterns);
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
  Result<dlp::Run> run();
  /// Lets the controller check its sequence. fails: also timeout (it did not end).
  Result<Validation> validate();

 private:
  Result<void> close_table();
};

}  // namespace symrig::projector::dlpc350
