// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/board/link.hpp"

#include <memory>
#include <string>

namespace symrig::board {

/// Raw wire bytes over a descriptor, in real time.
std::unique_ptr<Link> make_stream_link(Fd fd, std::string name);

}  // namespace symrig::board
