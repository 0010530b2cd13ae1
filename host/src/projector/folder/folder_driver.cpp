// SPDX-License-Identifier: Apache-2.0
// The keys of `[projector]` for a folder: docs/rig-file.md.
#include "projector/folder/folder_driver.hpp"

#include "image/size_text.hpp"
#include "symrig/projector/folder_projector.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig::projector {
namespace {

struct FolderKeys {
  std::string folder;  // where patterns are written
  Grid screen;         // the projector's pixels
  std::string push;    // shell command that transfers the pictures to the projector; may be empty
};

class FolderSource final : public ProjectorSource {
 public:
  explicit FolderSource(FolderKeys keys) : keys_(std::move(keys)) {}

  Result<std::unique_ptr<Projector>> open(const ScreenFacts& screen, Grid grid) const override {
    FolderProjectorOptions options;
    options.folder = screen.folder / keys_.folder;
    options.screen = keys_.screen;
    options.placement = screen.placement;
    options.grid = grid;
    options.codes = screen.codes;
    options.refresh_period = screen.refresh;
    if (!keys_.push.empty()) options.push = push_by_command(keys_.push);
    SYMRIG_TRY(auto projector, FolderProjector::open(std::move(options)));
    return std::unique_ptr<Projector>(std::move(projector));
  }

  Pacing pacing() const override { return Pacing::trigger; }

  std::string identity(const Placement& /*placement*/) const override {
    return fmt::format("projector folder {}", keys_.folder);
  }

 private:
  FolderKeys keys_;
};

}  // namespace

std::unique_ptr<ProjectorSource> read_folder_projector(base::TableReader& table) {
  FolderKeys keys;
  table.require("folder", "the folder for patterns");
  table.read("folder", keys.folder);
  for (const char* const key : {"connector", "mode"})
    if (table.has(key))
      table.fail("folder", "cannot be combined with a screen's keys", "give either a folder or a connector");
  image::read_picture_size(table, "screen", keys.screen);
  table.read("push", keys.push);
  table.require("screen", "the projector's pixels, columns x rows, such as \"1280x800\"");
  return std::make_unique<FolderSource>(std::move(keys));
}

}  // namespace symrig::projector
