// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/audit.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <sstream>

namespace symrig::bench_vm {

namespace {

constexpr std::size_t kTextSizeAt = 16;  // docs/photograph-log.md
constexpr std::size_t kTextAt = 24;
constexpr std::uint64_t kLongestText = 1 << 20;

Error not_a_log(const std::string& path) {
  return {ErrorCode::bad_format, path + " is not a photograph log", "symrig capture --keep-log writes one"};
}

/// Removes the line "key value" from the front of the text, and returns the value.
std::string take_line(std::istringstream& text, const std::string& key) {
  std::string line;
  std::getline(text, line);
  return line.starts_with(key + " ") ? line.substr(key.size() + 1) : std::string();
}

}  // namespace

Result<std::unique_ptr<PhotographLog>> open_any_log(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, kTextAt> front{};
  if (!file.read(front.data(), front.size())) return not_a_log(path);
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, front.data() + kTextSizeAt, sizeof bytes);
  if (bytes > kLongestText) return not_a_log(path);
  std::string head(bytes, '\0');
  if (!file.read(head.data(), static_cast<std::streamsize>(bytes))) return not_a_log(path);
  std::istringstream text(head);
  LogIdentity identity;
  const auto scene = parse_scene_uri("sim:plane?size=" + take_line(text, "grid"));  // reads the numbers
  if (!scene) return not_a_log(path);
  identity.grid = scene->size;
  identity.channels = take_line(text, "channels") == "3" ? 3 : 1;
  identity.rig = take_line(text, "rig");
  const std::size_t options = text.tellg();
  identity.options = head.substr(std::min(options, head.size()));
  return open_photograph_log(path, identity);
}

}  // namespace symrig::bench_vm
