// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace symrig::board_linux {

/// Sends a state such as "READY=1" to systemd, if systemd has started this process (sd_notify(3): a datagram
/// to $NOTIFY_SOCKET).
void notify_manager(std::string_view state);

/// Writes one line to the log: standard error, which systemd stores in its journal.
void log_line(std::string_view text);

}  // namespace symrig::board_linux
