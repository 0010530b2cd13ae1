// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/device/board.hpp"
#include "symrig/device/discovery.hpp"

#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// `--device URI|SERIAL`, as every command has it that speaks to one board.
void add_device(CLI::App& command, std::string& device);

/// The board that is meant. Where none is there, the error also names the simulated one.
/// fails: as device::choose_board.
Result<device::DeviceUri> choose_board(const std::string& device);

/// Opens the board that --device names; empty: SYMRIG_DEVICE, or the only board there is.
/// fails: as device::choose_board, device::open_link and device::Board::connect.
Result<device::Board> open_board(const std::string& device, const device::BoardOptions& options = {});
Result<device::Board> open_board(const device::DeviceUri& uri, const device::BoardOptions& options = {});

/// Help text on how boards are named.
inline constexpr const char* kDeviceHelp =
    "A board is named by its serial number or how that begins, or by a URI: usb:SERIAL, "
    "serial:/dev/ttyACM0,\n"
    "tcp:HOST:PORT, unix:PATH, virtual:unix:PATH, virtual:tcp:HOST:PORT, sim:. Not named, it is that of the "
    "environment's\n"
    "SYMRIG_DEVICE, or the only board that is connected; of several none is guessed.\n";

}  // namespace symrig::apps
