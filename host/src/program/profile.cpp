// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/profile.hpp"

#include "program/builtin_profiles.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"
#include "symrig/program/internal/file_keys.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

#include <fmt/format.h>

namespace symrig::program {
namespace {

template <class T>
using Choices = std::array<std::pair<std::string_view, T>, 2>;

constexpr Choices<bool> kActive{{{"high", false}, {"low", true}}};
constexpr Choices<ExposureMode> kExposure{
    {{"trigger-width", ExposureMode::trigger_width}, {"timed", ExposureMode::timed}}};
constexpr std::array<std::pair<std::string_view, PatternSync>, 3> kSync{
    {{"vsync", PatternSync::vsync}, {"trigger", PatternSync::trigger}, {"plane", PatternSync::plane}}};

void settled(base::TableReader& table, std::vector<std::string>& assumptions) {
  std::erase_if(assumptions, [&table](const std::string& key) { return table.has(key); });
}

void read_limits(base::TableReader& table, std::vector<BitDepthLimit>& limits) {
  const base::TomlNode* list = table.find("min_exposure");
  if (list == nullptr) return;
  if (list->kind != base::TomlNode::Kind::array)
    return table.fail("min_exposure", "is not a list", "give [{ bits = 1, time = \"105 us\" }, ...]");
  limits.clear();
  for (const base::TomlNode& item : list->children) {
    base::TableReader entry(item, table.path_of("min_exposure"), table.context());
    std::uint64_t bits = 1;
    BitDepthLimit limit;
    entry.require("bits", "the depth in bits");
    entry.require("time", "the shortest time");
    entry.read_count("bits", bits, 1, 16);
    entry.read("time", limit.time);
    entry.finish();
    limit.bits = static_cast<int>(bits);
    limits.push_back(limit);
  }
  std::sort(limits.begin(), limits.end(),
            [](const BitDepthLimit& a, const BitDepthLimit& b) { return a.bits < b.bits; });
}

}  // namespace

void read_camera_keys(base::TableReader& table, CameraProfile& camera) {
  settled(table, camera.assumptions);
  table.read_choice<ExposureMode>("exposure", camera.mode, kExposure);
  table.read_choice<bool>("active", camera.active_low, kActive);
  table.read("exposure_offset", camera.exposure_offset);
  table.read("min_exposure", camera.min_exposure);
  table.read("trigger_pulse", camera.trigger_pulse);
  table.read("trigger_delay", camera.trigger_delay);
  table.read("readout", camera.readout);
  table.read("overlap", camera.overlap);
  table.read("overlap_time_max", camera.overlap_time_max);
}

void read_projector_keys(base::TableReader& table, ProjectorProfile& projector) {
  settled(table, projector.assumptions);
  table.read_choice<PatternSync>("sync", projector.sync, kSync);
  table.read_choice<bool>("active", projector.active_low, kActive);
  table.read("advance_pulse", projector.advance_pulse);
  table.read("refresh", projector.refresh);
  table.read("light_period", projector.light_period);
  table.read("vsync_timeout", projector.vsync_timeout);
  table.read("trigger_delay", projector.trigger_delay);
  table.read("black_insertion", projector.black_insertion);
  table.read("settle", projector.settle);
  auto bits = static_cast<std::uint64_t>(projector.whole_refresh_from_bits);
  table.read_count("whole_refresh_from_bits", bits, 0, 16);
  projector.whole_refresh_from_bits = static_cast<int>(bits);
  table.read_whole("planes", projector.planes, 1, 24);
  table.read("plane_period", projector.plane_period);
  table.read("frame_lead", projector.frame_lead);
  read_limits(table, projector.min_exposure);
}

}  // namespace symrig::program

namespace symrig {
namespace {

namespace fs = std::filesystem;

struct Source {
  std::string file;  ///< for messages
  std::string text;
};

Result<Source> read_source(const fs::path& path) {
  SYMRIG_TRY(const auto bytes, read_file(path, 1U << 20U));
  return Source{path.string(), std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size())};
}

bool is_path(const std::string& which) {
  return which.find('/') != std::string::npos || which.ends_with(".toml");
}

Result<Source> find_profile(const std::string& which, const fs::path& folder) {
  if (is_path(which)) return read_source(folder / which);
  for (const fs::path& place : profile_folders()) {
    const fs::path file = place / (which + ".toml");
    std::error_code failed;
    if (fs::is_regular_file(file, failed) || failed == std::errc::permission_denied) return read_source(file);
  }
  for (const program::BuiltinProfile& profile : program::kBuiltinProfiles)
    if (profile.name == which) return Source{which + ".toml", std::string(profile.text)};
  return Error{ErrorCode::not_found, fmt::format("there is no device profile '{}'", which),
               nearest_hint(which, builtin_profiles()) + "; or give the path of a .toml file"};
}

/// The keys at the beginning of both kinds of profile.
template <class Profile>
void read_head(base::TableReader& table, std::string_view kind, Profile& profile) {
  std::string word;
  std::uint64_t version = 0;
  table.require("symrig", "symrig = 1, the version of this format");
  table.read_count("symrig", version, 1, 1);
  table.require("kind", fmt::format("kind = \"{}\"", kind));
  if (table.read("kind", word) && word != kind)
    table.fail("kind", fmt::format("this is a profile of a {}", word),
               fmt::format("give a profile of a {}", kind));
  table.require("name", "the profile's name");
  table.read("name", profile.name);
  table.read("notes", profile.notes);
}

template <class Profile>
void read_assumptions(base::TableReader& table, Profile& profile) {
  std::vector<std::string> keys;
  if (!table.read("assumptions", keys)) return;
  for (const std::string& key : keys)
    if (!table.has(key))
      table.fail("assumptions", fmt::format("'{}' is not a key of this file", key),
                 "name only keys of this file");
  profile.assumptions = std::move(keys);
}

template <class Profile, class ReadKeys>
Result<Profile> load(const std::string& which, const fs::path& folder, std::string_view kind,
                     ReadKeys read_keys) {
  SYMRIG_TRY(const Source source, find_profile(which, folder));
  SYMRIG_TRY(const base::TomlNode document, base::parse_toml(source.text, source.file));
  base::ReadContext context{source.file};
  base::TableReader table(document, "", context);
  Profile profile;
  read_head(table, kind, profile);
  read_keys(table, profile);
  read_assumptions(table, profile);
  table.finish();
  if (!context.state) return context.state.error();
  return profile;
}

}  // namespace

std::optional<BitDepthLimit> ProjectorProfile::limit_for(int bits) const {
  for (const BitDepthLimit& limit : min_exposure)
    if (limit.bits >= bits) return limit;
  return std::nullopt;
}

std::vector<fs::path> profile_folders() {
  std::vector<fs::path> folders;
  if (const char* asked = std::getenv("SYMRIG_PROFILES"); asked != nullptr && *asked != '\0')
    folders.emplace_back(asked);
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) folders.push_back(program.parent_path().parent_path() / "share/symrig/profiles");
  return folders;
}

std::vector<std::string> builtin_profiles() {
  std::vector<std::string> names;
  for (const program::BuiltinProfile& profile : program::kBuiltinProfiles) names.emplace_back(profile.name);
  return names;
}

Result<CameraProfile> load_camera_profile(const std::string& which, const fs::path& folder) {
  return load<CameraProfile>(which, folder, "camera", program::read_camera_keys);
}

Result<ProjectorProfile> load_projector_profile(const std::string& which, const fs::path& folder) {
  return load<ProjectorProfile>(which, folder, "projector", program::read_projector_keys);
}

}  // namespace symrig
