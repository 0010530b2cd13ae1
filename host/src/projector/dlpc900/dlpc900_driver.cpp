// SPDX-License-Identifier: Apache-2.0
// The keys of `[projector]` for a DLPC900: docs/rig-file.md.
#include "projector/dlpc900/dlpc900_driver.hpp"

#include "projector/dlp/plane_source.hpp"
#include "projector/dlpc900/video_planes.hpp"

#include <array>
#include <optional>
#include <utility>

namespace symrig::projector {
std::unique_ptr<ProjectorSource> read_dlpc900_projector(base::TableReader& table) {
  using Port = std::optional<dlpc900::Port>;
  dlp::PlaneKeys keys;
  keys.screen.mode = "1920x1080@60";
  dlpc900::VideoPlaneOptions sequence;
  dlp::read_plane_keys(table, keys, sequence);
  constexpr std::array<std::pair<std::string_view, Port>, 3> kPorts{
      {{"hdmi", dlpc900::Port::hdmi},
       {"displayport", dlpc900::Port::display_port},
       {"unchanged", std::nullopt}}};
  table.read_choice<Port>("port", sequence.port, kPorts);
  // Up to 100 us: later edges would leave a plane too short for an exposure.
  dlp::read_delay(table, "plane_delay_us", -19, 100, sequence.plane_delay);
  dlp::read_delay(table, "frame_delay_us", -20, 100, sequence.frame_delay);
  dlp::check_delays(table, sequence);
  using Source = dlp::PlaneSourceOf<dlpc900::VideoPlanes, dlpc900::Controller, dlpc900::VideoPlaneOptions>;
  return std::make_unique<Source>(dlp::kDlpc900, dlpc900_driver().name, std::move(keys), sequence);
}

}  // namespace symrig::projector
