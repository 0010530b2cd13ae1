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

void read_level(TableReader& table, SensorFiles& files) {
  SensorFiles::Level level;
  table.require("files", R"(two frames of one light at least, ["a0.png", "a1.png"])");
  table.read("files", level.files);
  files.flat.push_back(std::move(level));
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
  table.read("dark", files.dark);
  for_tables(table, "flat", [&](TableReader& one) { read_level(one, files); });
  for_tables(table, "bracket", [&](TableReader& one) { read_still(one, files); });
  table.finish();
  file.sensor = std::move(files);
}

}  // namespace symrig
