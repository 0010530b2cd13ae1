// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "usbip/usb_device.hpp"

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

namespace symrig::test {

/// Serves an emulated device as a USB device of the kernel, by USB/IP on the loopback network (the kernel's
/// Documentation/usb/usbip_protocol.rst). `usbip attach -r 127.0.0.1 -b 1-1` connects it.
class UsbIpServer {
 public:
  /// port: 0: any that is free.
  explicit UsbIpServer(std::shared_ptr<UsbDevice> device, std::uint16_t port = 3240);
  ~UsbIpServer();
  UsbIpServer(const UsbIpServer&) = delete;
  UsbIpServer& operator=(const UsbIpServer&) = delete;

  /// Hold it while the device is looked at or changed.
  std::mutex& mutex() { return mutex_; }
  /// Where it listens. 0: nowhere, because the port is taken.
  std::uint16_t port() const { return port_; }
  /// Answers reads that wait: the device has something to say that nobody asked for. Not with mutex() held.
  void answer();
  /// Pulls the cable. It can be attached again.
  void unplug();

 private:
  using Bytes = std::vector<std::uint8_t>;
  void serve();
  void talk(int connection);
  bool handle_request(int connection);
  bool unlink(int connection, std::uint32_t number, std::uint32_t victim);
  bool submit(int connection, std::uint32_t number, bool in, std::uint32_t endpoint, std::size_t length,
              std::span<const std::uint8_t> setup);
  bool control(int connection, std::uint32_t number, bool in, std::size_t length,
               std::span<const std::uint8_t> setup);
  bool answer_waiting(int connection);

  struct Waiting {
    std::uint32_t number;
    unsigned endpoint;
    std::size_t length;
  };
  std::shared_ptr<UsbDevice> device_;
  std::mutex mutex_;             // guards the device, what waits, and what is sent
  std::deque<Waiting> waiting_;  // reads that have no answer yet
  Fd listener_;
  std::uint16_t port_ = 0;
  int connection_ = -1;  // -1: none
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace symrig::test
