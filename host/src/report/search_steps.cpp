// SPDX-License-Identifier: Apache-2.0
#include "report/sections.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::report {
namespace {

std::size_t entries(const CaptureFacts& facts, const char* path) {
  const nlohmann::json* found = facts.find(path);
  return found != nullptr && found->is_array() ? std::min(found->size(), kMostStages - 2) : 0;
}

std::optional<Sourced> sourced_difference(const std::optional<Sourced>& after,
                                          const std::optional<Sourced>& before) {
  if (!after || !before || after->value < before->value) return std::nullopt;
  return Sourced{after->value - before->value, after->from + " - " + before->from};
}

/// The uncertainty of the error after level k.
std::optional<Sourced> uncertainty_of_level(const CaptureFacts& facts, std::size_t k) {
  return count_at(facts, fmt::format("/error_per_level_uncertainty/{}", k));
}

/// The stage before the levels, which every file has.
Stage before_the_levels(const CaptureFacts& facts) {
  Stage stage{.name = "before the levels"};
  stage.patterns = stage.by_then = count_at(facts, "/patterns_per_level/0");
  return stage;
}

/// The stages of files that list each step of the search.
std::vector<Stage> stages_of_steps(const CaptureFacts& facts) {
  std::vector<Stage> stages{before_the_levels(facts)};
  std::vector<int> seen;
  std::size_t errors = 0;
  for (std::size_t k = 0; k < entries(facts, "/steps"); ++k) {
    const std::string step = fmt::format("/steps/{}", k);
    const auto level = count_at(facts, step + "/level");
    if (!level || level->value > 64) continue;
    Stage stage;
    stage.level = static_cast<int>(level->value);
    const bool again = std::find(seen.begin(), seen.end(), *stage.level) != seen.end();
    seen.push_back(*stage.level);
    stage.name = fmt::format("level {}{}", *stage.level, again ? " again" : "");
    stage.by_then = count_at(facts, step + "/patterns");
    stage.patterns = sourced_difference(stage.by_then, stages.back().by_then);
    stage.rig_seconds = count_at(facts, step + "/rig_seconds");
    stage.error = count_at(facts, step + "/error");
    if (stage.error) stage.uncertainty = uncertainty_of_level(facts, errors++);
    stages.push_back(std::move(stage));
  }
  return stages;
}

/// The stages of older files: photographs of each level, and the error after each. The first entry of
/// patterns_per_level is the number of photographs before the levels, so the errors are shifted by one.
std::vector<Stage> stages_of_levels(const CaptureFacts& facts) {
  std::vector<Stage> stages{before_the_levels(facts)};
  const std::size_t levels = entries(facts, "/patterns_per_level");
  const std::size_t errors = entries(facts, "/error_per_level");
  if (errors == 0 || errors >= levels) return stages;  // leaves were split later, so the levels are not known
  double sum = stages[0].by_then ? stages[0].by_then->value : 0;
  for (std::size_t k = 0; k < errors; ++k) {
    Stage stage{.name = fmt::format("level {}", k), .level = static_cast<int>(k)};
    stage.patterns = count_at(facts, fmt::format("/patterns_per_level/{}", k + 1));
    sum += stage.patterns ? stage.patterns->value : 0;
    stage.by_then = Sourced{sum, fmt::format("sum /patterns_per_level 0..{}", k + 1)};
    stage.error = count_at(facts, fmt::format("/error_per_level/{}", k));
    if (stage.error) stage.uncertainty = uncertainty_of_level(facts, k);
    stages.push_back(std::move(stage));
  }
  return stages;
}

/// The stages of dual, brute and other commands: photographs only.
std::vector<Stage> stages_of_rounds(const CaptureFacts& facts) {
  std::vector<Stage> stages;
  double sum = 0;
  for (std::size_t k = 0; k < entries(facts, "/patterns_per_level"); ++k) {
    Stage stage{.name = fmt::format("round {}", k + 1)};
    stage.patterns = count_at(facts, fmt::format("/patterns_per_level/{}", k));
    sum += stage.patterns ? stage.patterns->value : 0;
    stage.by_then = Sourced{sum, fmt::format("sum /patterns_per_level 0..{}", k)};
    stages.push_back(std::move(stage));
  }
  return stages;
}

/// The finished tensor.
Stage finished(const CaptureFacts& facts, const std::vector<Stage>& before) {
  Stage stage{.name = "finished"};
  stage.by_then = count_at(facts, "/patterns");
  if (!before.empty()) stage.patterns = sourced_difference(stage.by_then, before.back().by_then);
  stage.rig_seconds = count_at(facts, "/rig_seconds");
  stage.error = count_at(facts, "/estimated_error/frobenius");
  if (stage.error) stage.uncertainty = uncertainty_at(facts, "", "/frobenius");
  return stage;
}

/// If the file has no end times of the stages, computes them in proportion to the photographs.
void scale_seconds(std::vector<Stage>& stages) {
  const Stage last = stages.back();
  if (!last.rig_seconds || !last.by_then || !(last.by_then->value > 0)) return;
  for (Stage& stage : stages) {
    if (stage.rig_seconds || !stage.by_then) continue;
    stage.rig_seconds = Sourced{last.rig_seconds->value * stage.by_then->value / last.by_then->value, ""};
    stage.seconds_scaled = true;
  }
}

}  // namespace

std::optional<Sourced> count_at(const CaptureFacts& facts, const std::string& path) {
  const auto value = facts.number(path.c_str());
  if (!value || !(*value >= 0 && *value < 1e15)) return std::nullopt;
  return Sourced{*value, path};
}

std::optional<Sourced> uncertainty_at(const CaptureFacts& facts, const std::string& at,
                                      const std::string& path) {
  return count_at(facts, at + "/estimated_error_uncertainty" + path);
}

std::vector<Stage> stages_of(const CaptureFacts& facts) {
  std::vector<Stage> stages = entries(facts, "/steps") > 0             ? stages_of_steps(facts)
                              : entries(facts, "/error_per_level") > 0 ? stages_of_levels(facts)
                                                                       : stages_of_rounds(facts);
  stages.push_back(finished(facts, stages));
  scale_seconds(stages);
  return stages;
}

}  // namespace symrig::report
