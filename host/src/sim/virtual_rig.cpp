// SPDX-License-Identifier: Apache-2.0
#include "symrig/sim/virtual_rig.hpp"

#include "sim/image_formation.hpp"
#include "sim/image_source.hpp"
#include "sim/light/random.hpp"
#include "sim/rig_on_board.hpp"
#include "sim/rig_profiles.hpp"
#include "sim/simulated_devices.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/rig/rig.hpp"

#include <algorithm>
#include <utility>

namespace symrig::sim {
namespace {

class SimulatedRig final : public RigOnBoard<VirtualRig> {
 public:
  static Result<std::unique_ptr<VirtualRig>> open(std::string_view text, VirtualRigHooks hooks);
  /// Its devices without a rig. They keep the bench alive.
  static Result<RigParts> parts(std::string_view text, VirtualRigHooks hooks);
  ~SimulatedRig() override { end(); }
  SimulatedRig(const SimulatedRig&) = delete;
  SimulatedRig& operator=(const SimulatedRig&) = delete;

  Grid grid() const override { return bench_.truth->grid(); }
  Grid camera_grid() const override { return bench_.view->camera(); }
  ViewLayout views() const override { return views_of(uri_); }
  int channels() const override { return bench_.truth->channels(); }
  ProbeCost cost() const override {
    ProbeCost cost = rig_->cost();
    cost.simulate_seconds = frame_maker_->seconds();
    return cost;
  }
  Result<void> continue_after(const ProbeCost& spent) override;
  const Scene& truth() const override { return *bench_.truth; }
  const SceneUri& uri() const override { return uri_; }
  std::vector<CornerMap> exact_corners() const override { return bench_.view->corners(); }
  Image<float> ideal_photograph(const Image<float>& pattern) const override {
    return bench_.view->see(pattern, 0);
  }

 private:
  SimulatedRig(SceneUri uri, Bench bench, VirtualRigHooks hooks);
  void make_devices(const RigOptions& options);
  std::unique_ptr<SimulatedCamera> make_camera();
  RigOptions rig_options() const;
  RigDevices devices();

