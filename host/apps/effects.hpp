// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <span>
#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// An option that changes nothing beside others.
struct Idle {
  const char* option;  ///< "--tolerance"
  bool idle;           ///< it would change nothing
  std::string why;     ///< "with --algorithm brute: each pixel is measured"
};

/// Whoever gives an option expects something of it.  fails: bad_argument (the first that was given and is
/// idle).
Result<void> check_effects(const CLI::App& command, std::span<const Idle> options);

}  // namespace symrig::apps
