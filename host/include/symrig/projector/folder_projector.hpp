// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/placement.hpp"
#include "symrig/projector/projector.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// Brings a folder of pictures to a projector that has a memory of its own.
using PushPictures = std::function<Result<void>(const std::filesystem::path& folder)>;

/// Pushes by a command of the user: /bin/sh runs it with the folder as $1 and waits for its end.
/// fails: device_refused (it ended with another status than 0: its last line is in the message), io.
PushPictures push_by_command(std::string command);

struct FolderProjectorOptions {
  std::filesystem::path folder;
  Grid screen;  ///< the projector's, rows x columns of pixels
  Nanoseconds refresh_period{16'666'667};
  Placement placement;
  std::optional<Grid> grid;  ///< of the patterns; none: as many cells as fit
  CodeTable codes;
  PushPictures push;  ///< called after each load(); empty: somebody else sees to it
};

/// A projector that is given its patterns as a folder of pictures, and goes on by its trigger line.
///
/// load() writes pattern-00000.png, … in the order in which they are to be shown, 1-bit where all codes are 0
/// and 255, else 8-bit grey, each of the size of the projector's screen, and then manifest.json:
///   {"symrig": 1, "kind": "patterns", "screen": [rows, cols], "grid": [rows, cols], "cell": k, "top": y,
///    "left": x, "mirror_rows": false, "mirror_cols": false,
///    "patterns": [{"file": "pattern-00000.png", "bits": 1, "sha256": "…"}]}
/// A folder without a manifest is not complete. Pictures of an earlier load() that are not written anew are
/// removed; other files are left alone.
class FolderProjector final : public Projector {
 public:
  /// Makes the folder if it is not there.
  /// fails: bad_argument, size_mismatch (as placed_grid), io (the folder cannot be made).
  static Result<std::unique_ptr<FolderProjector>> open(FolderProjectorOptions options);

  Grid grid() const override { return grid_; }
  Nanoseconds refresh_period() const override { return options_.refresh_period; }
  /// fails: size_mismatch, bad_value, io (disk full, no right to write: the folder is left without a
  /// manifest and without new pictures), and whatever push fails with.
  Result<void> load(std::span<const Pattern> patterns) override;
  std::string describe() const override;

 private:
  FolderProjector(FolderProjectorOptions options, Grid grid);

  FolderProjectorOptions options_;
  Grid grid_;
};

}  // namespace symrig
