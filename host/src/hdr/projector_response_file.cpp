// SPDX-License-Identifier: Apache-2.0
#include "hdr/toml_keys.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/internal/json_reader.hpp"
#include "symrig/hdr/projector_response.hpp"

#include <array>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace symrig {
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
