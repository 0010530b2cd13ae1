// SPDX-License-Identifier: Apache-2.0
// Look-ups in the description of a board's lines.
#include "symrig/program/program_file.hpp"

#include "program/timing.hpp"
#include "symrig/base/files.hpp"
#include "symrig/program/internal/file_keys.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace symrig {

const RigLine* RigSetup::with_role(RigRole role) const {
  const auto found =
      std::find_if(lines.begin(), lines.end(), [role](const RigLine& line) { return line.role == role; });
  return found == lines.end() ? nullptr : &*found;
}

const RigLine* RigSetup::find(std::string_view line) const {
  const auto found = std::find_if(lines.begin(), lines.end(),
                                  [line](const RigLine& one) { return one.config.line == line; });
  return found == lines.end() ? nullptr : &*found;
}

std::string RigSetup::line_name(RigRole role) const {
  const RigLine* line = with_role(role);
  return line == nullptr ? std::string() : line->config.line;
}

bool RigSetup::is_active_low(RigRole role) const {
  const RigLine* line = with_role(role);
  return line != nullptr && line->active_low;
}

RigSetup RigSetup::without(RigRole role) const {
  RigSetup rig = *this;
  for (RigLine& line : rig.lines)
    if (line.role == role) line.role = RigRole::general;
  return rig;
}

bool RigWiring::is_active_low(std::string_view line) const {
  return std::find(active_low.begin(), active_low.end(), line) != active_low.end();
}

RigWiring wiring_of(const RigSetup& rig) {
  RigWiring wiring{rig.line_name(RigRole::projector),
                   rig.line_name(RigRole::vsync),
                   rig.line_name(RigRole::camera),
                   rig.line_name(RigRole::strobe),
                   {},
                   rig.projector.refresh,
                   program::shortest_gap(rig.camera)};
  for (const RigLine& line : rig.lines)
    if (line.active_low) wiring.active_low.push_back(line.config.line);
  return wiring;
}

}  // namespace symrig

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

namespace {

constexpr std::uint64_t kMaxFile = 4U << 20U;

void read_program(base::TableReader& top, ProgramFile& file) {
  top.require("program", "a [program] table");
  const base::TomlNode* node = top.find("program");
  if (node == nullptr) return;
  base::TableReader table(*node, "program", top.context());
  const base::TomlNode* steps = node->kind == base::TomlNode::Kind::table ? table.find("steps") : nullptr;
  if (steps != nullptr) {
    file.steps = program::read_steps(*steps, "program.steps", top.context());
    if (table.has("patterns") || table.has("bracket"))
      table.fail("steps", "cannot be used together with patterns and a bracket",
                 "give either steps, or patterns and a bracket");
  } else {
    file.scan.emplace();
    program::read_scan(table, *file.scan);
  }
  table.finish();
}

}  // namespace

bool has_step(const std::vector<FileStep>& steps, FileStep::Kind kind) {
  return std::any_of(steps.begin(), steps.end(), [kind](const FileStep& step) {
    return step.kind == kind || has_step(step.steps, kind);
  });
}

Result<ProgramFile> parse_program_file(std::string_view text, const std::string& name,
                                       const std::filesystem::path& folder) {
  SYMRIG_TRY(const base::TomlNode document, base::parse_toml(text, name));
  base::ReadContext context{name};
  base::TableReader top(document, "", context);
  ProgramFile file;
  file.path = name;
  std::uint64_t version = 0;
  top.require("symrig", "symrig = 1, the version of this format");
  top.read_count("symrig", version, 1, 1);
  std::string title;
  top.read("title", title);
  program::read_rig(top.find("rig"), folder, context, file.rig);
  read_program(top, file);
  top.finish();
  if (!context.state) return context.state.error();
  return file;
}

Result<ProgramFile> read_program_file(const std::filesystem::path& path) {
  SYMRIG_TRY(const auto bytes, read_file(path, kMaxFile));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return parse_program_file(text, path.string(), path.parent_path());
}

}  // namespace symrig
