// SPDX-License-Identifier: Apache-2.0
#include "hdr/toml_keys.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/internal/json_reader.hpp"
#include "symrig/hdr/response.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr double kLevelSigmas = 5;

Error bad_levels(ErrorCode code, std::string what, std::string hint) {
  return {code, std::move(what), std::move(hint)};
}

/// One entry for each level, sorted. Several photographs of a level are averaged with weights 1 / variance.
Result<std::vector<FieldLight>> gathered(std::span<const FieldLight> levels, int largest) {
  std::vector<FieldLight> sorted(levels.begin(), levels.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const FieldLight& a, const FieldLight& b) { return a.level < b.level; });
  std::vector<FieldLight> each;
  for (const FieldLight& one : sorted) {
    if (one.level < 0 || one.level > largest || !std::isfinite(one.light) || !(one.variance >= 0))
      return bad_levels(
          ErrorCode::bad_argument,
          fmt::format("level {} of {} with light {} is not valid", one.level, largest, one.light),
          fmt::format("give levels from 0 to {} and finite light", largest));
    const double variance = std::max(one.variance, 1e-30);
    if (each.empty() || each.back().level != one.level) {
      each.push_back({one.level, one.light, variance});
      continue;
    }
    FieldLight& same = each.back();
    const double weight = 1 / same.variance + 1 / variance;
    same.light = (same.light / same.variance + one.light / variance) / weight;
    same.variance = 1 / weight;
  }
  if (each.size() < 5 || each.front().level != 0 || each.back().level != largest)
    return bad_levels(ErrorCode::bad_argument,
                      fmt::format("{} levels are too few for a response", each.size()),
                      "photograph at least black, white and three levels between");
  return each;
}

Result<void> check_order(const std::vector<FieldLight>& each) {
  if (!(each.back().light - each.front().light >
        kLevelSigmas * std::sqrt(each.back().variance + each.front().variance)))
    return bad_levels(ErrorCode::bad_value, "white is not brighter than black",
                      "check the projector and the order of the levels");
  for (std::size_t k = 1; k < each.size(); ++k) {
    const double fall = each[k - 1].light - each[k].light;
    const double allowed = kLevelSigmas * std::sqrt(each[k].variance + each[k - 1].variance) +
                           0.002 * (each.back().light - each.front().light);
    if (fall > allowed)
      return bad_levels(ErrorCode::bad_value,
                        fmt::format("level {} is darker than level {}", each[k].level, each[k - 1].level),
                        "let the lamp warm up and measure again");
  }
  return {};
}

}  // namespace

Result<ProjectorResponse> ProjectorResponse::fit(std::span<const FieldLight> levels, int largest) {
  SYMRIG_TRY(const std::vector<FieldLight> each, gathered(levels, largest));
  SYMRIG_CHECK(check_order(each));
  std::vector<double> light, weights;
  for (const FieldLight& one : each) {
    light.push_back(one.light);
    weights.push_back(1 / one.variance);
  }
  const double scale = *std::max_element(weights.begin(), weights.end());
  for (double& w : weights) w /= scale;
  const std::vector<double> rising = isotonic(light, weights);
  const double low = rising.front(), span = rising.back() - rising.front();
  ProjectorResponse response;
  response.curve_.samples = std::ssize(levels);
  for (std::size_t k = 0; k + 1 < each.size(); ++k)
    for (int level = each[k].level; level < each[k + 1].level; ++level) {
      const double at = static_cast<double>(level - each[k].level) / (each[k + 1].level - each[k].level);
      response.curve_.light.push_back((rising[k] + at * (rising[k + 1] - rising[k]) - low) / span);
    }
  response.curve_.light.push_back(1);
  return response;
}

double ProjectorResponse::resolution() const {
  double largest = 0;
  for (std::size_t k = 1; k < curve_.light.size(); ++k)
    largest = std::max(largest, curve_.light[k] - curve_.light[k - 1]);
  return largest / 2;
}

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLevels = 256;

Error bad(const fs::path& path, std::uint32_t line, std::string_view what) {
  return {ErrorCode::bad_format, fmt::format("{}:{}: {}", path.string(), line, what),
          "write it with symrig calibrate --rig RIG --levels FILE"};
}

}  // namespace

Result<void> save_projector_response(const fs::path& path, const ProjectorResponse& response) {
  std::string text = fmt::format(
      "# How a projector answers its levels: docs/levels.md\n[levels]\nphotographs = {}\n"
      "light = [  # of each level, black taken off, as a share of white's\n",
      response.curve().samples);
  for (std::size_t level = 0; level < response.curve().light.size(); ++level)
    text += fmt::format("{}{:.9g},", level % 8 == 0 ? (level == 0 ? "  " : "\n  ") : " ",
                        response.curve().light[level]);
  return write_file_atomically(path, text + "\n]\n");
}

Result<std::vector<double>> load_projector_light(const fs::path& path) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 20;
  SYMRIG_TRY(const std::vector<std::byte> bytes, read_file(path, kMost));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  SYMRIG_CHECK(check_toml_nesting(text, path.string()));
  const toml::parse_result parsed = toml::parse(text);
  if (!parsed) return bad(path, parsed.error().source().begin.line, parsed.error().description());
  constexpr std::array<std::string_view, 1> kTables{"levels"};
  constexpr std::array<std::string_view, 2> kKeys{"photographs", "light"};
  SYMRIG_CHECK(check_keys(path, parsed.table(), "", kTables));
  if (const toml::table* const table = parsed.table()["levels"].as_table())
    SYMRIG_CHECK(check_keys(path, *table, "levels.", kKeys));
  const toml::array* const list = parsed.table()["levels"]["light"].as_array();
  if (list == nullptr) return bad(path, 1, "it has no table [levels] with light");
  std::vector<double> light;
  for (const toml::node& item : *list) {
    const std::optional<double> value = item.value<double>();
    const bool legal = value && (light.empty() ? *value == 0 : *value >= light.back() && *value <= 1);
    if (!legal)
      return bad(path, item.source().begin.line,
                 fmt::format("levels.light falls, or is outside of 0 to 1, at level {}", light.size()));
    light.push_back(*value);
  }
  if (light.size() == kLevels && light.back() == 1) return light;
  return bad(path, list->source().begin.line,
             light.size() == kLevels ? std::string("levels.light does not end at 1")
                                     : fmt::format("levels.light has {} levels, not 256", light.size()));
}

}  // namespace symrig
