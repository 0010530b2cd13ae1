// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/text.hpp"
#include "symrig/rig/exec_probe.hpp"
#include "symrig/rig/internal/received_photograph.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <vector>

#include <fmt/format.h>

namespace symrig::rig {

namespace {

constexpr std::array<std::string_view, 8> kKeys{"version",  "cells", "camera",   "views",
                                                "channels", "name",  "patience", "mirror"};
constexpr std::int64_t kLongestPatience = 86'400;  // seconds

Error wrong(std::string what) {
  return {ErrorCode::protocol, "answers " + std::move(what),
          "answer one line, such as 'version=1 cells=64x64 channels=1'"};
}

/// A whole number of digits only. One that does not fit becomes the largest.
std::optional<std::int64_t> number(std::string_view text) {
  if (text.empty() || text.find_first_not_of("0123456789") != std::string_view::npos) return std::nullopt;
  std::int64_t value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failed == std::errc::result_out_of_range ? INT64_MAX : value;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find(' '), line.size());
    if (end > 0) words.push_back(line.substr(0, end));
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return words;
}

/// ROWSxCOLUMNS, both from 1. One that does not fit becomes the largest.
Result<Grid> parse_pair(std::string_view key, std::string_view text) {
  const std::size_t cross = text.find('x');
  const auto rows = number(text.substr(0, cross));
  const auto cols = cross == std::string_view::npos ? std::nullopt : number(text.substr(cross + 1));
  if (!rows || !cols || *rows == 0 || *cols == 0)
    return wrong(fmt::format("{}={}, which is not ROWSxCOLUMNS", key, text));
  return Grid{static_cast<int>(std::min<std::int64_t>(*rows, INT32_MAX)),
              static_cast<int>(std::min<std::int64_t>(*cols, INT32_MAX))};
}

Result<Grid> parse_grid(std::string_view key, std::string_view text) {
  SYMRIG_TRY(const Grid grid, parse_pair(key, text));
  if (grid.valid()) return grid;
  return Error{ErrorCode::limit, fmt::format("answers {}={}, but a grid has at most 2^30 places", key, text),
               "use fewer"};
}

Result<std::int64_t> in_range(std::string_view key, std::string_view text, std::int64_t largest) {
  const auto value = number(text);
  if (!value || *value < 1) return wrong(fmt::format("{}={}, which is not a whole number from 1", key, text));
  if (*value <= largest) return *value;
  return Error{ErrorCode::limit, fmt::format("answers {}={}, but at most {} is allowed", key, text, largest),
               fmt::format("give a number from 1 to {}", largest)};
}

Result<Mirrored> parse_mirror(std::string_view text) {
  if (text == "none") return Mirrored{};
  if (text == "rows") return Mirrored{.rows = true};
  if (text == "columns") return Mirrored{.columns = true};
  if (text == "both") return Mirrored{.rows = true, .columns = true};
  return wrong(fmt::format("mirror={}, which is not none, rows, columns or both", text));
}

Result<void> take(ExecShape& shape, std::string_view key, std::string_view value) {
  if (key == "version" && value != "1")
    return wrong(fmt::format("version={}, but this symrig speaks version 1", value));
  if (key == "cells") {
    SYMRIG_TRY(shape.cells, parse_grid(key, value));
  } else if (key == "camera") {
    SYMRIG_TRY(shape.camera, parse_grid(key, value));
  } else if (key == "views") {
    SYMRIG_TRY(const Grid views, parse_pair(key, value));
    shape.views = {views.rows, views.cols};
  } else if (key == "channels") {
    SYMRIG_TRY(const std::int64_t channels, in_range(key, value, kExecChannels));
    shape.channels = static_cast<int>(channels);
  } else if (key == "name") {
    shape.name = value;
  } else if (key == "patience") {
    SYMRIG_TRY(const std::int64_t patience, in_range(key, value, kLongestPatience));
    shape.patience = std::chrono::seconds(patience);
  } else if (key == "mirror") {
    SYMRIG_TRY(shape.mirrored, parse_mirror(value));
  }
  return {};
}

Result<void> check_complete(const ExecShape& shape) {
  if (shape.cells == Grid{}) return wrong("no cells=ROWSxCOLUMNS");
  if (shape.channels == 0) return wrong("no channels=N");
  if (!shape.views.fits(shape.cells))
    return wrong(fmt::format("views={}, more than cells={} has places", to_string(shape.views),
                             to_string(shape.cells)));
  const std::int64_t bytes = 4 * shape.cells.size() + shape.photograph_bytes();
  if (bytes <= kExecLargest) return {};
  return Error{ErrorCode::limit,
               fmt::format("needs {} bytes for a pattern and its photograph, but at most {} are allowed",
                           bytes, kExecLargest),
               "use a smaller grid or fewer channels"};
}

}  // namespace

