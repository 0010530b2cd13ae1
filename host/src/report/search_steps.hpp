// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/capture_facts.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::report {

/// A number of the file with the JSON pointer that leads to it ("/patterns", "/a/1 - /a/0", "/a / /b").
struct Sourced {
  double value = 0;
  std::string from;
};

/// What the capture did one after the other, and how the tensor stood then.
struct Stage {
  std::string name;
  std::optional<int> level = {};            ///< of the hierarchy, where the stage is one
  std::optional<Sourced> patterns = {};     ///< of this stage
  std::optional<Sourced> by_then = {};      ///< photographs up to its end
  std::optional<Sourced> rig_seconds = {};  ///< up to its end
  bool seconds_scaled = false;              ///< not told by the file: in proportion to the photographs
  std::optional<Sourced> error = {};        ///< estimated frobenius error if the capture had ended here
  std::optional<Sourced> uncertainty = {};  ///< of it, as the file tells it (±)
};

/// In the order of the capture; the last one is the finished tensor. Read leniently: what is missing, or no
/// number of its kind (negative, beyond 1e15), is left out. At most kMostStages.
std::vector<Stage> stages_of(const CaptureFacts& facts);
inline constexpr std::size_t kMostStages = 100;

/// How sure the capture is of an error that it estimated. path: "/frobenius", as below /estimated_error.
std::optional<Sourced> uncertainty_at(const CaptureFacts& facts, const std::string& path);

/// A number ≥ 0 of the file that can be one of its kind.
std::optional<Sourced> count_at(const CaptureFacts& facts, const std::string& path);

}  // namespace symrig::report
