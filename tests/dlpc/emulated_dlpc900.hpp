// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dlpc/emulated_controller.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::test {

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

}  // namespace symrig::test
