// SPDX-License-Identifier: Apache-2.0
// The keys of `[projector]` for a DLPC350: docs/rig-file.md.
#include "projector/dlpc350/dlpc350_driver.hpp"

#include "projector/dlp/plane_source.hpp"
#include "projector/dlpc350/video_patterns.hpp"

#include <array>
#include <utility>

namespace symrig::projector {
std::unique_ptr<ProjectorSource> read_dlpc350_projector(base::TableReader& table) {
  dlp::PlaneKeys keys;
  keys.screen.mode = "912x1140@60";
  dlpc350::VideoPatternOptions sequence;
  dlp::read_plane_keys(table, keys, sequence);
  dlp::read_microseconds(table, "plane_exposure", sequence.exposure_us);
  constexpr std::array<std::pair<std::string_view, dlpc350::Port>, 2> kPorts{
      {{"parallel", dlpc350::Port::parallel}, {"fpd-link", dlpc350::Port::fpd_link}}};
  table.read_choice<dlpc350::Port>("port", sequence.port, kPorts);
  dlp::read_delay(table, "plane_delay_us", -20.05, 2.78, sequence.plane_delay);
  dlp::read_delay(table, "frame_delay_us", -20.05, 2.78, sequence.frame_delay);
  dlp::check_delays(table, sequence);
  using Source =
      dlp::PlaneSourceOf<dlpc350::VideoPatterns, dlpc350::Controller, dlpc350::VideoPatternOptions>;
  return std::make_unique<Source>(dlp::kDlpc350, dlpc350_driver().name, std::move(keys), sequence);
}

}  // namespace symrig::projector
