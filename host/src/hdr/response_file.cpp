// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/response_file.hpp"

#include "hdr/toml_keys.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/internal/json_reader.hpp"

#include <array>
#include <bit>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;

Error bad_table(const fs::path& path, std::uint32_t line, std::string_view what) {
  return {ErrorCode::bad_format, fmt::format("{}:{}: {}", path.string(), line, what),
          "write it with symrig calibrate --sensor DIR --response FILE"};
}

/// Reads light that must rise strictly from 0 to 1.
Result<std::vector<double>> light_of(const fs::path& path, const toml::array& list) {
  std::vector<double> light;
  for (const toml::node& item : list) {
    const std::optional<double> value = item.value<double>();
    const bool rises = value && (light.empty() ? *value == 0 : *value > light.back() && *value <= 1);
    if (!rises)
      return bad_table(path, item.source().begin.line,
                       fmt::format("response.light does not rise from 0 to 1 at code {}", light.size()));
    light.push_back(*value);
  }
  const bool codes = light.size() >= 2 && light.size() <= 65'536 && std::has_single_bit(light.size());
  if (codes && light.back() == 1) return light;
  return bad_table(path, list.source().begin.line,
                   codes ? std::string("response.light does not end at 1")
                         : fmt::format("response.light has {} codes, which no camera has", light.size()));
}

}  // namespace

Result<void> save_response(const fs::path& path, const ResponseCurve& curve) {
  std::string text = fmt::format(
      "# How a camera answers light: docs/sensor.md\n[response]\nsamples = {}\n"
      "light = [  # of each code, as a share of the largest code's\n",
      curve.samples);
  for (std::size_t code = 0; code < curve.light.size(); ++code)
    text += fmt::format("{}{},", code % 8 == 0 ? (code == 0 ? "  " : "\n  ") : " ", curve.light[code]);
  return write_file_atomically(path, text + "\n]\n");
}

Result<ResponseCurve> load_response(const fs::path& path) {
  constexpr std::uint64_t kMost = std::uint64_t{8} << 20;
  SYMRIG_TRY(const std::vector<std::byte> bytes, read_file(path, kMost));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  SYMRIG_CHECK(check_toml_nesting(text, path.string()));
  const toml::parse_result parsed = toml::parse(text);
  if (!parsed) return bad_table(path, parsed.error().source().begin.line, parsed.error().description());
  constexpr std::array<std::string_view, 1> kTables{"response"};
  constexpr std::array<std::string_view, 2> kKeys{"samples", "light"};
  SYMRIG_CHECK(check_keys(path, parsed.table(), "", kTables));
  if (const toml::table* const table = parsed.table()["response"].as_table())
    SYMRIG_CHECK(check_keys(path, *table, "response.", kKeys));
  const toml::array* const list = parsed.table()["response"]["light"].as_array();
  if (list == nullptr) return bad_table(path, 1, "it has no table [response] with light");
  ResponseCurve curve;
  SYMRIG_TRY(curve.light, light_of(path, *list));
  curve.samples = parsed.table()["response"]["samples"].value_or(std::int64_t{0});
  return curve;
}

}  // namespace symrig
