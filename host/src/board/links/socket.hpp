// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"

#include <cstdint>
#include <string>

namespace symrig::board {

/// A non-blocking connection to a listening local socket. fails: device_lost, bad_argument (path too long).
Result<Fd> connect_unix(const std::string& path);

/// A non-blocking connection to a TCP port, with Nagle's delay off. Tries every address of the host, each for
/// at most `patience`. fails: device_lost (no such host, refused, no answer).
Result<Fd> connect_tcp(const std::string& host, std::uint16_t port, Nanoseconds patience);

}  // namespace symrig::board
