// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/byte_link.hpp"
#include "symrig/hal/types.hpp"
#include "transport.hpp"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace symrig::board_linux {

/// All ways to the host as one link: whoever speaks first has the board, until its end goes away. Others hear
/// that it is busy. A way without connections (USB, serial) does not show that a program has ended: its host
/// gives way if it has been silent for five seconds and another one speaks.
class LinkSwitch final : public hal::ByteLink {
 public:
  explicit LinkSwitch(std::vector<std::unique_ptr<Transport>> transports)
      : transports_(std::move(transports)) {}

  std::size_t read(std::uint8_t* out, std::size_t room) override;
  std::size_t room() const override { return holder_ != nullptr ? holder_->room() : 0; }
  void write(const std::uint8_t* bytes, std::size_t size) override;
  bool attached() const override { return holder_ != nullptr && holder_->attached(); }

  void watch(std::vector<pollfd>& fds) const;
  /// Serves every way and decides who has the board at `now`. Returns true if that has changed: the firmware
  /// must then see one poll without a host, so that it forgets what the last one left half said.
  bool serve(hal::Tick now);
  /// Name of the way that has the board; empty: nobody.
  std::string holder() const { return holder_ != nullptr ? holder_->name() : std::string(); }
  bool pending() const { return holder_ != nullptr && holder_->pending(); }

 private:
  static constexpr hal::Tick kSilence = 5'000'000'000;

  Transport* first_speaker() const;

  std::vector<std::unique_ptr<Transport>> transports_;
  Transport* holder_ = nullptr;
  hal::Tick heard_ = 0;
};

}  // namespace symrig::board_linux
