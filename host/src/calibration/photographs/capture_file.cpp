// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/capture_file.hpp"

#include "symrig/base/files.hpp"
#include "symrig/base/internal/table_reader.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/image/internal/size_text.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>

#include <fmt/format.h>

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

/// Reads `[sensor]` of a capture file. Errors go to the reader's context.
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

using base::ReadContext;
using base::TableReader;
using base::TomlNode;

constexpr std::uint64_t kMostText = std::uint64_t{1} << 20;  // bytes of a capture file

void read_format(TableReader& table, RawLayout& raw) {
  std::string name;
  table.require("format", R"(V4L2's name or FourCC: "Y10", "SRGGB12P")");
  if (!table.read("format", name)) return;
  raw.format = find_pixel_format(std::string_view(name));
  if (raw.format == nullptr)
    return table.fail("format", "\"" + name + "\" is not known",
                      R"(V4L2's name or FourCC: "Y10", "SRGGB12P")");
  if (!raw.format->linear)
    table.fail("format", "\"" + name + "\" is a processed picture: its codes are not proportional to light",
               "record a raw format: Y10, Y12, SRGGB10, ...");
}

void read_raw(TableReader& top, CaptureFile& file) {
  const TomlNode* const node = top.find("raw");
  if (node == nullptr) return;
  TableReader table(*node, "raw", top.context());
  RawLayout raw;
  read_format(table, raw);
  table.require("size", "columns x rows, \"1280x1024\"");
  image::read_picture_size(table, "size", raw.size);
  std::uint64_t stride = 0, bits = 0;
  if (table.read_count("stride", stride, 1, std::uint64_t{1} << 20)) raw.stride = stride;
  if (table.read_count("bits", bits, 1, 16)) raw.bits = static_cast<int>(bits);
  constexpr std::pair<std::string_view, bool> kJustified[] = {{"low", false}, {"high", true}};
  table.read_choice<bool>("justified", raw.high_justified, kJustified);
  table.finish();
  if (!table.ok()) return;
  const std::size_t least = row_bytes(*raw.format, raw.size.cols);
  if (raw.stride == 0) raw.stride = least;
  if (raw.stride < least)
    table.fail("stride",
               fmt::format("{} bytes are too few for a row of {} samples", raw.stride, raw.size.cols),
               fmt::format("{} needs at least {}", raw.format->name, least));
  file.raw = raw;
}

void read_photograph(const TomlNode& node, const GrayCode& code, Nanoseconds usual, ReadContext& context,
                     CaptureFile& file) {
  TableReader table(node, "photograph", context);
  CapturedPhotograph photograph{.file = {}, .pattern = 0, .exposure = usual, .line = node.line};
  table.require("file", "a picture of this folder");
  table.read("file", photograph.file);
  table.require("pattern", R"("white", "black", "columns 0", "rows 3 complement")");
  std::string pattern;
  if (table.read("pattern", pattern)) {
    if (const auto found = code_pattern(code, pattern))
      photograph.pattern = *found;
    else
      table.fail(
          "pattern", "\"" + pattern + "\" is not in the sequence",
          fmt::format(
              "legal: \"white\", \"black\", \"columns 0\" to \"columns {}\", \"rows 0\" to \"rows {}\", "
              "each also with \"complement\"; 0 is the widest",
              code.column_bits() - 1, code.row_bits() - 1));
  }
  table.read("exposure", photograph.exposure);
  table.finish();
  file.photographs.push_back(std::move(photograph));
}

void read_photographs(TableReader& top, Nanoseconds usual, CaptureFile& file) {
  const TomlNode* const list = top.find("photograph");
  if (list == nullptr || !top.ok()) return;
  if (list->kind != TomlNode::Kind::array)
    return top.fail("photograph", "is not a list of tables", "write [[photograph]] before each one");
  if (!file.projector)
    return top.fail("photograph", "patterns are named, but the projector's size is missing",
                    "add projector = \"768x1024\" (rows x columns) at the top");
  const GrayCode code(*file.projector);
  for (const TomlNode& node : list->children) {
    if (node.kind != TomlNode::Kind::table)
      return top.fail("photograph", "is not a list of tables", "write [[photograph]] before each one");
    read_photograph(node, code, usual, top.context(), file);
  }
}

}  // namespace

std::optional<int> code_pattern(const GrayCode& code, std::string_view name) {
  if (name == "white") return code.white();
  if (name == "black") return code.black();
  const bool columns = name.starts_with("columns "), rows = name.starts_with("rows ");
  if (!columns && !rows) return std::nullopt;
  name.remove_prefix(columns ? 8 : 5);
  constexpr std::string_view kComplement = " complement";
  const bool complement = name.ends_with(kComplement);
  if (complement) name.remove_suffix(kComplement.size());
  int bit = -1;
  const char* const end = name.data() + name.size();
  const auto parsed = std::from_chars(name.data(), end, bit);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  if (bit < 0 || bit >= (columns ? code.column_bits() : code.row_bits())) return std::nullopt;
  return 2 * (bit + (columns ? 0 : code.column_bits())) + (complement ? 1 : 0);
}

Result<CaptureFile> parse_capture_file(std::string_view text, const std::string& name) {
  SYMRIG_TRY(const TomlNode document, base::parse_toml(text, name));
  ReadContext context{name};
  CaptureFile file;
  file.path = name;
  TableReader top(document, "", context);
  std::uint64_t version = 0;
  top.require("symrig", "symrig = 1, the version of this format");
  top.read_count("symrig", version, 1, 1);
  image::read_grid(top, "projector", file.projector);
  top.read_number("pedestal", file.pedestal, 0, 1);
  Nanoseconds usual{0};
  top.read("exposure", usual);
  read_raw(top, file);
  std::string response;
  top.read("response", response);
  read_sensor_files(top, file);
  read_photographs(top, usual, file);
  top.finish();
  if (!context.state) return context.state.error();
  if (response.empty()) return file;
  SYMRIG_TRY(file.response, load_response(std::filesystem::path(name).parent_path() / response));
  return file;
}

Result<CaptureFile> read_capture_file(const std::filesystem::path& path) {
  SYMRIG_TRY(const auto bytes, read_file(path, kMostText));
  return parse_capture_file({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path.string());
}

}  // namespace symrig
