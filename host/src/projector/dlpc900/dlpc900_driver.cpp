// SPDX-License-Identifier: Apache-2.0
// The keys of `[projector]` for a DLPC900: docs/rig-file.md.
#include "projector/dlpc900/dlpc900_driver.hpp"

#include "projector/dlp/plane_source.hpp"
#include "projector/dlpc900/video_planes.hpp"

#include <array>
#include <optional>
#include <utility>

namespace symrig::projector {
namespace {

class Dlpc900Source final : public dlp::PlaneSource {
 public:
  Dlpc900Source(dlp::PlaneKeys keys, dlpc900::VideoPlaneOptions sequence)
      : PlaneSource(dlp::kDlpc900, dlpc900_driver().name, std::move(keys)), sequence_(std::move(sequence)) {}

 private:
  const dlp::PlaneOptions& planes() const override { return sequence_; }
  Result<std::unique_ptr<dlp::PlaneSequence>> begin(std::unique_ptr<dlp::HidTransport> transport,
                                                    const dlp::PictureSource& source) const override {
    SYMRIG_TRY(auto planes,
               dlpc900::VideoPlanes::begin(dlpc900::Controller(std::move(transport)), source, sequence_));
    return std::unique_ptr<dlp::PlaneSequence>(std::move(planes));
  }

  dlpc900::VideoPlaneOptions sequence_;
};

}  // namespace

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
  return std::make_unique<Dlpc900Source>(std::move(keys), std::move(sequence));
}

}  // namespace symrig::projector
