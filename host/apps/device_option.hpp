// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/discovery.hpp"

#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

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

}  // namespace symrig::apps
