// SPDX-License-Identifier: Apache-2.0
#include "sim/scene_keys.hpp"
#include "sim/scenes.hpp"
#include "sim/view.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

namespace symrig {
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

Result<SceneUri> parse_scene_uri(std::string_view uri) {
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
  std::string text = fmt::format("sim:{}?size={}", name, symrig::to_string(size));
  for (const sim::KeyRow& key : sim::key_table()) {
    const std::string value = key.print(*this);
    if (key.name != "size" && value != key.print(defaults)) text += fmt::format("&{}={}", key.name, value);
  }
  return text;
}

}  // namespace symrig
