// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "fd.hpp"
#include "symrig/device/link.hpp"

#include <memory>
#include <string>

namespace symrig::device {

/// Raw wire bytes over a descriptor, on the wall clock.
std::unique_ptr<Link> make_stream_link(Fd fd, std::string name);

}  // namespace symrig::device