Result<ExecShape> parse_exec_answer(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  if (!line.starts_with(kAnswerBegin))
    return wrong(fmt::format("'{}' to the greeting", printable_line(line)));
  if (line != printable_line(line)) return wrong("with control characters: " + printable_line(line));
  ExecShape shape;
  std::vector<std::string_view> seen;
  for (const std::string_view word : words_of(line)) {
    const std::size_t equals = word.find('=');
    const std::string_view key = word.substr(0, equals);
    if (equals == std::string_view::npos || equals + 1 == word.size())
      return wrong(fmt::format("'{}', which is not key=value", word));
    if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end())
      return Error{ErrorCode::protocol, fmt::format("answers the unknown key '{}'", key),
                   nearest_hint(key, kKeys)};
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) return wrong(fmt::format("{} twice", key));
    seen.push_back(key);
    SYMRIG_CHECK(take(shape, key, word.substr(equals + 1)));
  }
  if (shape.camera == Grid{}) shape.camera = shape.cells;
  SYMRIG_CHECK(check_complete(shape));
  return shape;
}

std::optional<PhotographHeader> parse_photograph_header(std::string_view line) {
  if (!line.starts_with(kHeaderBegin)) return std::nullopt;
  line.remove_prefix(kHeaderBegin.size());
  const std::size_t blank = line.find(' ');
  if (blank == std::string_view::npos) return std::nullopt;
  const auto photograph = number(line.substr(0, blank));
  const auto bytes = number(line.substr(blank + 1));
  if (!photograph || !bytes) return std::nullopt;
  return PhotographHeader{*photograph, *bytes};
}

namespace {

std::string place(const Image<float>& image, std::size_t at) {
  const std::int64_t size = image.grid().size(), index = static_cast<std::int64_t>(at);
  const std::int64_t raster = index % size;
  return fmt::format("at row {}, column {}, channel {}", raster / image.grid().cols,
                     raster % image.grid().cols, index / size);
}

template <class T>
void reverse(Image<T>& image, Mirrored mirrored) {
  const auto columns = static_cast<std::size_t>(image.grid().cols);
  for (int channel = 0; channel < image.channels(); ++channel) {
    const std::span<T> plane = image.plane(channel);
    // All pixels backwards exchange the rows and the columns.
    if (mirrored.rows) std::ranges::reverse(plane);
    if (mirrored.rows != mirrored.columns)
      for (std::size_t row = 0; row < plane.size(); row += columns)
        std::ranges::reverse(plane.subspan(row, columns));
  }
}

}  // namespace

void set_right(Radiance& photograph, Mirrored mirrored) {
  if (!mirrored.rows && !mirrored.columns) return;
  reverse(photograph.mean, mirrored);
  reverse(photograph.variance, mirrored);
  reverse(photograph.valid, mirrored);
}

std::optional<std::string> settle(Radiance& photograph) {
  const auto mean = photograph.mean.values(), variance = photograph.variance.values();
  const auto valid = photograph.valid.values();
  for (std::size_t i = 0; i < mean.size(); ++i) {
    if (valid[i] > 1) return fmt::format("valid {}, not 0 or 1, {}", valid[i], place(photograph.mean, i));
    if (valid[i] == 0) mean[i] = variance[i] = 0;
    if (!std::isfinite(mean[i])) return fmt::format("the mean {} {}", mean[i], place(photograph.mean, i));
    if (!std::isfinite(variance[i]) || variance[i] < 0)
      return fmt::format("the variance {} {}", variance[i], place(photograph.mean, i));
  }
  return std::nullopt;
}

}  // namespace symrig::rig
