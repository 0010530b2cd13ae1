// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dlpc/emulated_controller.hpp"

#include <memory>
#include <utility>

namespace symrig::test {

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
