// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace symrig::bench_vm {

/// A display that shows one picture in the simplest way: a mode, a buffer, no flips. The destructor switches
/// it off.
class Screen {
 public:
  /// Uses the card's mode of this size. error() is empty after success.
  Screen(const std::string& card, int cols, int rows);
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen();

  /// 0x00RRGGBB in raster order. Returns the error, empty after success.
  std::string show(const std::vector<std::uint32_t>& rgb);
  const std::string& error() const { return error_; }
  int rows() const { return rows_; }
  int cols() const { return cols_; }

 private:
  std::string set_up();
  std::string make_buffer();

  int rows_, cols_;
  int card_;
  std::uint32_t crtc_ = 0, buffer_ = 0, pitch_ = 0;
  std::byte* memory_ = nullptr;
  std::size_t bytes_ = 0;
  std::string error_;
};

}  // namespace symrig::bench_vm
