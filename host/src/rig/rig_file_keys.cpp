// SPDX-License-Identifier: Apache-2.0
#include "rig/rig_file_keys.hpp"

#include "image/size_text.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>

namespace symrig {
namespace {

using base::TableReader;
using base::TomlNode;
using image::read_grid;
using image::read_picture_size;
using image::two_sides;

void read_whole(TableReader& table, std::string_view key, int& value, int least, int most) {
  auto count = static_cast<std::uint64_t>(value);
  if (table.read_count(key, count, static_cast<std::uint64_t>(least), static_cast<std::uint64_t>(most)))
    value = static_cast<int>(count);
}

/// A table that may be left out.
template <class Read>
void read_table(TableReader& top, std::string_view key, Read read) {
  const TomlNode* node = top.find(key);
  if (node == nullptr) return;
  TableReader table(*node, top.path_of(key), top.context());
  read(table);
  table.finish();
}

void read_region(TableReader& table, CameraEntry& camera) {
  read_table(table, "region", [&camera](TableReader& region) {
    read_whole(region, "row", camera.row, 0, image::kLargestSide);
    read_whole(region, "col", camera.col, 0, image::kLargestSide);
    region.require("rows", "the region's height in pixels of the picture");
    region.require("cols", "the region's width in pixels of the picture");
    read_whole(region, "rows", camera.region.rows, 1, image::kLargestSide);
    read_whole(region, "cols", camera.region.cols, 1, image::kLargestSide);
  });
}

/// Values of a driver's own controls, as text: numbers, menu entries, on or off.
void read_controls(TableReader& table, CameraEntry& camera) {
  const TomlNode* node = table.find("controls");
  if (node == nullptr) return;
  if (node->kind != TomlNode::Kind::table)
    return table.fail("controls", "is not a table", "give { gain = 10, trigger_mode = \"External Edge\" }");
  for (const TomlNode& value : node->children) {
    if (value.kind == TomlNode::Kind::integer) {
      camera.controls.emplace_back(value.key, std::to_string(value.integer));
    } else if (value.kind == TomlNode::Kind::boolean) {
      camera.controls.emplace_back(value.key, value.boolean ? "1" : "0");
    } else if (value.kind == TomlNode::Kind::text) {
      camera.controls.emplace_back(value.key, value.text);
    } else {
      table.context().fail(value.line, fmt::format("camera.controls.{} is {}", value.key, value.kind_text()),
                           "give a whole number, a menu entry in quotes, true or false");
    }
  }
}

void read_noise(TableReader& table, CameraEntry& camera) {
  NoiseModel::Electrons sensor;
  if (table.read("sensor", camera.sensor)) {
    for (const char* const key : {"full_well", "read_noise", "pedestal"})
      if (table.has(key)) table.fail(key, "stands beside sensor", "leave it to " + camera.sensor);
    read_whole(table, "bits", camera.bits, 1, 16);
    return;
  }
  table.require("full_well", "the sensor's full well in electrons: `symrig capture` needs its noise");
  table.require("read_noise", "the sensor's read noise in electrons");
  table.require("pedestal", "the code of a dark pixel");
  table.require("bits", "the bits of a sample");
  table.read_number("full_well", sensor.full_well, 1, 1e9);
  table.read_number("read_noise", sensor.read_noise, 0, 1e6);
  table.read_number("pedestal", sensor.pedestal, 0, 65'535);
  read_whole(table, "bits", camera.bits, 1, 16);
  if (!table.ok()) return;
  sensor.bits = camera.bits;
  const NoiseModel noise = NoiseModel::from_electrons(sensor);
  if (!noise.valid())
    return table.fail("full_well", fmt::format("no sensor is like that: {}", noise.to_string()),
                      "check full_well, read_noise, pedestal and bits");
  camera.noise = noise;
}

void read_trust(TableReader& table, RigOptions& options) {
  read_whole(table, "guards", options.ledger.guards, 0, 64);
  table.read("stamp_tolerance", options.ledger.tolerance);
  table.read("strobe_tolerance", options.strobe_tolerance);
  table.read("patience", options.frame_patience);
}

void read_mirror(TableReader& table, ProjectorEntry& projector) {
  struct Mirror {
    bool rows = false, cols = false;
  };
  constexpr std::array<std::pair<std::string_view, Mirror>, 4> kMirrors{
      {{"none", {}}, {"rows", {true, false}}, {"columns", {false, true}}, {"both", {true, true}}}};
  Mirror mirror;
  table.read_choice<Mirror>("mirror", mirror, kMirrors);
  projector.mirror_rows = mirror.rows;
  projector.mirror_cols = mirror.cols;
}

/// "auto" is 0: planned for each photograph.
void read_exposures(TableReader& table, RigOptions& options) {
  const TomlNode* const node = table.find("exposures");
  if (node != nullptr && node->kind == TomlNode::Kind::text) {
    if (node->text != "auto")
      table.fail("exposures", "\"" + node->text + "\" is no number of frames", "give 1 to 8, or \"auto\"");
    options.exposures = 0;
    return;
  }
  read_whole(table, "exposures", options.exposures, 1, 8);
}

void read_views(TableReader& table, ViewLayout& views) {
  std::string text;
  if (!table.read("views", text)) return;
  const auto sides = two_sides(text);
  if (!sides) return table.fail("views", "\"" + text + "\" is no layout", "give rows x columns, \"2x2\"");
  views = {sides->first, sides->second};
}

}  // namespace

void read_camera_entry(TableReader& top, RigFile& file) {
  top.require("camera", "a [camera] table");
  read_table(top, "camera", [&file](TableReader& table) {
    CameraEntry& camera = file.camera;
    table.read("device", camera.device);
    table.read("format", camera.format);
    read_picture_size(table, "size", camera.size);
    table.read_number("rate", camera.rate, 0.001, 1e6);
    constexpr std::array<std::pair<std::string_view, bool>, 2> kJustified{{{"high", true}, {"low", false}}};
    table.read_choice<bool>("justified", camera.high_justified, kJustified);
    read_region(table, camera);
    read_whole(table, "binning", camera.binning, 1, 64);
    read_controls(table, camera);
    table.read("strobe", camera.strobe);
    table.read("max_exposure", camera.max_exposure);
    read_noise(table, camera);
    read_trust(table, file.options);
  });
}

void read_projector_entry(TableReader& top, RigFile& file) {
  top.require("projector", "a [projector] table");
  read_table(top, "projector", [&file](TableReader& table) {
    ProjectorEntry& projector = file.projector;
    table.read("connector", projector.connector);
    table.read("mode", projector.mode);
    read_whole(table, "cell", projector.cell, 1, image::kLargestSide);
    read_whole(table, "top", projector.top, 0, image::kLargestSide);
    read_whole(table, "left", projector.left, 0, image::kLargestSide);
    read_mirror(table, projector);
    table.read("vsync", projector.vsync);
    table.read("levels", projector.levels);
    if (table.read("folder", projector.folder) && (table.has("connector") || table.has("mode")))
      table.fail("folder", "stands beside a screen's keys", "give either a folder or a connector");
    read_picture_size(table, "screen", projector.screen);
    table.read("push", projector.push);
    if (!projector.folder.empty())
      table.require("screen", "the projector's pixels, columns x rows, such as \"1280x800\"");
  });
}

void read_capture_entry(TableReader& top, RigFile& file) {
  RigOptions& options = file.options;
  read_table(top, "capture", [&](TableReader& table) {
    read_grid(table, "grid", file.grid);
    read_exposures(table, options);
    table.read_number("ratio", options.ratio, 1.01, 1000);
    table.read_number("headroom", options.headroom, 1, 100);
    table.read_number("scale", options.scale, 1e-30, 1e30);
    read_whole(table, "black", options.black_photographs, 0, 1000);
    read_whole(table, "reference_every", options.reference_every, 0, 1'000'000);
    table.read_number("lamp_drift", options.lamp_drift, 1e-6, 100);
    read_views(table, options.views);
    read_whole(table, "retakes", options.retakes, 0, 1000);
    table.read("device_patience", options.device_patience);
    int batch = static_cast<int>(options.batch);
    read_whole(table, "batch", batch, 1, 10'000);
    options.batch = static_cast<std::size_t>(batch);
  });
}

}  // namespace symrig
