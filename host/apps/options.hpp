// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/base/result.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/link.hpp"

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// Records words that an option takes, so that a shell can complete them. It checks nothing: the library
/// knows the words, and refuses others with the nearest one. The type name tells what else the option takes.
CLI::Option* takes_words(CLI::Option* option, std::span<const std::string_view> words);
inline CLI::Option* takes_words(CLI::Option* option, const std::vector<std::string_view>& words) {
  return takes_words(option, std::span<const std::string_view>(words));
}

/// The recorded words; none, if there are none.
const std::vector<std::string>& words_of(const CLI::Option& option);

/// Why a text is not a whole number from least to most; empty if it is one. The parser alone reads 010 as
/// eight, and clamps a number that does not fit 64 bits.
std::string whole_number_fault(const std::string& text, long long least, long long most);
/// Why a text is not a finite decimal number; empty if it is one.
std::string real_number_fault(const std::string& text);

/// A whole number and nothing else: "-3".
std::optional<int> plain_number(std::string_view text);
/// Two whole numbers with a separator: "3x2", "0,1".
std::optional<std::pair<int, int>> two_numbers(std::string_view text, char between);

/// Makes an option accept numbers only, before they are converted. The code that uses a number checks its
/// range.
template <class T>
CLI::Option* takes_number(CLI::Option* option) {
  if constexpr (std::is_floating_point_v<T>) {
    return option->check(real_number_fault);
  } else {
    const auto fault = [](const std::string& text) {
      return whole_number_fault(text, std::numeric_limits<T>::min(), std::numeric_limits<T>::max());
    };
    return option->check(fault);
  }
}

/// An option that has no effect together with other options.
struct Idle {
  const char* option;  ///< "--tolerance"
  bool idle;           ///< true: the option has no effect
  std::string why;     ///< "with --algorithm brute: each pixel is measured"
};

/// Refuses an option without effect, because the user expects one.
/// fails: bad_argument (names the first given option that is idle).
Result<void> check_effects(const CLI::App& command, std::span<const Idle> options);

/// Adds `--device URI|SERIAL`, for commands that talk to one board.
void add_device(CLI::App& command, std::string& device);

/// The URI of the board that --device names. If no board is found, the error also names the simulated one.
/// fails: as choose_board.
Result<DeviceUri> choose_board(const std::string& device);

/// Opens the board that --device names. If it is empty: the board of SYMRIG_DEVICE, or the only board that is
/// connected.
/// fails: as choose_board, open_link and Board::connect.
Result<Board> open_board(const std::string& device, const BoardOptions& options = {});
Result<Board> open_board(const DeviceUri& uri, const BoardOptions& options = {});

/// Help text: how boards are named.
inline constexpr const char* kDeviceHelp =
    "Name a board by its serial number or the beginning of it, or by a URI: usb:SERIAL, "
    "serial:/dev/ttyACM0,\n"
    "tcp:HOST:PORT, unix:PATH, virtual:unix:PATH, virtual:tcp:HOST:PORT, sim:.\n"
    "Without a name the command uses the environment variable SYMRIG_DEVICE, else the only "
    "connected board.\n"
    "If several boards are connected, it stops with an error.\n";

/// Adds `--memory SIZE`.
void add_memory(CLI::App& command, std::string& memory);

/// Its bytes; 0 if it is not given.  fails: bad_argument.
Result<std::int64_t> memory_of(const std::string& memory);

/// Adds `--port PORT` of a page that a command serves.
void add_port(CLI::App& command, std::optional<int>& port);

/// fails: bad_argument (no port).
Result<void> check_port(int port);

/// An error of settings_of() or check_rig() with the option names of the command line: max_patterns becomes
/// --max-patterns.
Error in_command_words(Error error);

/// An error of a CaptureJob that names options: in its next step resume becomes --resume.
Error hint_in_command_words(Error error);

/// Checks one tolerance of a list.
/// fails: bad_argument (names the option) unless 0 < value < 1.
Result<void> check_tolerance(const char* option, double value);

}  // namespace symrig::apps
