// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/rig_file.hpp"

#include "rig/rig_file_keys.hpp"
#include "symrig/base/files.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/hdr/sensor.hpp"
#include "symrig/program/internal/file_keys.hpp"
#include "symrig/projector/internal/driver.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

using base::ReadContext;
using base::TableReader;

constexpr std::uint64_t kMaxFile = 1U << 20U;

/// Added to the profile's readout for the clock bounds, so that a stamp never fits two exposures.
constexpr Nanoseconds kClockMargin{500'000};

void read_board(TableReader& top, RigUse use, RigDescription& file) {
  if (use != RigUse::served) top.require("board", "a [board] table");
  const base::TomlNode* node = top.find("board");
  if (node == nullptr) return;
  TableReader table(*node, "board", top.context());
  std::string uri;
  table.require("uri", "the board's address, such as \"usb:\"");
  if (table.read("uri", uri)) {
    auto parsed = DeviceUri::parse(uri);
    if (!parsed) table.fail("uri", parsed.error().what, parsed.error().hint);
    if (parsed) file.board = *std::move(parsed);
  }
  table.finish();
}

/// The part of the file's lines and devices that is connected.
RigSetup wired(const RigDescription& file) {
  RigSetup setup = file.setup;
  if (!file.projector.vsync) setup = setup.without(RigRole::vsync);
  if (!file.camera.strobe) setup = setup.without(RigRole::strobe);
  ProjectorProfile& projector = setup.projector;
  if (projector.refresh.count() == 0) projector.refresh = default_rig_setup().projector.refresh;
  projector.vsync_timeout = std::max(projector.vsync_timeout, projector.refresh);
  return setup;
}

/// Reads a path relative to the rig file.
void read_map(TableReader& top, const std::filesystem::path& folder, RigDescription& file) {
  std::string map;
  if (!top.read("map", map)) return;
  const std::filesystem::path path(map);
  if (path.extension() != ".exr" && path.extension() != ".pfm")
    return top.fail("map", "\"" + map + "\" cannot hold positions", "give a .exr or .pfm");
  file.map = (path.is_absolute() ? path : folder / path).string();
}

/// Reads the projector's measured response.
Result<void> read_levels(const std::filesystem::path& folder, ProjectorEntry& projector) {
  if (projector.levels.empty()) return {};
  SYMRIG_TRY(const std::vector<double> light, load_projector_light(folder / projector.levels));
  SYMRIG_TRY(projector.codes, CodeTable::from_light(light));
  return {};
}

/// Reads the sensor's measured noise and defects. To measure the sensor anew, only its bits count.
Result<void> read_sensor(const std::filesystem::path& folder, RigUse use, CameraEntry& camera) {
  if (camera.sensor.empty()) return {};
  const std::filesystem::path path = folder / camera.sensor;
  if (use == RigUse::sensor) {
    camera.sensor = path.string();
    const auto known = load_sensor(path);
    if (known && camera.bits == 0) camera.bits = known->noise.bits();
    return {};
  }
  SYMRIG_TRY(Sensor sensor, load_sensor(path));
  if (camera.bits != 0 && camera.bits != sensor.noise.bits())
    return Error{ErrorCode::bad_format,
                 fmt::format("{}: it was measured at {} bits, but camera.bits is {}", path.string(),
                             sensor.noise.bits(), camera.bits),
                 "measure the sensor in the format that the rig uses"};
  const std::optional<Grid> picture = camera.source->picture();
  if (picture && !sensor.defects.empty() && sensor.defects.grid() != *picture)
    return Error{ErrorCode::bad_format,
                 fmt::format("{}: it was measured on pictures of {}, but camera.size is {}", path.string(),
                             to_string(sensor.defects.grid()), to_string(*picture)),
                 "measure the sensor at the size that the rig uses"};
  camera.bits = sensor.noise.bits();
  camera.noise = sensor.noise;
  camera.defects = std::move(sensor.defects);
  return {};
}

/// Bit planes need the edges of both trigger outputs, and the projector's settling must fit into a plane.
void check_plane_lines(const RigDescription& file, ReadContext& context) {
  const RigSetup& setup = file.setup;
  if (setup.projector.sync != PatternSync::plane)
    context.fail(setup.projector_place,
                 fmt::format("rig.projector: '{}' is no profile of a projector that shows bit planes",
                             setup.projector.name),
                 R"(give [rig] projector = "lightcrafter-4500-video" or "lightcrafter-6500-video")");
  if (setup.with_role(RigRole::plane) == nullptr)
    context.fail(setup.projector_place, "no line has the role \"plane\"",
                 "wire TRIG_OUT_1 (DLPC900: TRIG_OUT_2) to an input: add [rig.lines.NAME] role = \"plane\"");
  if (!file.projector.vsync || setup.with_role(RigRole::vsync) == nullptr)
    context.fail(setup.projector_place, "no line has the role \"vsync\"",
                 "wire TRIG_OUT_2 (DLPC900: TRIG_OUT_1) to an input: add [rig.lines.NAME] role = \"vsync\"");
}

void check_devices(const RigDescription& file, ReadContext& context) {
  if (file.projector.source->shows_planes()) check_plane_lines(file, context);
  if (file.setup.camera.mode == ExposureMode::timed)
    context.fail(
        file.setup.camera_place,
        fmt::format("rig.camera: '{}' sets its exposure times itself", file.setup.camera.name),
        "capture needs a camera that exposes while its trigger is active: exposure = \"trigger-width\"");
  if (file.projector.source->pacing() == Pacing::trigger &&
      file.setup.with_role(RigRole::projector) == nullptr)
    context.fail(file.setup.projector_place, "no line has the role \"projector\"",
                 "the board triggers a projector with its own patterns: add [rig.lines.NAME]");
  if (file.setup.with_role(RigRole::camera) == nullptr)
    context.fail(file.setup.camera_place, "no line has the role \"camera\"",
                 "the board triggers the camera: add [rig.lines.NAME] role = \"camera\"");
}

/// What several pairs cannot have.
void check_pairs(TableReader& top, const RigDescription& file) {
  if (!file.registration.empty())
    top.fail("registration", "several pairs have one each", "write it below [[pair]]");
  if (file.colour)
    top.fail("pair", "capture.colour is for one pair", "use cameras without a mosaic, or one pair");
  if (file.registers_again)
    top.fail("pair", "capture.moved = \"register\" is for one pair", "remove the key");
}

void settle_options(RigDescription& file) {
  RigOptions& options = file.options;
  options.setup = wired(file);
  options.gap = file.setup.camera.readout + 2 * options.ledger.tolerance + kClockMargin;
  options.ledger.readout = file.setup.camera.readout;
  options.name = file.identity();
}

}  // namespace

