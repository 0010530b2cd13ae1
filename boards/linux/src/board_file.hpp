// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::board_linux {

/// A line of the board and the GPIO line it is.
struct BoardLine {
  std::string name;  ///< on the wire: "camera_trigger"
  std::string gpio;  ///< as the kernel calls it (gpioinfo): "GPIO17"
  std::string pin;   ///< as the person with the cable calls it: "header 11"; the GPIO line's name if empty
  bool output = false;
};

/// Ways to the host. Empty: not offered.
struct BoardLinks {
  std::string usb;  ///< where a FunctionFS is mounted
  std::string unix_socket;
  std::string serial;
  std::uint32_t baud = 115'200;
  std::string tcp_host;  ///< address to listen on
  std::uint16_t tcp_port = 0;
};

/// What /etc/symrig/board.toml says.
struct BoardFile {
  std::string name = "linux";
  std::string id;                ///< hexadecimal, at most 32 digits; empty: made from this machine's id
  std::string led;               ///< a kernel LED's brightness file; empty: none
  std::vector<BoardLine> lines;  ///< outputs first
  BoardLinks links;
  int priority = 50;  ///< of SCHED_FIFO for the player; the main loop has one less. 0: ordinary
  bool lock_memory = true;
  std::uint32_t lateness_us = 0;  ///< a word may go out so late; later ones are counted. 0: as measured
  std::filesystem::path state_folder = "/var/lib/symrig";  ///< what is kept over power-off
  std::filesystem::path run_folder = "/run/symrig";        ///< what is kept over a restart of the daemon
};

/// The lines and links of a board without a file: named lines as docs/board-linux.md lists them, a socket in
/// the run folder.
BoardFile default_board();

/// fails: bad_format (no TOML, an unknown key, a value that cannot be; says which).
Result<BoardFile> parse_board_file(std::string_view text, const std::string& source);
/// fails: not_found, io, bad_format.
Result<BoardFile> read_board_file(const std::filesystem::path& path);

}  // namespace symrig::board_linux
