// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace symrig {

/// A file descriptor that closes itself; -1: none.
class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) : fd_(fd) {}
  Fd(Fd&& other) noexcept;
  Fd& operator=(Fd&& other) noexcept;
  ~Fd();

  int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }
  /// Closes it now. false: the system reports an error, as a full disk may only here. Without one, true.
  bool close();

 private:
  int fd_ = -1;
};

}  // namespace symrig
