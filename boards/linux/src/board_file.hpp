// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::board_linux {

/// The resistor inside the chip that holds an input while nothing drives it.
enum class Bias : std::uint8_t { as_is, up, down, off };

/// A line of the board and its GPIO line.
struct BoardLine {
  std::string name;  ///< on the wire: "camera_trigger"
  std::string gpio;  ///< the kernel's name (gpioinfo): "GPIO17"
  std::string pin;   ///< for people, such as "header 11"; empty: the GPIO line's name
  bool output = false;
  Bias bias = Bias::as_is;  ///< of an input; as_is: as the chip, its driver or the boot loader left it
};

/// The links to the host. Empty: link not offered.
struct BoardLinks {
  std::string usb;  ///< mount point of a FunctionFS
  std::string unix_socket;
  std::string serial;
  std::uint32_t baud = 115'200;
  std::string tcp_host;  ///< address to listen on
  std::uint16_t tcp_port = 0;
};

/// The content of /etc/symrig/board.toml.
struct BoardFile {
  std::string name = "linux";
  std::string id;                ///< hexadecimal, at most 32 digits; empty: computed from this computer's id
  std::string led;               ///< brightness file of a kernel LED; empty: none
  std::vector<BoardLine> lines;  ///< outputs first
  BoardLinks links;
  /// SCHED_FIFO priority of the player; the main loop has one less. 0: ordinary. Above 50, which a kernel
  /// with PREEMPT_RT gives to the interrupts of all devices.
  int priority = 80;
  bool awake = true;  ///< keeps the processors out of sleep states that take long to leave
  bool lock_memory = true;
  std::uint32_t lateness_us = 0;  ///< allowed lateness of a word; later words are counted. 0: as measured
  std::filesystem::path state_folder = "/var/lib/symrig";  ///< for data that survive power-off
  std::filesystem::path run_folder = "/run/symrig";        ///< for data that survive a restart of the daemon
};

/// The lines and links of a board without a file: the named lines in docs/board-linux.md, and a socket in the
/// run folder.
BoardFile default_board();

/// fails: bad_format (not TOML, an unknown key, an invalid value; the error names it).
Result<BoardFile> parse_board_file(std::string_view text, const std::string& source);
/// fails: not_found, io, bad_format.
Result<BoardFile> read_board_file(const std::filesystem::path& path);

/// The board's unique id: the file's id, else 8 bytes that are computed from this computer's id and the
/// board's name. machine-id(5) forbids publishing the id itself.
/// fails: not_found (neither exists).
Result<std::vector<std::uint8_t>> unique_id(const BoardFile& file);
/// In hexadecimal, as the serial number of the USB device.
std::string hexadecimal(const std::vector<std::uint8_t>& bytes);

}  // namespace symrig::board_linux
