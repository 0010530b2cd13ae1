// SPDX-License-Identifier: Apache-2.0
#include "program/file_keys.hpp"

#include <algorithm>
#include <array>

namespace symrig::program {
namespace {

template <class T, std::size_t N>
using RigChoices = std::array<std::pair<std::string_view, T>, N>;

constexpr RigChoices<RigRole, 8> kRoles{{{"projector", RigRole::projector},
                                         {"camera", RigRole::camera},
                                         {"lamp", RigRole::lamp},
                                         {"vsync", RigRole::vsync},
                                         {"plane", RigRole::plane},
                                         {"strobe", RigRole::strobe},
                                         {"interlock", RigRole::interlock},
                                         {"general", RigRole::general}}};
constexpr RigChoices<bool, 2> kLevels{{{"high", false}, {"low", true}}};
constexpr RigChoices<bool, 2> kSafe{{{"off", false}, {"on", true}}};
constexpr RigChoices<Hazard, 3> kHazards{
    {{"benign", Hazard::benign}, {"lamp", Hazard::lamp}, {"laser", Hazard::laser}}};
// Lines of these names have these roles, even if the file does not list them.
constexpr RigChoices<RigRole, 4> kDefaultLines{{{"projector_trigger", RigRole::projector},
                                                {"camera_trigger", RigRole::camera},
                                                {"vsync", RigRole::vsync},
                                                {"camera_strobe", RigRole::strobe}}};

constexpr const char* kDefaultCamera = "generic-strobed";
constexpr const char* kDefaultProjector = "hdmi-60";

/// Sets the defaults of a role. The keys of the line are read after it.
void apply_role(RigLine& line, const RigSetup& rig) {
  if (line.role == RigRole::projector) line.active_low = rig.projector.active_low;
  if (line.role == RigRole::camera) line.active_low = rig.camera.active_low;
  if (line.role == RigRole::lamp) line.config.hazard = Hazard::lamp;
}

RigRole default_role(std::string_view line) {
  for (const auto& [name, role] : kDefaultLines)
    if (name == line) return role;
  return RigRole::general;
}

RigLine read_line(const base::TomlNode& node, const RigSetup& rig, base::ReadContext& context) {
  base::TableReader table(node, "rig.lines." + node.key, context);
  RigLine line;
  line.config.line = node.key;
  line.place = node.line;
  line.role = default_role(node.key);
  table.read_choice<RigRole>("role", line.role, kRoles);
  apply_role(line, rig);
  table.read_choice<bool>("active", line.active_low, kLevels);
  bool safe_on = false;
  table.read_choice<bool>("safe", safe_on, kSafe);
  line.config.safe_level = line.active_low != safe_on;
  line.hazard_given = table.read_choice<Hazard>("hazard", line.config.hazard, kHazards);
  table.read("delay", line.delay);
  table.read("max_on", line.config.max_on);
  table.read("min_off", line.config.min_off);
  table.read_share("max_duty", line.config.max_duty);
  bool trips_low = false;
  if (table.read_choice<bool>("trip", trips_low, kLevels)) line.config.trip_level = !trips_low;
  if (line.role == RigRole::interlock) table.require("trip", R"(the level that stops: "high" or "low")");
  if (line.role != RigRole::interlock && line.config.trip_level)
    table.fail("trip", "is only for interlocks", "role = \"interlock\"");
  line.capture_given = table.read("capture", line.config.capture);
  table.finish();
  return line;
}

void add_default_lines(RigSetup& rig) {
  for (const auto& [name, role] : kDefaultLines) {
    if (rig.with_role(role) != nullptr || rig.find(name) != nullptr) continue;
    RigLine line;
    line.config.line = name;
    line.role = role;
    apply_role(line, rig);
    line.config.safe_level = line.active_low;
    rig.lines.push_back(line);
  }
}

/// `camera = "name"`, or a table with `profile` and the keys to override.
template <class Profile, class Load, class ReadKeys>
void read_device(base::TableReader& rig, std::string_view key, const char* standard, Profile& profile,
                 int& place, Load load, ReadKeys read_keys) {
  const base::TomlNode* node = rig.find(key);
  std::string which = standard;
  place = node == nullptr ? rig.line() : node->line;
  const bool is_table = node != nullptr && node->kind == base::TomlNode::Kind::table;
  if (node != nullptr && !is_table && node->kind != base::TomlNode::Kind::text)
    return rig.fail(key, "is neither a name nor a table",
                    "give the name of a profile, or a table with profile = ...");
  if (node != nullptr && !is_table) which = node->text;
  if (is_table) base::TableReader(*node, rig.path_of(key), rig.context()).read("profile", which);
  auto loaded = load(which);
  if (!loaded) {
    const Error& error = loaded.error();
    if (error.code == ErrorCode::bad_format && rig.ok()) {
      rig.context().state = error;  // the error names the line in the profile
    } else {
      rig.fail(key, error.what, error.hint);
    }
    return;
  }
  profile = *std::move(loaded);
  if (!is_table) return;
  base::TableReader table(*node, rig.path_of(key), rig.context());
  table.find("profile");
  read_keys(table, profile);
  table.finish();
}

}  // namespace

void read_rig(const base::TomlNode* node, const std::filesystem::path& folder, base::ReadContext& context,
              RigSetup& rig) {
  base::TomlNode nothing;
  nothing.kind = base::TomlNode::Kind::table;
  nothing.line = 1;
  base::TableReader table(node == nullptr ? nothing : *node, "rig", context);
  rig.place = table.line();
  read_device(
      table, "camera", kDefaultCamera, rig.camera, rig.camera_place,
      [&folder](const std::string& which) { return load_camera_profile(which, folder); }, read_camera_keys);
  read_device(
      table, "projector", kDefaultProjector, rig.projector, rig.projector_place,
      [&folder](const std::string& which) { return load_projector_profile(which, folder); },
      read_projector_keys);
  table.read("keep_alive", rig.keep_alive);
  if (const base::TomlNode* lines = table.find("lines")) {
    if (lines->kind != base::TomlNode::Kind::table)
      table.fail("lines", "is not a table", "write [rig.lines.NAME] for each line");
    for (const base::TomlNode& line : lines->children) rig.lines.push_back(read_line(line, rig, context));
  }
  table.finish();
  add_default_lines(rig);
}

}  // namespace symrig::program

namespace symrig {

RigSetup default_rig_setup() {
  RigSetup rig;
  rig.camera.min_exposure = Nanoseconds{20'000};
  rig.camera.readout = Nanoseconds{4'000'000};
  rig.projector.refresh = Nanoseconds{16'666'667};
  rig.projector.vsync_timeout = Nanoseconds{50'000'000};
  rig.projector.settle = Nanoseconds{1'000'000};
  program::add_default_lines(rig);
  return rig;
}

std::string_view name(RigRole role) {
  for (const auto& [word, meaning] : program::kRoles)
    if (meaning == role) return word;
  return "general";
}

}  // namespace symrig
