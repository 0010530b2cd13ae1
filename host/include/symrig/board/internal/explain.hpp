// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"
#include "symrig/protocol/messages.hpp"
#include "symrig/protocol/program.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace symrig::board {

/// The name of a value of the wire, and the next step.
struct Explained {
  std::string_view name;
  std::string_view hint;
};

/// fault: a FaultCode of the wire.
Explained explain_fault(std::uint32_t fault);
/// code: a reply's Code of the wire.
Explained explain_code(std::uint32_t code);

/// "line 'vsync'", or "line 7" if the board has no name for it.
std::string line_text(const BoardInfo& info, std::uint64_t line);
/// "1.5 ms (187500 ticks)"
std::string ticks_text(const BoardInfo& info, std::uint64_t ticks);
/// "vsync, camera_strobe": the board's lines of one direction.
std::string known_lines(const BoardInfo& info, bool output);
/// The next step after an unknown line name: the nearest name, and all names of that direction (or of both).
std::string line_hint(const BoardInfo& info, std::string_view given, std::optional<bool> output = {});

/// Describes a broken rule, with the shortest legal alternative.
Finding explain(const protocol::Violation& violation, const BoardInfo& info);

/// Describes a board's refusal. request: the refused request, such as "to arm".
Error explain_refusal(const symrig_wire_Reply& reply, std::string_view request, const BoardInfo& info);

}  // namespace symrig::board
