// SPDX-License-Identifier: Apache-2.0
// The table of scene keys. A new key is a member of SceneUri, and a line of the table.

#include "sim/scenes.hpp"
#include "sim/view.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/base/text.hpp"
#include "symrig/sim/dense_rig.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::sim {

namespace {

/// One key of `sim:NAME?key=value`. Its default is the value of its member in SceneUri().
struct KeyRow {
  std::string_view name;
  std::string_view meaning;
  std::string values;  ///< the values that it takes
  std::function<Result<void>(std::string_view text, SceneUri& uri)> read;
  std::function<std::string(const SceneUri& uri)> print;
};

Error bad_value(std::string_view key, std::string_view value, std::string_view values) {
  return {ErrorCode::bad_argument, fmt::format("the scene key {} cannot be '{}'", key, value),
          fmt::format("give {} as {}", key, values)};
}

Error too_large(std::string_view size) {
  return {ErrorCode::bad_argument, fmt::format("the scene key size cannot be '{}': it is too large", size),
          fmt::format("give {} pixels at most, such as 4096x4096", kLargestScene)};
}

template <class T>
std::optional<T> parse_number(std::string_view text) {
  T value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

template <class Number>
KeyRow number_key(std::string_view name, std::string_view meaning, Number SceneUri::*member, Number lowest,
                  Number highest) {
  const char* kind = std::is_integral_v<Number> ? "whole number" : "number";
  const std::string values = fmt::format("a {} from {} to {}", kind, lowest, highest);
  return {name, meaning, values,
          [=](std::string_view text, SceneUri& uri) -> Result<void> {
            const auto value = parse_number<Number>(text);
            if (!value || !(*value >= lowest && *value <= highest)) return bad_value(name, text, values);
            uri.*member = *value;
            return {};
          },
          [=](const SceneUri& uri) { return fmt::format("{}", uri.*member); }};
}

/// A word or number that stands for one value of a member.
template <class Value>
struct Word {
  std::string_view text;
  Value value;
};

/// A member that can be one of two words.
template <class Value>
KeyRow choice_key(std::string_view name, std::string_view meaning, Value SceneUri::*member, Word<Value> one,
                  Word<Value> other) {
  const std::string values = fmt::format("{} or {}", one.text, other.text);
  return {name, meaning, values,
          [=](std::string_view text, SceneUri& uri) -> Result<void> {
            if (text != one.text && text != other.text) return bad_value(name, text, values);
            uri.*member = text == one.text ? one.value : other.value;
            return {};
          },
          [=](const SceneUri& uri) { return std::string(uri.*member == one.value ? one.text : other.text); }};
}

/// The name of one of the rig profiles.
KeyRow profile_key(std::string_view name, std::string_view meaning, std::string SceneUri::*member) {
  std::vector<std::string_view> names;
  names.reserve(rig_profiles().size());
  for (const RigProfile& profile : rig_profiles()) names.push_back(profile.name);
  const std::string values = fmt::format("{}", fmt::join(names, ", "));
  return {name, meaning, values,
          [=](std::string_view text, SceneUri& uri) -> Result<void> {
            if (std::find(names.begin(), names.end(), text) == names.end())
              return bad_value(name, text, values);
            uri.*member = text;
            return {};
          },
          [=](const SceneUri& uri) { return uri.*member; }};
}

/// A number, or a word. The word is 0 in the member.
KeyRow number_or_word_key(std::string_view word, KeyRow key, int SceneUri::*member) {
  const std::string values = fmt::format("{}, or {}", word, key.values);
  return {key.name, key.meaning, values,
          [=](std::string_view text, SceneUri& uri) -> Result<void> {
            if (text != word) return key.read(text, uri) ? Result<void>() : bad_value(key.name, text, values);
            uri.*member = 0;
            return {};
          },
          [=](const SceneUri& uri) { return uri.*member == 0 ? std::string(word) : key.print(uri); }};
}

constexpr std::int64_t kLargestSide = 1'000'000'000;

/// 0: not a side length. A number that does not fit is treated as too large.
std::int64_t parse_side(std::string_view text) {
  const bool digits = !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  return digits ? parse_number<std::int64_t>(text).value_or(kLargestSide + 1) : 0;
}

/// True if a picture of this size can exist. Both sides are at most kLargestSide. make_scene() refuses
/// pictures that are too large for a scene.
bool fits(std::int64_t rows, std::int64_t cols) {
  return Grid{static_cast<int>(rows), static_cast<int>(cols)}.valid();
}

KeyRow size_key(std::string_view name, std::string_view meaning, Grid SceneUri::*member) {
  const std::string values = "ROWSxCOLUMNS, both at least 1, such as 128x96";
  return {name, meaning, values,
          [=](std::string_view text, SceneUri& uri) -> Result<void> {
            const std::size_t cross = text.find('x');
            const std::string_view after = cross == std::string_view::npos ? "" : text.substr(cross + 1);
            const std::int64_t rows = parse_side(text.substr(0, cross)), cols = parse_side(after);
            if (rows <= 0 || cols <= 0) return bad_value(name, text, values);
            if (std::max(rows, cols) > kLargestSide || !fits(rows, cols)) return too_large(text);
            uri.*member = {static_cast<int>(rows), static_cast<int>(cols)};
            return {};
          },
          [=](const SceneUri& uri) { return symrig::to_string(uri.*member); }};
}

/// A size, or a word for the empty grid.
KeyRow size_or_word_key(std::string_view word, KeyRow key, Grid SceneUri::*member) {
  const std::string values = fmt::format("{}, or {}", word, key.values);
  return {key.name, key.meaning, values,
          [=](std::string_view text, SceneUri& uri) -> Result<void> {
            if (text != word) return key.read(text, uri) ? Result<void>() : bad_value(key.name, text, values);
            uri.*member = {0, 0};
            return {};
          },
          [=](const SceneUri& uri) { return (uri.*member).rows == 0 ? std::string(word) : key.print(uri); }};
}

/// "FIRST,SECOND". parts: the two numbers of the member.
template <class Value>
KeyRow pair_key(std::string_view name, std::string_view meaning, Value SceneUri::*member,
                std::pair<double Value::*, double Value::*> parts, std::string_view letters, double lowest,
                double highest) {
  const std::string values = fmt::format("{}, two numbers from {} to {}", letters, lowest, highest);
  return {
      name, meaning, values,
      [=](std::string_view text, SceneUri& uri) -> Result<void> {
        const std::size_t comma = text.find(',');
        const std::string_view after = comma == std::string_view::npos ? "" : text.substr(comma + 1);
        const auto first = parse_number<double>(text.substr(0, comma)), second = parse_number<double>(after);
        const auto legal = [=](const std::optional<double>& v) { return v && *v >= lowest && *v <= highest; };
        if (!legal(first) || !legal(second)) return bad_value(name, text, values);
        (uri.*member).*parts.first = *first;
        (uri.*member).*parts.second = *second;
        return {};
      },
      [=](const SceneUri& uri) {
        return fmt::format("{},{}", (uri.*member).*parts.first, (uri.*member).*parts.second);
      }};
}

/// "SHARE@ROW,COLUMN", or 0 for none.
KeyRow ghost_key(std::string_view name, std::string_view meaning) {
  const std::string values =
      "SHARE@ROW,COLUMN, a share from 0 to 0.5 and two numbers from -1000 to 1000; 0: none";
  return {name, meaning, values,
          [=](std::string_view text, SceneUri& uri) -> Result<void> {
            const std::size_t at = text.find('@');
            const auto share = parse_number<double>(text.substr(0, at));
            if (!share || !(*share >= 0 && *share <= 0.5)) return bad_value(name, text, values);
            Ghost ghost{*share, {}};
            if (at != std::string_view::npos) {
              const std::string_view place = text.substr(at + 1);
              const std::size_t comma = place.find(',');
              const std::string_view after = comma == std::string_view::npos ? "" : place.substr(comma + 1);
              const auto row = parse_number<double>(place.substr(0, comma)),
                         col = parse_number<double>(after);
              if (!row || !col || !(std::max(std::abs(*row), std::abs(*col)) <= 1000))
                return bad_value(name, text, values);
              ghost.at = {*row, *col};
            } else if (*share != 0) {
              return bad_value(name, text, values);
            }
            uri.ghost = ghost;
            return {};
          },
          [](const SceneUri& uri) {
            const Ghost& g = uri.ghost;
            return g.share == 0 ? std::string("0") : fmt::format("{}@{},{}", g.share, g.at.row, g.at.col);
          }};
}

constexpr int kHighestSeed = 2'147'483'647;

/// All keys. SceneUri::to_string() prints them in this order.
std::span<const KeyRow> key_table() {
  using S = SceneUri;
  static const std::vector<KeyRow> all{
      size_key("size", "rows x columns of the grid", &S::size),
      number_key("seed", "textures and noise", &S::seed, 0, kHighestSeed),
      number_key("noise_seed", "other noise in the same scene", &S::noise_seed, 0, kHighestSeed),
      choice_key("channels", "colour channels", &S::channels, {"1", 1}, {"3", 3}),
      choice_key("noise", "noise of the camera", &S::camera_noise, {"off", false}, {"camera", true}),
      number_key("black", "black level of the projector as a share of white; 0 with noise=off", &S::black,
                 0.0, 0.1),
      number_key("psf", "blur [A, 1-2A, A] on both sides", &S::psf, 0.0, 0.25),
      number_key("misalign", "shift of the camera in pixels", &S::misalign, -8.0, 8.0),
      number_key("flare", "share of light in a camera flare", &S::flare, 0.0, 0.5),
      number_key("dead", "share of dead camera pixels", &S::dead, 0.0, 0.5),
      number_key("indirect", "factor on all light but the direct", &S::indirect, 0.0, 10.0),
      number_or_word_key(
          "auto",
          number_key("exposures", "frames of a photograph; auto: as many as it needs", &S::exposures, 1, 8),
          &S::exposures),
      number_key("ratio", "ratio between the exposures of a photograph", &S::ratio, 1.5, 64.0),
      number_key("drift", "change of the lamp over 1,000 photographs", &S::drift, -0.5, 0.5),
      number_key("gamma", "if not 1: 256 levels, light is (level / 255)^gamma", &S::gamma, 0.25, 4.0),
      number_key("light", "transmission of a grey filter before the camera", &S::light, 1e-3, 1.0),
      profile_key("profile", "timing and light of projector and camera", &S::profile),
      number_key("fine", "points of the scene along the side of a cell", &S::fine, 1, 16),
      size_or_word_key("cells",
                       size_key("camera", "pixels of the camera; cells: it shares the cells", &S::camera),
                       &S::camera),
      number_key("turn", "turn of the camera in degrees", &S::turn, -180.0, 180.0),
      number_key("zoom", "size of the cells' picture in the camera's; 1: it just fits", &S::zoom, 0.05, 20.0),
      pair_key("shift", "shift of the camera in cells", &S::shift, {&Offset::row, &Offset::col}, "ROW,COLUMN",
               -1000.0, 1000.0),
      number_key("distortion", "radial distortion at the corner of the cells, as a share", &S::distortion,
                 -0.2, 0.2),
      number_key("parallax", "shift in cells between the nearest and the farthest point", &S::parallax, -8.0,
                 8.0),
      pair_key("vignetting", "light lost at the corner, as shares", &S::vignetting,
               {&BothOptics::camera, &BothOptics::projector}, "CAMERA,PROJECTOR", 0.0, 0.9),
      pair_key("defocus", "blur of the optics in cells, rms", &S::defocus,
               {&BothOptics::camera, &BothOptics::projector}, "CAMERA,PROJECTOR", 0.0, 8.0),
      number_key("colour", "lateral colour in cells: red against blue at the corner", &S::colour, -2.0, 2.0),
      ghost_key("ghost", "second image of the camera: share of light, and how far away in cells"),
      number_key("moves", "shift of the camera in cells over 1,000 photographs", &S::moves, -100.0, 100.0),
  };
  return all;
}

}  // namespace

}  // namespace symrig::sim