namespace {

std::string identity_of_devices(const RigDescription& rig) {
  const ProjectorEntry& projector = rig.projector;
  std::string text = fmt::format("{}; {}", rig.camera.source->identity(sensor_facts(rig)),
                                 projector.source->identity(projector.placement));
  if (!projector.levels.empty()) text += fmt::format(", levels {}", projector.levels);
  return text;
}

}  // namespace

RigDescription RigDescription::one_pair(std::size_t pair) const {
  RigDescription one = *this;
  one.pairs.clear();
  one.camera = pairs[pair].camera;
  one.projector = pairs[pair].projector;
  one.registration = pairs[pair].registration;
  return one;
}

std::string RigDescription::identity() const {
  std::string text = fmt::format("{}: ", name);
  if (pairs.empty()) text += identity_of_devices(*this);
  for (std::size_t k = 0; k < pairs.size(); ++k)
    text += fmt::format("{}pair {}: {}", k == 0 ? "" : "; ", k + 1,
                        pairs[k].address ? pairs[k].address->uri.text() : identity_of_devices(one_pair(k)));
  if (options.exposures == 0) return text + "; exposures planned";
  return text + fmt::format("; {} exposures, ratio {}", options.exposures, options.ratio);
}

Result<RigDescription> parse_rig_file(std::string_view text, const std::string& name,
                                      const std::filesystem::path& folder, RigUse use) {
  SYMRIG_TRY(const base::TomlNode document, base::parse_toml(text, name));
  ReadContext context{name};
  RigDescription file;
  file.path = name;
  file.name = std::filesystem::path(name).stem().string();
  TableReader top(document, "", context);
  std::uint64_t version = 0;
  top.require("symrig", "symrig = 1, the format version");
  top.read_count("symrig", version, 1, 1);
  top.read("name", file.name);
  read_map(top, folder, file);
  read_registration(top, folder, file.registration);
  read_board(top, use, file);
  program::read_rig(top.find("rig"), folder, context, file.setup);
  if (top.has("pair")) {
    read_pair_entries(top, folder, use, file);
  } else {
    read_camera_entry(top, use, file);
    read_projector_entry(top, file);
  }
  read_capture_entry(top, file);
  if (!file.pairs.empty()) check_pairs(top, file);
  if (file.registers_again && file.registration.empty() && context.state)
    top.fail("registration", "capture.moved = \"register\" needs it",
             "give registration = \"registration.h5\"");
  if (file.colour && file.registration.empty() && context.state)
    top.fail("registration", "capture.colour needs it: a cell has a pixel of each colour only then",
             "give registration = \"registration.h5\"");
  if (!file.registration.empty() && !file.grid && context.state)
    top.fail("registration", "it needs capture.grid", "give the projector's cells: grid = \"ROWSxCOLUMNS\"");
  top.finish();
  const bool has_devices = file.camera.source != nullptr;  // else all pairs are behind servers
  if (context.state && has_devices) check_devices(file, context);
  if (!context.state) return context.state.error();
  for (PairEntry& pair : file.pairs) {
    if (pair.address) continue;
    SYMRIG_CHECK(read_sensor(folder, use, pair.camera));
    SYMRIG_CHECK(read_levels(folder, pair.projector));
  }
  SYMRIG_CHECK(read_sensor(folder, use, file.camera));
  SYMRIG_CHECK(read_levels(folder, file.projector));
  settle_options(file);
  return file;
}

Result<RigDescription> read_rig_file(const std::filesystem::path& path, RigUse use) {
  SYMRIG_TRY(const auto bytes, read_file(path, kMaxFile));
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return parse_rig_file(text, path.string(), path.parent_path(), use);
}

}  // namespace symrig
