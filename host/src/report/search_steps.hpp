// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/capture_facts.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::report {

/// A number of the file with its JSON pointer ("/patterns", "/a/1 - /a/0", "/a / /b").
struct Sourced {
  double value = 0;
  std::string from;
};

/// One stage of the capture, and the state of the tensor at its end.
struct Stage {
  std::string name;
  std::optional<int> level = {};            ///< the level of the hierarchy, if the stage is a level
  std::optional<Sourced> patterns = {};     ///< of this stage
  std::optional<Sourced> by_then = {};      ///< photographs up to the end of the stage
  std::optional<Sourced> rig_seconds = {};  ///< up to the end of the stage
  bool seconds_scaled = false;              ///< not in the file: computed in proportion to the photographs
  std::optional<Sourced> error = {};        ///< estimated frobenius error if the capture had ended here
  std::optional<Sourced> uncertainty = {};  ///< of the error, as in the file (±)
};

/// In the order of the capture; the last one is the finished tensor. Read leniently: values that are missing
/// or invalid (negative, above 1e15) are ignored. At most kMostStages.
std::vector<Stage> stages_of(const CaptureFacts& facts);
inline constexpr std::size_t kMostStages = 100;

/// The uncertainty of an estimated error. path: "/frobenius", as below /estimated_error.
std::optional<Sourced> uncertainty_at(const CaptureFacts& facts, const std::string& path);

/// A valid number ≥ 0 of the file.
std::optional<Sourced> count_at(const CaptureFacts& facts, const std::string& path);

}  // namespace symrig::report
