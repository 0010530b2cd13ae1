// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/discovery.hpp"

#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// `--device URI|SERIAL`, as every command has it that speaks to one board.
void add_device(CLI::App& command, std::string& device);

/// The board that is meant. Where none is there, the error also names the simulated one.
/// fails: as choose_board.
Result<DeviceUri> choose_board(const std::string& device);

/// Opens the board that --device names; empty: SYMRIG_DEVICE, or the only board there is.
/// fails: as choose_board, open_link and Board::connect.
Result<Board> open_board(const std::string& device, const BoardOptions& options = {});
Result<Board> open_board(const DeviceUri& uri, const BoardOptions& options = {});

/// Help text on how boards are named.
inline constexpr const char* kDeviceHelp =
    "A board is named by its serial number or how that begins, or by a URI: usb:SERIAL, "
    "serial:/dev/ttyACM0,\n"
    "tcp:HOST:PORT, unix:PATH, virtual:unix:PATH, virtual:tcp:HOST:PORT, sim:. Not named, it is that of the "
    "environment's\n"
    "SYMRIG_DEVICE, or the only board that is connected; of several none is guessed.\n";

}  // namespace symrig::apps
