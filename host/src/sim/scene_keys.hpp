// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/sim/scene.hpp"

#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace symrig::sim {

/// One key of `sim:NAME?key=value`. Its default is the value of its member in SceneUri().
struct KeyRow {
  std::string_view name;
  std::string_view meaning;
  std::string values;  ///< the values that it takes
  std::function<Result<void>(std::string_view text, SceneUri& uri)> read;
  std::function<std::string(const SceneUri& uri)> print;
};

/// All keys. SceneUri::to_string() prints them in this order.
std::span<const KeyRow> key_table();

}  // namespace symrig::sim