namespace symrig {

std::span<const SceneKey> scene_keys() {
  static const std::vector<SceneKey> all = [] {
    std::vector<SceneKey> list;
    for (const sim::KeyRow& key : sim::key_table())
      list.push_back({key.name, key.print(SceneUri()), key.meaning, key.values});
    return list;
  }();
  return all;
}

namespace {

Result<const sim::KeyRow*> find_key(std::string_view name) {
  std::vector<std::string_view> names;
  for (const sim::KeyRow& key : sim::key_table()) {
    if (key.name == name) return &key;
    names.push_back(key.name);
  }
  return Error{ErrorCode::unknown_name, fmt::format("no scene key is called '{}'", name),
               nearest_hint(name, names)};
}

/// One "key=value".
Result<void> read_item(std::string_view item, std::vector<std::string_view>& seen, SceneUri& uri) {
  const std::size_t equals = item.find('=');
  if (equals == std::string_view::npos || equals == 0)
    return Error{ErrorCode::bad_argument, fmt::format("'{}' is not key=value", item),
                 "write keys as sim:plane?size=64x64&seed=2"};
  const std::string_view name = item.substr(0, equals);
  SYMRIG_TRY(const sim::KeyRow* key, find_key(name));
  if (std::find(seen.begin(), seen.end(), name) != seen.end())
    return Error{ErrorCode::bad_argument, fmt::format("the key '{}' appears twice", name), "give it once"};
  seen.push_back(name);
  return key->read(item.substr(equals + 1), uri);
}

Result<void> read_items(std::string_view query, SceneUri& uri) {
  std::vector<std::string_view> seen;
  while (!query.empty()) {
    const std::size_t end = query.find('&');
    SYMRIG_CHECK(read_item(query.substr(0, end), seen, uri));
    query = end == std::string_view::npos ? std::string_view{} : query.substr(end + 1);
  }
  return {};
}

}  // namespace

namespace {

/// What the exposures of a simulated camera take for white: the brightest of the flood-lit scene is that of
/// the brightest albedo. A few points may be brighter, as lamps and mirrors are.
double white_of(const Scene& points) {
  constexpr double kOrdinary = 0.99, kMostBeyond = 8;
  const Image<float> flood = points.apply(Image<float>(points.grid(), 1, 1.F));
  std::vector<float> light(flood.values().begin(), flood.values().end());
  const auto ordinary = static_cast<double>(quantile(light, kOrdinary));
  const auto most = static_cast<double>(std::ranges::max(light));
  return std::max(ordinary, most / kMostBeyond) / static_cast<double>(sim::kBrightest);
}

Result<void> check_given(const SceneUri& parsed, const DenseUri& dense, const DenseMatrix& matrix) {
  const std::string file = dense.file.string();
  const auto bad = [](ErrorCode code, std::string what, std::string hint) {
    return Error{code, std::move(what), std::move(hint)};
  };
  const SceneUri standard;
  if (parsed.size != standard.size || parsed.channels != 1 || parsed.indirect != 1 || parsed.parallax != 0)
    return bad(ErrorCode::bad_argument,
               fmt::format("{} is a matrix: its size, light and depth are what they are", file),
               "remove the keys size, channels, indirect and parallax");
  if (matrix.grid.rows % parsed.fine != 0 || matrix.grid.cols % parsed.fine != 0)
    return bad(
        ErrorCode::bad_argument,
        fmt::format("fine={} does not divide the {} points of {}", parsed.fine, to_string(matrix.grid), file),
        "give a divisor of both sides");
  if (std::ranges::any_of(matrix.values, [](float v) { return v < 0; }))
    return bad(ErrorCode::bad_value, fmt::format("{} has negative light, which no camera sees", file),
               "remove the keys of the simulated rig: its photographs are then T times the pattern");
  return {};
}

/// `dense:FILE?grid=…&key=value`: the file's matrix on the rig of these keys.
Result<SceneUri> parse_given(const std::string& uri) {
  SYMRIG_TRY(const DenseUri dense, parse_dense_uri(uri));
  SceneUri parsed;
  SYMRIG_CHECK(read_items(dense.rig_keys, parsed));
  SYMRIG_TRY(DenseMatrix matrix, read_dense(dense));
  SYMRIG_CHECK(check_given(parsed, dense, matrix));
  parsed.name = dense.file.string();
  parsed.size = {matrix.grid.rows / parsed.fine, matrix.grid.cols / parsed.fine};
  GivenScene given{.views = dense.views, .asymmetry = asymmetry(matrix)};
  given.points = make_dense_scene(std::move(matrix));
  given.white = white_of(*given.points);
  if (!(given.white > 0))
    return Error{ErrorCode::bad_value, fmt::format("{}: no pixel of the flood-lit scene is lit", parsed.name),
                 "give a matrix with light"};
  parsed.given = std::make_shared<const GivenScene>(std::move(given));
  return parsed;
}

Result<SceneUri> parse_named(std::string_view uri) {
  constexpr std::string_view kScheme = "sim:";
  if (!uri.starts_with(kScheme))
    return Error{ErrorCode::bad_argument, fmt::format("'{}' is not a simulated rig", uri),
                 "write it as sim:NAME?key=value, such as sim:plane?size=64x64"};
  uri.remove_prefix(kScheme.size());
  const std::size_t question = uri.find('?');
  const std::string_view name = uri.substr(0, question);
  if (sim::find_scene(name) == nullptr) return sim::unknown_scene(name);
  SceneUri parsed;
  parsed.name = name;
  if (question != std::string_view::npos) SYMRIG_CHECK(read_items(uri.substr(question + 1), parsed));
  return parsed;
}

}  // namespace

Result<SceneUri> parse_scene_uri(std::string_view uri) {
  SYMRIG_TRY(SceneUri parsed, is_dense(std::string(uri)) ? parse_given(std::string(uri)) : parse_named(uri));
  if (!parsed.camera_noise) parsed.black = 0;
  if (parsed.psf > 0 && sim::is_bench(parsed))
    return Error{ErrorCode::bad_argument,
                 "the scene key psf blurs whole cells, so the camera must share the cells",
                 "give defocus=CAMERA,PROJECTOR instead of psf"};
  return parsed;
}

std::string SceneUri::to_string() const {
  SceneUri defaults;
  if (!camera_noise) defaults.black = 0;  // always 0 then, so it is not printed
  std::string text = given ? fmt::format("dense:{}?grid={}", name, symrig::to_string(given->points->grid()))
                           : fmt::format("sim:{}?size={}", name, symrig::to_string(size));
  if (given && given->views.count() > 1) text += fmt::format("&views={}", symrig::to_string(given->views));
  for (const sim::KeyRow& key : sim::key_table()) {
    const std::string value = key.print(*this);
    // A matrix without a key would be no simulated rig.
    const bool told = value != key.print(defaults) || (given && key.name == "noise");
    if (key.name != "size" && told) text += fmt::format("&{}={}", key.name, value);
  }
  return text;
}

}  // namespace symrig
