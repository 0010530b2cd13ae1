// SPDX-License-Identifier: Apache-2.0
#include "rig/rig_file_keys.hpp"

#include "camera/driver.hpp"
#include "image/size_text.hpp"
#include "projector/driver.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>

namespace symrig {
namespace {

using base::TableReader;
using base::TomlNode;
using image::read_grid;
using image::two_sides;

/// Reads an optional table.
template <class Read>
void read_table(TableReader& top, std::string_view key, Read read) {
  const TomlNode* node = top.find(key);
  if (node == nullptr) return;
  TableReader table(*node, top.path_of(key), top.context());
  read(table);
  table.finish();
}

bool has_noise(const TableReader& table) {
  return table.has("full_well") || table.has("read_noise") || table.has("pedestal");
}

void read_noise(TableReader& table, RigUse use, CameraEntry& camera) {
  NoiseModel::Electrons sensor;
  if (table.read("sensor", camera.sensor)) {
    for (const char* const key : {"full_well", "read_noise", "pedestal"})
      if (table.has(key)) table.fail(key, "cannot be combined with sensor", "see " + camera.sensor);
    table.read_whole("bits", camera.bits, 1, 16);
    return;
  }
  if (use == RigUse::sensor && !has_noise(table)) {
    table.read_whole("bits", camera.bits, 1, 16);
    return;
  }
  table.require("full_well", "the sensor's full well in electrons: `symrig capture` needs its noise");
  table.require("read_noise", "the sensor's read noise in electrons");
  table.require("pedestal", "the code of a dark pixel");
  table.require("bits", "the bits of a sample");
  table.read_number("full_well", sensor.full_well, 1, 1e9);
  table.read_number("read_noise", sensor.read_noise, 0, 1e6);
  table.read_number("pedestal", sensor.pedestal, 0, 65'535);
  table.read_whole("bits", camera.bits, 1, 16);
  if (!table.ok()) return;
  sensor.bits = camera.bits;
  const NoiseModel noise = NoiseModel::from_electrons(sensor);
  if (!noise.valid())
    return table.fail("full_well", fmt::format("no sensor has these values: {}", noise.to_string()),
                      "check full_well, read_noise, pedestal and bits");
  camera.noise = noise;
}

void read_trust(TableReader& table, RigOptions& options) {
  table.read_whole("guards", options.ledger.guards, 0, 64);
  table.read("stamp_tolerance", options.ledger.tolerance);
  table.read("strobe_tolerance", options.strobe_tolerance);
  table.read("patience", options.frame_patience);
}

void read_mirror(TableReader& table, Placement& placement) {
  struct Mirror {
    bool rows = false, cols = false;
  };
  constexpr std::array<std::pair<std::string_view, Mirror>, 4> kMirrors{
      {{"none", {}}, {"rows", {true, false}}, {"columns", {false, true}}, {"both", {true, true}}}};
  Mirror mirror;
  table.read_choice<Mirror>("mirror", mirror, kMirrors);
  placement.mirror_rows = mirror.rows;
  placement.mirror_cols = mirror.cols;
}

/// The driver that the table names, else `usual`.
template <class Driver>
const Driver* read_driver(TableReader& table, std::span<const Driver> drivers, const Driver* usual) {
  std::vector<std::pair<std::string_view, const Driver*>> choices;
  for (const Driver& driver : drivers) choices.emplace_back(driver.name, &driver);
  table.read_choice<const Driver*>("driver", usual, choices);
  return usual;
}

/// "auto" becomes 0: planned for each photograph.
void read_exposures(TableReader& table, RigOptions& options) {
  const TomlNode* const node = table.find("exposures");
  if (node != nullptr && node->kind == TomlNode::Kind::text) {
    if (node->text != "auto")
      table.fail("exposures", "\"" + node->text + "\" is not a number of frames", "give 1 to 8, or \"auto\"");
    options.exposures = 0;
    return;
  }
  table.read_whole("exposures", options.exposures, 1, 8);
}

/// What a capture does if a registered rig has moved.
void read_moved(TableReader& table, bool& registers_again) {
  std::string text;
  if (!table.read("moved", text)) return;
  if (text != "stop" && text != "register")
    return table.fail("moved", "\"" + text + "\" is not known", R"(give "stop" or "register")");
  registers_again = text == "register";
}

void read_layout(TableReader& table, std::string_view key, ViewLayout& layout) {
  std::string text;
  if (!table.read(key, text)) return;
  const auto sides = two_sides(text);
  if (!sides) return table.fail(key, "\"" + text + "\" is not a layout", "give rows x columns, \"2x2\"");
  layout = {sides->first, sides->second};
}

/// The layout of the pairs, and by default that of the views.
void read_pair_layout(TableReader& table, RigDescription& rig) {
  if (rig.pairs.empty()) return;
  rig.pair_layout = {1, static_cast<int>(rig.pairs.size())};
  read_layout(table, "pairs", rig.pair_layout);
  if (rig.pair_layout.count() != std::ssize(rig.pairs))
    table.fail("pairs",
               fmt::format("{} has {} places, but the file has {} [[pair]]", to_string(rig.pair_layout),
                           rig.pair_layout.count(), rig.pairs.size()),
               "give rows x columns of pairs, \"1x2\"");
  rig.options.views = rig.pair_layout;
}

}  // namespace

void read_camera_entry(TableReader& top, RigUse use, RigDescription& rig) {
  top.require("camera", "a [camera] table");
  read_table(top, "camera", [&rig, use](TableReader& table) {
    const auto drivers = camera::camera_drivers();
    CameraEntry& camera = rig.camera;
    camera.source = read_driver(table, drivers, drivers.data())->read(table);
    table.read("strobe", camera.strobe);
    table.read("max_exposure", camera.max_exposure);
    read_noise(table, use, camera);
    read_trust(table, rig.options);
  });
}

void read_projector_entry(TableReader& top, RigDescription& rig) {
  top.require("projector", "a [projector] table");
  read_table(top, "projector", [&rig](TableReader& table) {
    ProjectorEntry& projector = rig.projector;
    const auto drivers = projector::projector_drivers();
    projector.source = read_driver(table, drivers, projector::usual_driver(table))->read(table);
    table.read_whole("cell", projector.placement.cell, 1, image::kLargestSide);
    table.read_whole("top", projector.placement.top, 0, image::kLargestSide);
    table.read_whole("left", projector.placement.left, 0, image::kLargestSide);
    read_mirror(table, projector.placement);
    table.read("vsync", projector.vsync);
    table.read("levels", projector.levels);
  });
}

void read_capture_entry(TableReader& top, RigDescription& rig) {
  RigOptions& options = rig.options;
  read_table(top, "capture", [&](TableReader& table) {
    read_grid(table, "grid", rig.grid);
    read_exposures(table, options);
    table.read_number("ratio", options.ratio, 1.01, 1000);
    table.read_number("headroom", options.headroom, 1, 100);
    table.read_number("scale", options.scale, 1e-30, 1e30);
    table.read_whole("black", options.black_photographs, 0, 1000);
    table.read_whole("reference_every", options.reference_every, 0, 1'000'000);
    table.read_number("lamp_drift", options.lamp_drift, 1e-6, 100);
    read_pair_layout(table, rig);
    read_layout(table, "views", options.views);
    table.read("colour", rig.colour);
    read_moved(table, rig.registers_again);
    table.read_whole("retakes", options.retakes, 0, 1000);
    table.read("device_patience", options.device_patience);
    int batch = static_cast<int>(options.batch);
    table.read_whole("batch", batch, 1, 10'000);
    options.batch = static_cast<std::size_t>(batch);
  });
}

}  // namespace symrig
