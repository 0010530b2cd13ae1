// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/projector.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// Transfers a folder of pictures to a projector that has its own memory.
using PushPictures = std::function<Result<void>(const std::filesystem::path& folder)>;

/// Transfers the pictures with the user's command. /bin/sh runs it with the folder as $1, and the call waits
/// until it ends.
/// fails: device_refused (exit status other than 0; the message holds the command's last line), io.
PushPictures push_by_command(std::string command);

struct FolderProjectorOptions {
  std::filesystem::path folder;
  Grid screen;  ///< the projector's size, rows x columns of pixels
  Nanoseconds refresh_period{16'666'667};
  Placement placement;
  std::optional<Grid> grid;  ///< of the patterns; none: as many whole cells as fit
  CodeTable codes;
  PushPictures push;  ///< called after each load(); empty: the user transfers the pictures
};

/// A projector that gets its patterns as a folder of pictures. Its trigger line selects the next pattern.
///
/// load() writes pattern-00000.png, … in the order of display, and then manifest.json. Pictures have the size
/// of the projector's screen. They are 1-bit if all codes are 0 or 255, else 8-bit grey. The manifest:
///   {"symrig": 1, "kind": "patterns", "screen": [rows, cols], "grid": [rows, cols], "cell": k, "top": y,
///    "left": x, "mirror_rows": false, "mirror_cols": false,
///    "patterns": [{"file": "pattern-00000.png", "bits": 1, "sha256": "…"}]}
/// A folder without a manifest is incomplete. load() removes pictures of earlier calls and leaves other files
/// alone.
class FolderProjector final : public Projector {
 public:
  /// Creates the folder if it does not exist.
  /// fails: bad_argument, size_mismatch (as placed_grid), io (cannot create the folder).
  static Result<std::unique_ptr<FolderProjector>> open(FolderProjectorOptions options);

  Grid grid() const override { return grid_; }
  Nanoseconds refresh_period() const override { return options_.refresh_period; }
  /// fails: size_mismatch, bad_value, io (disk full or no write permission; then the folder has no manifest
  /// and no new pictures), and the errors of push.
  Result<void> load(std::span<const Pattern> patterns) override;
  std::string describe() const override;

 private:
  FolderProjector(FolderProjectorOptions options, Grid grid);

  FolderProjectorOptions options_;
  Grid grid_;
};

}  // namespace symrig
