// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/base/result.hpp"
#include "transport.hpp"

#include <cstdint>
#include <memory>
#include <string>

namespace symrig::board_linux {

/// A serial port in raw mode: a UART, or a gadget's (/dev/ttyGS0). The host counts as attached while the port
/// exists.
class SerialTransport final : public BufferedTransport {
 public:
  /// fails: bad_argument (rate not possible, not a serial port), device_refused (no permission, in use), io.
  static Result<std::unique_ptr<SerialTransport>> open(const std::string& path, std::uint32_t baud);

  const std::string& name() const override { return name_; }
  void watch(std::vector<pollfd>& fds) const override;
  void serve() override;
  bool attached() const override { return static_cast<bool>(port_); }

 private:
  SerialTransport(Fd port, std::string name) : port_(std::move(port)), name_(std::move(name)) {}
  void flush() override;
  void hang_up();

  Fd port_;
  std::string name_;
};

}  // namespace symrig::board_linux
