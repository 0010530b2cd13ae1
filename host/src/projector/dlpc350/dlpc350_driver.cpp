// SPDX-License-Identifier: Apache-2.0
// The keys of `[projector]` for a DLPC350: docs/rig-file.md.
#include "projector/dlpc350/dlpc350_driver.hpp"

#include "projector/dlp/plane_source.hpp"
#include "projector/dlpc350/video_patterns.hpp"

#include <array>
#include <utility>

namespace symrig::projector {
namespace {

class Dlpc350Source final : public dlp::PlaneSource {
 public:
  Dlpc350Source(dlp::PlaneKeys keys, dlpc350::VideoPatternOptions sequence)
      : PlaneSource(dlp::kDlpc350, dlpc350_driver().name, std::move(keys)), sequence_(std::move(sequence)) {}

 private:
  const dlp::PlaneOptions& planes() const override { return sequence_; }
  Result<std::unique_ptr<dlp::PlaneSequence>> begin(std::unique_ptr<dlp::HidTransport> transport,
                                                    const dlp::PictureSource& source) const override {
    SYMRIG_TRY(auto patterns,
               dlpc350::VideoPatterns::begin(dlpc350::Controller(std::move(transport)), source, sequence_));
    return std::unique_ptr<dlp::PlaneSequence>(std::move(patterns));
  }

  dlpc350::VideoPatternOptions sequence_;
};

}  // namespace

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
  return std::make_unique<Dlpc350Source>(std::move(keys), std::move(sequence));
}

}  // namespace symrig::projector
