// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <span>
#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// An option that has no effect together with other options.
struct Idle {
  const char* option;  ///< "--tolerance"
  bool idle;           ///< true: the option has no effect
  std::string why;     ///< "with --algorithm brute: each pixel is measured"
};

/// Refuses an option without effect, because the user expects one.
/// fails: bad_argument (names the first given option that is idle).
Result<void> check_effects(const CLI::App& command, std::span<const Idle> options);

}  // namespace symrig::apps
