// SPDX-License-Identifier: Apache-2.0
#include "calibration/sensor_files.hpp"

namespace symrig {
namespace {

using base::TableReader;
using base::TomlNode;

/// Calls use(table) for each table of a list.
template <class Use>
void for_tables(TableReader& table, std::string_view key, const Use& use) {
  const TomlNode* const list = table.find(key);
  if (list == nullptr) return;
  const auto wrong = [&] {
    table.fail(key, "is not a list of tables", "write [[" + table.path_of(key) + "]] before each");
  };
  if (list->kind != TomlNode::Kind::array) return wrong();
  for (const TomlNode& node : list->children) {
    if (node.kind != TomlNode::Kind::table) return wrong();
    TableReader one(node, table.path_of(key), table.context());
    use(one);
    one.finish();
  }
}

void read_level(TableReader& table, bool scene, std::vector<SensorFiles::Level>& levels) {
  SensorFiles::Level level;
  table.require("files", R"(two frames of one light at least, ["a0.png", "a1.png"])");
  table.read("files", level.files);
  if (scene) {
    table.require("exposure", "how long each frame of the level was exposed, \"4 ms\"");
    table.read("exposure", level.exposure);
    if (table.ok() && (level.files.empty() || level.files.size() % 2 != 0))
      table.fail("files", "are no pairs", "give an even number: each two of them follow each other");
  }
  levels.push_back(std::move(level));
}

/// Dark frames: a list of files, or with a scene a table for each exposure.
void read_dark(TableReader& table, SensorFiles& files) {
  if (!files.scene) {
    table.read("dark", files.dark);
    return;
  }
  for_tables(table, "dark", [&](TableReader& one) { read_level(one, true, files.dark_levels); });
}

void read_still(TableReader& table, SensorFiles& files) {
  SensorFiles::Still still;
  table.require("file", "a frame of this folder");
  table.require("exposure", "how long it was exposed, \"4 ms\"");
  table.read("file", still.file);
  table.read("exposure", still.exposure);
  files.bracket.push_back(std::move(still));
}

}  // namespace

void read_sensor_files(TableReader& top, CaptureFile& file) {
  const TomlNode* const node = top.find("sensor");
  if (node == nullptr) return;
  TableReader table(*node, "sensor", top.context());
  SensorFiles files;
  std::uint64_t bits = 0;
  if (table.read_count("bits", bits, 1, 16)) files.bits = static_cast<int>(bits);
  constexpr std::pair<std::string_view, bool> kLights[] = {{"smooth", false}, {"scene", true}};
  table.read_choice<bool>("light", files.scene, kLights);
  read_dark(table, files);
  for_tables(table, "flat", [&](TableReader& one) { read_level(one, files.scene, files.flat); });
  for_tables(table, "bracket", [&](TableReader& one) { read_still(one, files); });
  if (files.scene && !files.bracket.empty())
    table.fail("bracket", "has no meaning with light = \"scene\"",
               "remove it: the levels are the exposures of the scene");
  table.finish();
  file.sensor = std::move(files);
}

}  // namespace symrig