  SceneUri uri_;
  Bench bench_;
  VirtualRigHooks hooks_;
  std::unique_ptr<board_sim::SimProjector> raster_;             // shows whole pictures,
  std::unique_ptr<board_sim::SimPlaneProjector> plane_raster_;  // or bit planes
  board_sim::SimCamera shutter_;
  std::unique_ptr<FrameMaker> frame_maker_;
  std::unique_ptr<SimulatedProjector> projector_;
  std::unique_ptr<SimulatedCamera> camera_;
};

SimulatedRig::SimulatedRig(SceneUri uri, Bench bench, VirtualRigHooks hooks)
    : RigOnBoard(std::make_unique<board_sim::SimBoard>(board_of(profile_of(uri)))),
      uri_(std::move(uri)),
      bench_(std::move(bench)),
      hooks_(std::move(hooks)),
      shutter_(*board_, shutter_of(profile_of(uri_))) {
  const RigProfile& profile = profile_of(uri_);
  if (profile.planes > 0) {
    plane_raster_ = std::make_unique<board_sim::SimPlaneProjector>(*board_, planes_of(profile));
    board_->attach(*plane_raster_);
  } else {
    raster_ = std::make_unique<board_sim::SimProjector>(*board_, raster_of(profile));
    board_->attach(*raster_);
  }
  board_->attach(shutter_);
  if (hooks_.shutter) hooks_.shutter(shutter_);
  if (hooks_.planes && plane_raster_) hooks_.planes(*plane_raster_, *board_);
}

RigOptions SimulatedRig::rig_options() const {
  RigOptions options = options_of(uri_);
  if (hooks_.options) hooks_.options(options);
  return options;
}

std::unique_ptr<SimulatedCamera> SimulatedRig::make_camera() {
  const std::uint64_t key = combine(0xdead, static_cast<std::uint64_t>(uri_.seed));
  SimulatedCameraSpec spec{bench_.view->camera(),
                           bench_.view->channels(),
                           timing_of(profile_of(uri_)),
                           NoiseModel::from_electrons({}),
                           dead_pixels(bench_.view->camera(), uri_.dead, key),
                           board_->config().tick_hz};
  return std::make_unique<SimulatedCamera>(
      std::move(spec), shutter_,
      [this](std::span<const SimulatedExposure> exposures) { return frame_maker_->develop(exposures); });
}

RigDevices SimulatedRig::devices() {
  RigDevices devices;
  devices.board = [this]() -> Result<Board> {
    return hooks_.board ? hooks_.board(*board_) : Board::connect(make_sim_link(*board_));
  };
  devices.projector = [this]() -> Result<std::unique_ptr<Projector>> {
    if (hooks_.projector) return hooks_.projector(*projector_);
    return std::unique_ptr<Projector>(std::make_unique<BorrowedProjector>(*projector_));
  };
  devices.camera = [this]() -> Result<std::unique_ptr<Camera>> {
    if (hooks_.camera) return hooks_.camera(*camera_);
    return std::unique_ptr<Camera>(std::make_unique<BorrowedCamera>(*camera_));
  };
  return devices;
}

void SimulatedRig::make_devices(const RigOptions& options) {
  const Nanoseconds refresh = options.setup.projector.refresh;
  if (plane_raster_) {
    projector_ = std::make_unique<SimulatedPlaneProjector>(uri_.size, *plane_raster_, *board_,
                                                           planes_of(profile_of(uri_)), refresh);
  } else {
    projector_ = std::make_unique<SimulatedProjector>(uri_.size, *raster_, refresh);
  }
  if (hooks_.pacing == Pacing::host) projector_->pace_by_host(*board_);
  const double tick_seconds = 1 / static_cast<double>(board_->config().tick_hz);
  // A hook may fix what is planned.
  frame_maker_ = std::make_unique<FrameMaker>(
      options.exposures == 0,
      std::make_shared<LocalImages>(uri_, *bench_.view, Tile{0, 0, bench_.view->camera()}), *projector_,
      tick_seconds);
  camera_ = make_camera();
}

/// Noise depends on the frame's number and drift on the pattern's number. Both continue where the earlier run
/// of symrig ended. The board's clock need not continue: a photograph's timing relative to its vsync is
/// always the same.
Result<void> SimulatedRig::continue_after(const ProbeCost& spent) {
  return pass_over(spent, [this](std::int64_t photographs) {
    const auto count = static_cast<std::uint64_t>(photographs);
    projector_->skip(count);
    camera_->skip(count * rig_->exposures().size());
  });
}

Result<std::unique_ptr<VirtualRig>> SimulatedRig::open(std::string_view text, VirtualRigHooks hooks) {
  SYMRIG_TRY(SceneUri uri, parse_scene_uri(text));
  SYMRIG_TRY(auto bench, make_bench(uri));
  std::unique_ptr<SimulatedRig> rig(new SimulatedRig(std::move(uri), std::move(bench), std::move(hooks)));
  const RigOptions options = rig->rig_options();
  rig->make_devices(options);
  SYMRIG_TRY(rig->rig_, Rig::open(rig->devices(), options));
  return std::unique_ptr<VirtualRig>(std::move(rig));
}

Result<RigParts> SimulatedRig::parts(std::string_view text, VirtualRigHooks hooks) {
  SYMRIG_TRY(SceneUri uri, parse_scene_uri(text));
  SYMRIG_TRY(auto made, make_bench(uri));
  const std::shared_ptr<SimulatedRig> bench(
      new SimulatedRig(std::move(uri), std::move(made), std::move(hooks)));
  RigParts parts{{}, bench->rig_options()};
  bench->make_devices(parts.options);
  const RigDevices own = bench->devices();
  parts.devices.board = [bench, open = own.board] { return open(); };
  parts.devices.projector = [bench, open = own.projector] { return open(); };
  parts.devices.camera = [bench, open = own.camera] { return open(); };
  return parts;
}

}  // namespace
}  // namespace symrig::sim

namespace symrig {

Result<std::unique_ptr<VirtualRig>> open_virtual_rig(std::string_view uri) {
  return sim::SimulatedRig::open(uri, {});
}

Result<std::unique_ptr<VirtualRig>> open_virtual_rig(std::string_view uri, VirtualRigHooks hooks) {
  return sim::SimulatedRig::open(uri, std::move(hooks));
}

Result<RigParts> virtual_rig_parts(std::string_view uri, VirtualRigHooks hooks) {
  return sim::SimulatedRig::parts(uri, std::move(hooks));
}

}  // namespace symrig
