// SPDX-License-Identifier: Apache-2.0
// The tables [[pair]] of a rig file.
#include "rig/rig_file_keys.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {
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
