// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/nearest_name.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <optional>

#include <fmt/format.h>

namespace symrig {

namespace {

constexpr std::int64_t kLargestScene = std::int64_t{1} << 24;  // pixels: 64 MiB a picture

constexpr std::array<std::string_view, 9> kNames{
    "plane",  "vgroove-white", "vgroove-mixed", "vgroove-textured", "gummy", "occluder",
    "mirror", "views2",        "views3"};

Error unknown(std::string_view kind, std::string_view given, std::span<const std::string_view> known) {
  return {ErrorCode::unknown_name, fmt::format("no {} is called '{}'", kind, given),
          nearest_hint(given, known)};
}

Error bad_value(std::string_view key, std::string_view value, std::string_view rule) {
  return {ErrorCode::bad_argument, fmt::format("the scene key {} cannot be '{}'", key, value),
          fmt::format("give {} as {}", key, rule)};
}

Error too_large(std::string_view size) {
  return {ErrorCode::bad_argument, fmt::format("the scene key size cannot be '{}': that is too large", size),
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

Result<void> read_real(std::string_view key, std::string_view text, double lowest, double highest,
                       double& out) {
  const auto value = parse_number<double>(text);
  if (!value || !std::isfinite(*value) || *value < lowest || *value > highest)
    return bad_value(key, text, fmt::format("a number from {} to {}", lowest, highest));
  out = *value;
  return {};
}

Result<void> read_int(std::string_view key, std::string_view text, int lowest, int highest, int& out) {
  const auto value = parse_number<int>(text);
  if (!value || *value < lowest || *value > highest)
    return bad_value(key, text, fmt::format("a whole number from {} to {}", lowest, highest));
  out = *value;
  return {};
}

constexpr std::int64_t kLargestSide = 1'000'000'000;

/// 0: no side. Digits that no number holds are a side, but too large a one.
std::int64_t parse_side(std::string_view text) {
  const bool digits = !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  return digits ? parse_number<std::int64_t>(text).value_or(kLargestSide + 1) : 0;
}

/// Sides up to kLargestSide. What fits no picture at all: what fits one, but no scene, make_scene() refuses.
bool fits(std::int64_t rows, std::int64_t cols) {
  return Grid{static_cast<int>(rows), static_cast<int>(cols)}.valid();
}

Result<void> read_size(std::string_view key, std::string_view text, Grid& out) {
  const std::size_t cross = text.find('x');
  const std::string_view after = cross == std::string_view::npos ? "" : text.substr(cross + 1);
  const std::int64_t rows = parse_side(text.substr(0, cross)), cols = parse_side(after);
  if (rows > 0 && cols > 0 && (std::max(rows, cols) > kLargestSide || !fits(rows, cols)))
    return too_large(text);
  const Grid grid{static_cast<int>(rows), static_cast<int>(cols)};
  if (!grid.valid()) return bad_value(key, text, "ROWSxCOLUMNS, both at least 1, such as 128x96");
  out = grid;
  return {};
}

Result<void> read_channels(std::string_view key, std::string_view text, int& out) {
  if (text != "1" && text != "3") return bad_value(key, text, "1 or 3");
  out = text == "1" ? 1 : 3;
  return {};
}

Result<void> read_noise(std::string_view key, std::string_view text, bool& out) {
  if (text != "off" && text != "camera") return bad_value(key, text, "off or camera");
  out = text == "camera";
  return {};
}

/// One key: what it means, how it is read, and how it is printed when it differs from its default.
/// docs/command-line.md lists the same.
struct Key {
  std::string_view name;
  std::string_view meaning;
  std::function<Result<void>(std::string_view text, SceneUri& uri)> read;
  std::function<std::string(const SceneUri& uri)> print;
};

Key real_key(std::string_view name, std::string_view meaning, double SceneUri::*field, double lowest,
             double highest) {
  return {name, meaning,
          [=](std::string_view text, SceneUri& uri) {
            return read_real(name, text, lowest, highest, uri.*field);
          },
          [=](const SceneUri& uri) { return fmt::format("{}", uri.*field); }};
}

Key int_key(std::string_view name, std::string_view meaning, int SceneUri::*field, int lowest, int highest) {
  return {
      name, meaning,
      [=](std::string_view text, SceneUri& uri) { return read_int(name, text, lowest, highest, uri.*field); },
      [=](const SceneUri& uri) { return fmt::format("{}", uri.*field); }};
}

/// "auto" is 0: planned for each photograph.
Key exposures_key() {
  return {"exposures", "frames a photograph, or auto: as many as it needs",
          [](std::string_view text, SceneUri& uri) -> Result<void> {
            if (text == "auto") {
              uri.exposures = 0;
              return {};
            }
            const auto value = parse_number<int>(text);
            if (!value || *value < 1 || *value > 8)
              return bad_value("exposures", text, "auto, or a whole number from 1 to 8");
            uri.exposures = *value;
            return {};
          },
          [](const SceneUri& uri) {
            return uri.exposures == 0 ? std::string("auto") : fmt::format("{}", uri.exposures);
          }};
}

Key size_key() {
  return {"size", "rows x columns of the grid",
          [](std::string_view text, SceneUri& uri) { return read_size("size", text, uri.size); },
          [](const SceneUri& uri) { return symrig::to_string(uri.size); }};
}

Key channels_key() {
  return {"channels", "1 or 3",
          [](std::string_view text, SceneUri& uri) { return read_channels("channels", text, uri.channels); },
          [](const SceneUri& uri) { return fmt::format("{}", uri.channels); }};
}

Key noise_key() {
  return {"noise", "camera, or off",
          [](std::string_view text, SceneUri& uri) { return read_noise("noise", text, uri.camera_noise); },
          [](const SceneUri& uri) { return std::string(uri.camera_noise ? "camera" : "off"); }};
}

constexpr int kHighestSeed = 2'147'483'647;

const std::vector<Key>& keys() {
  static const std::vector<Key> all{
      size_key(),
      int_key("seed", "textures and noise", &SceneUri::seed, 0, kHighestSeed),
      channels_key(),
      noise_key(),
      real_key("black", "projector's black level as a share of white; 0 with noise=off", &SceneUri::black, 0,
               0.1),
      real_key("psf", "blur [A, 1-2A, A] on both sides", &SceneUri::psf, 0, 0.25),
      real_key("misalign", "shift of the camera in pixels", &SceneUri::misalign, -8, 8),
      real_key("flare", "share of light in a camera flare", &SceneUri::flare, 0, 0.5),
      real_key("dead", "share of dead camera pixels", &SceneUri::dead, 0, 0.5),
      real_key("indirect", "factor on all light but the direct", &SceneUri::indirect, 0, 10),
      exposures_key(),
      real_key("ratio", "between exposures", &SceneUri::ratio, 1.5, 64),
      real_key("drift", "change of the lamp over 1,000 photographs", &SceneUri::drift, -0.5, 0.5),
      real_key("gamma", "other than 1: 256 levels, light is (level / 255)^gamma", &SceneUri::gamma, 0.25, 4),
      real_key("light", "what a grey filter before the camera lets through", &SceneUri::light, 1e-3, 1),
  };
  return all;
}

Result<const Key*> find_key(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Key& key : keys()) {
    if (key.name == name) return &key;
    names.push_back(key.name);
  }
  return unknown("scene key", name, names);
}

/// One "key=value".
Result<void> read_item(std::string_view item, std::vector<std::string_view>& seen, SceneUri& uri) {
  const std::size_t equals = item.find('=');
  if (equals == std::string_view::npos || equals == 0)
    return Error{ErrorCode::bad_argument, fmt::format("'{}' is not key=value", item),
                 "write keys as sim:plane?size=64x64&seed=2"};
  const std::string_view name = item.substr(0, equals);
  SYMRIG_TRY(const Key* key, find_key(name));
  if (std::find(seen.begin(), seen.end(), name) != seen.end())
    return Error{ErrorCode::bad_argument, fmt::format("the key '{}' is given twice", name), "give it once"};
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

std::span<const std::string_view> scene_names() {
  return kNames;
}

std::span<const SceneKey> scene_keys() {
  static const std::vector<SceneKey> all = [] {
    std::vector<SceneKey> list;
    for (const Key& key : keys()) list.push_back({key.name, key.print(SceneUri()), key.meaning});
    return list;
  }();
  return all;
}

Result<SceneUri> parse_scene_uri(std::string_view uri) {
  constexpr std::string_view kScheme = "sim:";
  if (!uri.starts_with(kScheme))
    return Error{ErrorCode::bad_argument, fmt::format("'{}' is not a simulated rig", uri),
                 "write it as sim:NAME?key=value, such as sim:plane?size=64x64"};
  uri.remove_prefix(kScheme.size());
  const std::size_t question = uri.find('?');
  const std::string_view name = uri.substr(0, question);
  if (std::find(kNames.begin(), kNames.end(), name) == kNames.end()) return unknown("scene", name, kNames);
  SceneUri parsed;
  parsed.name = name;
  if (question != std::string_view::npos) SYMRIG_CHECK(read_items(uri.substr(question + 1), parsed));
  if (!parsed.camera_noise) parsed.black = 0;
  return parsed;
}

std::string SceneUri::to_string() const {
  SceneUri defaults;
  if (!camera_noise) defaults.black = 0;  // forced, hence not worth printing
  std::string text = fmt::format("sim:{}?size={}", name, symrig::to_string(size));
  for (const Key& key : keys()) {
    const std::string value = key.print(*this);
    if (key.name != "size" && value != key.print(defaults)) text += fmt::format("&{}={}", key.name, value);
  }
  return text;
}

}  // namespace symrig
