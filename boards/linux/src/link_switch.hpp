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

/// Joins all links to one. The first host that sends something gets the board until it disconnects; others
/// get "busy". USB and serial links do not show that a program has ended. So their host loses the board if it
/// has been silent for five seconds and another one sends something.
class LinkSwitch final : public hal::ByteLink {
 public:
  explicit LinkSwitch(std::vector<std::unique_ptr<Transport>> transports)
      : transports_(std::move(transports)) {}

  std::size_t read(std::uint8_t* out, std::size_t room) override;
  std::size_t room() const override { return holder_ != nullptr ? holder_->room() : 0; }
  void write(const std::uint8_t* bytes, std::size_t size) override;
  bool attached() const override { return holder_ != nullptr && holder_->attached(); }

  void watch(std::vector<pollfd>& fds) const;
  /// Serves every link and decides who has the board at `now`. Returns true if that changed. The firmware
  /// must then poll once without a host, to discard an incomplete message of the last host.
  bool serve(hal::Tick now);
  /// Name of the link that has the board; empty: none.
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
