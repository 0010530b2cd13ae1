// SPDX-License-Identifier: Apache-2.0
#include "symrig/projector/folder_projector.hpp"

#include "symrig/base/files.hpp"
#include "symrig/board/internal/sha256.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kManifestVersion = 1;
constexpr const char* kManifest = "manifest.json";
constexpr std::string_view kHead = "pattern-", kTail = ".png";

std::string file_name(std::size_t number) {
  return fmt::format("{}{:05}{}", kHead, number, kTail);
}

/// true for pattern-00000.png and so on: files that load() may replace.
bool is_picture_of_ours(const std::string& name) {
  if (!name.starts_with(kHead) || !name.ends_with(kTail) || name.size() <= kHead.size() + kTail.size())
    return false;
  const auto digits = std::string_view(name).substr(kHead.size(), name.size() - kHead.size() - kTail.size());
  return std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// Removes the manifest first, so that a partly cleared folder never looks complete.
Result<void> clear(const fs::path& folder) {
  std::error_code error;
  fs::remove(folder / kManifest, error);
  std::vector<fs::path> old;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (is_picture_of_ours(at->path().filename().string())) old.push_back(at->path());
  for (const fs::path& path : old)
    if (!error) fs::remove(path, error);
  if (!error) return {};
  return Error{ErrorCode::io, folder.string() + ": cannot clear the folder (" + error.message() + ")",
               "check that it is a folder and that you may write to it"};
}

/// Writes one picture and returns its entry in the manifest.
Result<Json> write_picture(const fs::path& folder, std::size_t number, const Image<std::uint8_t>& picture) {
  const auto values = picture.values();
  const bool binary = std::all_of(values.begin(), values.end(), [](auto v) { return v == 0 || v == 255; });
  const auto png = binary ? encode_bit_png(picture) : encode_png(picture);
  const std::string name = file_name(number);
  if (png.empty())
    return Error{ErrorCode::io, (folder / name).string() + ": cannot be written", "use a smaller screen"};
  SYMRIG_CHECK(write_file_atomically(folder / name, std::as_bytes(std::span(png))));
  return Json{{"file", name}, {"bits", binary ? 1 : 8}, {"sha256", board::sha256(png)}};
}

Json size(Grid grid) {
  return {grid.rows, grid.cols};
}

Json manifest_head(const FolderProjectorOptions& options, Grid grid) {
  const Placement& at = options.placement;
  return {{"symrig", kManifestVersion},
          {"kind", "patterns"},
          {"screen", size(options.screen)},
          {"grid", size(grid)},
          {"cell", at.cell},
          {"top", at.top},
          {"left", at.left},
          {"mirror_rows", at.mirror_rows},
          {"mirror_cols", at.mirror_cols},
          {"patterns", Json::array()}};
}

Result<void> write_set(const FolderProjectorOptions& options, Grid grid,
                       std::span<const Image<std::uint8_t>> codes) {
  Json manifest = manifest_head(options, grid);
  for (std::size_t k = 0; k < codes.size(); ++k) {
    SYMRIG_TRY(Json entry,
               write_picture(options.folder, k, draw(codes[k], options.placement, options.screen)));
    manifest["patterns"].push_back(std::move(entry));
  }
  return write_file_atomically(options.folder / kManifest, manifest.dump(2) + "\n");
}

}  // namespace

Result<std::unique_ptr<FolderProjector>> FolderProjector::open(FolderProjectorOptions options) {
  if (options.refresh_period.count() <= 0)
    return Error{ErrorCode::bad_argument, "a projector's refresh period is not positive",
                 "give it in nanoseconds"};
  if (!options.screen.valid())
    return Error{ErrorCode::bad_argument, "a projector's screen is " + to_string(options.screen),
                 "give its rows and columns"};
  SYMRIG_TRY(const Grid grid, placed_grid(options.screen, options.placement, options.grid));
  std::error_code error;
  fs::create_directories(options.folder, error);
  if (error || !fs::is_directory(options.folder, error))
    return Error{
        ErrorCode::io,
        options.folder.string() + ": cannot create the folder" + (error ? " (" + error.message() + ")" : ""),
        "choose another folder for patterns"};
  return std::unique_ptr<FolderProjector>(new FolderProjector(std::move(options), grid));
}

FolderProjector::FolderProjector(FolderProjectorOptions options, Grid grid)
    : options_(std::move(options)), grid_(grid) {}

Result<void> FolderProjector::load(std::span<const Pattern> patterns) {
  std::vector<Image<std::uint8_t>> codes;
  for (const Pattern& pattern : patterns) {
    SYMRIG_TRY(auto converted, to_codes(pattern, grid_, options_.codes, codes.size()));
    codes.push_back(std::move(converted));
  }
  SYMRIG_CHECK(clear(options_.folder));
  if (auto written = write_set(options_, grid_, codes); !written) {
    (void)clear(options_.folder);  // reports the first error, not this one
    return written;
  }
  return options_.push ? options_.push(options_.folder) : Result<void>();
}

std::string FolderProjector::describe() const {
  return fmt::format("pictures of {} in {}, patterns {} in cells of {}", to_string(options_.screen),
                     options_.folder.string(), to_string(grid_), options_.placement.cell);
}

}  // namespace symrig
