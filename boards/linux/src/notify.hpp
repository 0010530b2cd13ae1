// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace symrig::board_linux {

/// Tells systemd something ("READY=1"), if it has started us (sd_notify(3): a datagram to $NOTIFY_SOCKET).
void notify_manager(std::string_view state);

/// One line to the log: standard error, which systemd keeps in its journal.
void log_line(std::string_view text);

}  // namespace symrig::board_linux
