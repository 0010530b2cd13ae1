// SPDX-License-Identifier: Apache-2.0
// The tables [[pair]] of a rig file.

#include "rig/rig_file_keys.hpp"

#include "symrig/camera/internal/driver.hpp"
#include "symrig/image/internal/size_text.hpp"
#include "symrig/projector/internal/driver.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

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

namespace {

using base::TableReader;
using base::TomlNode;

constexpr std::size_t kMostPairTables = 64;

std::string beside(const std::filesystem::path& folder, const std::string& text) {
  const std::filesystem::path path(text);
  return (path.is_absolute() ? path : folder / path).string();
}

/// A pair behind a server.
void read_address(TableReader& table, const std::filesystem::path& folder, PairEntry& pair) {
  std::string text, secret;
  if (!table.read("uri", text)) return;
  const auto uri = DeviceUri::parse(text);
  const bool tcp = uri && uri->transport == Transport::tcp;
  if (!tcp && !(uri && uri->transport == Transport::unix_socket))
    return table.fail("uri", fmt::format("\"{}\" is no place of a pair", text),
                      "give tcp:HOST:PORT or unix:PATH, where `symrig serve --pair` listens");
  if (table.read("secret", secret)) secret = beside(folder, secret);
  if (tcp && secret.empty())
    table.fail("secret", "TCP needs a shared secret", "give the file with the secret of the pair's server");
  for (const char* const key : {"camera", "projector"})
    if (table.has(key)) table.fail(key, "cannot be combined with uri", "the pair's server has it");
  read_registration(table, folder, pair.registration);
  table.read("strobe", pair.camera.strobe);
  table.read("vsync", pair.projector.vsync);
  pair.address = PairAddress{*uri, secret};
}

/// The rig trusts all cameras as little as the least trusted one.
void combine(const RigOptions& of_pair, RigOptions& options) {
  options.ledger.guards = std::max(options.ledger.guards, of_pair.ledger.guards);
  options.ledger.tolerance = std::max(options.ledger.tolerance, of_pair.ledger.tolerance);
  options.strobe_tolerance = std::max(options.strobe_tolerance, of_pair.strobe_tolerance);
  options.frame_patience = std::max(options.frame_patience, of_pair.frame_patience);
}

/// A pair of devices of this computer.
void read_devices(TableReader& table, const std::filesystem::path& folder, RigUse use, PairEntry& pair,
                  RigDescription& rig) {
  RigDescription one = rig;
  one.options = RigOptions{};
  read_camera_entry(table, use, one);
  read_projector_entry(table, one);
  read_registration(table, folder, pair.registration);
  pair.camera = std::move(one.camera);
  pair.projector = std::move(one.projector);
  if (rig.camera.source == nullptr) {  // the first pair that is here
    const bool strobe = rig.camera.strobe, vsync = rig.projector.vsync;
    rig.camera = pair.camera;
    rig.projector = pair.projector;
    if (!rig.pairs.empty()) {  // the lines are those of the first pair
      rig.camera.strobe = strobe;
      rig.projector.vsync = vsync;
    }
    rig.options.ledger = one.options.ledger;
    rig.options.strobe_tolerance = one.options.strobe_tolerance;
    rig.options.frame_patience = one.options.frame_patience;
  }
  combine(one.options, rig.options);
}

}  // namespace

void read_registration(TableReader& table, const std::filesystem::path& folder, std::string& file) {
  std::string text;
  if (!table.read("registration", text)) return;
  if (std::filesystem::path(text).extension() != ".h5")
    return table.fail("registration", "\"" + text + "\" is not an HDF5 file", "give a name that ends in .h5");
  file = beside(folder, text);
}

void read_pair_entries(TableReader& top, const std::filesystem::path& folder, RigUse use,
                       RigDescription& rig) {
  const TomlNode* const node = top.find("pair");
  for (const char* const key : {"camera", "projector"})
    if (top.has(key))
      return top.fail(key, "cannot be combined with [[pair]]", fmt::format("write it as [pair.{}]", key));
  if (use != RigUse::capture)
    return top.fail("pair", "this work needs a rig with one pair",
                    "write a rig file with the [camera] and [projector] of one pair");
  const bool tables =
      node->kind == TomlNode::Kind::array && std::ranges::all_of(node->children, [](const TomlNode& child) {
        return child.kind == TomlNode::Kind::table;
      });
  if (!tables || node->children.empty() || node->children.size() > kMostPairTables)
    return top.fail("pair", fmt::format("is not 1 to {} tables", kMostPairTables),
                    "write [[pair]] for each pair");
  for (const TomlNode& child : node->children) {
    TableReader table(child, "pair", top.context());
    PairEntry pair;
    if (table.find("uri") != nullptr) {
      read_address(table, folder, pair);
      if (rig.pairs.empty()) {  // its lines are those of the rig
        rig.camera.strobe = pair.camera.strobe;
        rig.projector.vsync = pair.projector.vsync;
      }
    } else {
      read_devices(table, folder, use, pair, rig);
    }
    table.finish();
    rig.pairs.push_back(std::move(pair));
  }
}

}  // namespace symrig
