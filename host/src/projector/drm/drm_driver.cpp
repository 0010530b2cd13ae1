// SPDX-License-Identifier: Apache-2.0
// The keys of `[projector]` for a screen: docs/rig-file.md.
#include "projector/drm/drm_driver.hpp"

#include "symrig/projector/drm_projector.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig::projector {
namespace {

class DrmSource final : public ProjectorSource {
 public:
  DrmSource(std::string connector, std::string mode)
      : connector_(std::move(connector)), mode_(std::move(mode)) {}

  Result<std::unique_ptr<Projector>> open(const ScreenFacts& screen, Grid grid) const override {
    DrmProjectorOptions options;
    options.connector = connector_;
    options.mode = mode_;
    options.placement = screen.placement;
    options.grid = grid;
    options.codes = screen.codes;
    SYMRIG_TRY(auto projector, DrmProjector::open(options));
    return std::unique_ptr<Projector>(std::move(projector));
  }

  Pacing pacing() const override { return Pacing::host; }

  std::string identity(const Placement& placement) const override {
    return fmt::format("projector {} {}, cell {}+{}+{}{}{}", connector_, mode_, placement.cell, placement.top,
                       placement.left, placement.mirror_rows ? ", rows mirrored" : "",
                       placement.mirror_cols ? ", columns mirrored" : "");
  }

 private:
  std::string connector_;  // "HDMI-A-1"; empty: the only connected one
  std::string mode_;       // "1920x1080@60"; empty: the preferred mode
};

}  // namespace

std::unique_ptr<ProjectorSource> read_drm_projector(base::TableReader& table) {
  std::string connector, mode;
  table.read("connector", connector);
  table.read("mode", mode);
  return std::make_unique<DrmSource>(std::move(connector), std::move(mode));
}

}  // namespace symrig::projector
