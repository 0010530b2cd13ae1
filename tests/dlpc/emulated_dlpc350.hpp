// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dlpc/emulated_controller.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::test {

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

}  // namespace symrig::test
