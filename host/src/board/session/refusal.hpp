// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/lint.hpp"
#include "symrig/protocol/messages.hpp"
#include "symrig/protocol/program.hpp"

#include <string_view>

namespace symrig::board {

/// Describes a broken rule, with the shortest legal alternative.
Finding explain(const protocol::Violation& violation, const BoardInfo& info);

/// Describes a board's refusal. request: the refused request, such as "to arm".
Error explain_refusal(const symrig_wire_Reply& reply, std::string_view request, const BoardInfo& info);

}  // namespace symrig::board
