// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dlpc/emulated_dlpc350.hpp"
#include "symrig/base/fd.hpp"

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

namespace symrig::test {

/// Serves an emulated DLPC350 as a USB device of the kernel, by USB/IP on 127.0.0.1:3240 (the kernel's
/// Documentation/usb/usbip_protocol.rst). `usbip attach -r 127.0.0.1 -b 1-1` connects it.
class UsbIpServer {
 public:
  explicit UsbIpServer(std::shared_ptr<EmulatedDlpc350> device);
  ~UsbIpServer();
  UsbIpServer(const UsbIpServer&) = delete;
  UsbIpServer& operator=(const UsbIpServer&) = delete;

  /// Hold it while the device is looked at or changed.
  std::mutex& mutex() { return mutex_; }

 private:
  using Bytes = std::vector<std::uint8_t>;
  void serve();
  void talk(int connection);
  bool handle_request(int connection);
  bool unlink(int connection, std::uint32_t number, std::uint32_t victim);
  bool submit(int connection, std::uint32_t number, bool in, std::uint32_t endpoint, std::size_t length,
              std::span<const std::uint8_t> setup);
  bool answer_waiting(int connection);

  struct Waiting {
    std::uint32_t number;
    std::size_t length;
  };
  std::shared_ptr<EmulatedDlpc350> device_;
  std::mutex mutex_;
  std::deque<Waiting> waiting_;  // reads of reports that have no answer yet
  Fd listener_;
  std::atomic<int> connection_ = -1;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace symrig::test
