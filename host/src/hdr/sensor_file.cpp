// SPDX-License-Identifier: Apache-2.0
#include "hdr/toml_keys.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/internal/json_reader.hpp"
#include "symrig/hdr/sensor.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;

/// The legal range of a value.
struct LegalRange {
  double low, high;
};

/// Reads keys of one table. Reports the first error.
class Reader {
 public:
  Reader(const fs::path& path, const toml::table& table) : path_(path), table_(table) {}

  double number(std::string_view key, LegalRange range, std::optional<double> otherwise = {}) {
    const toml::node* node = table_.get(key);
    if (node == nullptr && otherwise) return *otherwise;
    const auto value = node != nullptr ? node->value<double>() : std::nullopt;
    if (value && *value >= range.low && *value <= range.high) return *value;
    fail(node, fmt::format("sensor.{} is {}", key, node == nullptr ? "missing" : "not a legal number"),
         fmt::format("give a number from {} to {}", range.low, range.high));
    return range.low;
  }

  Image<std::uint8_t> defects() {
    const toml::array* grid = table_["grid"].as_array();
    const toml::array* list = table_["defects"].as_array();
    if (grid == nullptr && list == nullptr) return {};
    const auto rows = grid != nullptr && grid->size() == 2 ? grid->get(0)->value<int>() : std::nullopt;
    const auto cols = grid != nullptr && grid->size() == 2 ? grid->get(1)->value<int>() : std::nullopt;
    const Grid size{rows.value_or(0), cols.value_or(0)};
    if (!size.valid() || list == nullptr) {
      fail(grid, "sensor.defects needs sensor.grid = [rows, columns] and a list", "write both, or neither");
      return {};
    }
    Image<std::uint8_t> mask(size);
    for (const toml::node& item : *list) {
      const toml::array* place = item.as_array();
      const bool pair = place != nullptr && place->size() == 2;
      const int row = pair ? place->get(0)->value<int>().value_or(-1) : -1;
      const int col = pair ? place->get(1)->value<int>().value_or(-1) : -1;
      if (row < 0 || col < 0 || row >= size.rows || col >= size.cols) {
        fail(&item, "a defect is not on the sensor",
             fmt::format("give [row, column] within {}", to_string(size)));
        return {};
      }
      mask.at(row, col) = 1;
    }
    return mask;
  }

  const std::optional<Error>& error() const { return error_; }

 private:
  void fail(const toml::node* node, std::string what, std::string hint) {
    if (error_) return;
    const toml::node& at = node != nullptr ? *node : static_cast<const toml::node&>(table_);
    error_ = Error{ErrorCode::bad_format,
                   fmt::format("{}:{}: {}", path_.string(), at.source().begin.line, what), std::move(hint)};
  }

  const fs::path& path_;
  const toml::table& table_;
  std::optional<Error> error_;
};

std::string defects_text(const Image<std::uint8_t>& defects) {
  if (defects.empty()) return "";
  std::string text = fmt::format("grid = [{}, {}]\ndefects = [", defects.grid().rows, defects.grid().cols);
  for (int row = 0; row < defects.grid().rows; ++row)
    for (int col = 0; col < defects.grid().cols; ++col)
      if (defects.at(row, col) != 0) text += fmt::format("\n  [{}, {}],", row, col);
  return text + (text.ends_with(",") ? "\n]\n" : "]\n");
}

}  // namespace

Result<void> save_sensor(const fs::path& path, const Sensor& sensor) {
  const NoiseModel& noise = sensor.noise;
  std::string text = "# A camera's sensor as it was measured: docs/sensor.md\n[sensor]\n";
  text += fmt::format("bits = {}\n", noise.bits());
  text += fmt::format("pedestal = {}  # DN\n", noise.pedestal());
  text += fmt::format("gain = {}  # DN/e-\ngain_sigma = {}  # relative\n", noise.gain(), sensor.gain_sigma);
  text += fmt::format("read_noise = {}  # e- rms\nread_noise_sigma = {}  # relative\n", noise.read_noise(),
                      sensor.read_noise_sigma);
  text += fmt::format("clipping = {}  # DN: {}\n", noise.clipping_code(),
                      sensor.clipping_seen ? "the code that light piles up at"
                                           : "the largest code; assumed, as no frame saturated");
  text += fmt::format("prnu = {}  # rms, relative, 0: not measured\ndsnu = {}  # rms, DN\n", sensor.prnu,
                      sensor.dsnu);
  text += fmt::format("nonlinearity = {}  # share of full scale, 0: not tested\n", sensor.nonlinearity);
  return write_file_atomically(path, text + defects_text(sensor.defects));
}

Result<Sensor> load_sensor(const fs::path& path) {
  constexpr std::uint64_t kMost = std::uint64_t{64} << 20;
  SYMRIG_TRY(const std::vector<std::byte> bytes, read_file(path, kMost));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  SYMRIG_CHECK(check_toml_nesting(text, path.string()));
  const toml::parse_result parsed = toml::parse(text);
  if (!parsed)
    return Error{ErrorCode::bad_format,
                 fmt::format("{}:{}: {}", path.string(), parsed.error().source().begin.line,
                             parsed.error().description()),
                 "write it as docs/sensor.md shows"};
  constexpr std::array<std::string_view, 1> kTables{"sensor"};
  constexpr std::array<std::string_view, 12> kKeys{"bits",       "pedestal",         "gain",     "gain_sigma",
                                                   "read_noise", "read_noise_sigma", "clipping", "prnu",
                                                   "dsnu",       "nonlinearity",     "grid",     "defects"};
  SYMRIG_CHECK(check_keys(path, parsed.table(), "", kTables));
  const toml::table* table = parsed.table()["sensor"].as_table();
  if (table == nullptr)
    return Error{ErrorCode::bad_format, fmt::format("{}: it has no table [sensor]", path.string()),
                 "write it as docs/sensor.md shows"};
  SYMRIG_CHECK(check_keys(path, *table, "sensor.", kKeys));
  Reader reader(path, *table);
  const int bits = static_cast<int>(reader.number("bits", {1, 16}));
  const double largest = std::ldexp(1.0, bits) - 1;
  const double pedestal = reader.number("pedestal", {0, largest});
  const double gain = reader.number("gain", {1e-6, 1e6});
  const double read = reader.number("read_noise", {0, 1e6});
  Sensor sensor;
  sensor.noise = NoiseModel::from_variance_line({gain * gain * read * read + 1.0 / 12, gain, bits, pedestal});
  const int clipping = static_cast<int>(reader.number("clipping", {1, largest}, largest));
  if (clipping < sensor.noise.max_code()) sensor.noise = sensor.noise.clipped_at(clipping);
  sensor.gain_sigma = reader.number("gain_sigma", {0, 10}, 0);
  sensor.read_noise_sigma = reader.number("read_noise_sigma", {0, 10}, 0);
  sensor.prnu = reader.number("prnu", {0, 10}, 0);
  sensor.dsnu = reader.number("dsnu", {0, largest}, 0);
  sensor.nonlinearity = reader.number("nonlinearity", {0, 10}, 0);
  sensor.defects = reader.defects();
  if (reader.error()) return *reader.error();
  if (sensor.noise.valid()) return sensor;
  return Error{ErrorCode::bad_format,
               fmt::format("{}: the sensor is not valid: {}", path.string(), sensor.noise.to_string()),
               "measure it again"};
}

}  // namespace symrig
