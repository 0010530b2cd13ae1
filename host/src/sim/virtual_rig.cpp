// SPDX-License-Identifier: Apache-2.0
#include "symrig/sim/virtual_rig.hpp"

#include "sim/camera_optics.hpp"
#include "sim/exact_frames.hpp"
#include "sim/hash.hpp"
#include "sim/image_formation.hpp"
#include "sim/plane_projector.hpp"
#include "sim/rig_profiles.hpp"
#include "sim/simulated_camera.hpp"
#include "sim/simulated_projector.hpp"
#include "symrig/base/stopwatch.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/rig/rig.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::sim {
namespace {

/// Makes the frames of the simulated camera: which patterns lit each exposure, and the resulting codes.
class FrameMaker {
 public:
  FrameMaker(const SceneUri& uri, const View& view, const SimulatedProjector& projector, double tick_seconds)
      : noisy_(uri.camera_noise),
        planned_(uri.exposures == 0),
        formation_(uri, view),
        projector_(projector),
        tick_seconds_(tick_seconds) {}

  std::vector<CameraFrame> develop(std::span<const SimulatedExposure> exposures);
  const NoiseModel& noise() const { return formation_.noise(); }
  double seconds() const { return seconds_; }

 private:
  std::vector<ImageFormation::Light> lights_of(std::span<const SimulatedExposure> exposures) const;
  ImageFormation::Light during(const SimulatedExposure& exposure,
                               std::span<const ImageFormation::Light> lights) const;
  CameraFrame frame(const SimulatedExposure& exposure, std::uint64_t noise,
                    std::span<const ImageFormation::Light> lights) const;
  std::vector<std::uint64_t> noise_keys(std::span<const SimulatedExposure> exposures);

  bool noisy_;
  bool planned_;
  ImageFormation formation_;
  const SimulatedProjector& projector_;
  double tick_seconds_;
  double seconds_ = 0;
  std::optional<SimulatedProjector::Place> last_;  // the pattern of the newest frame
  std::uint64_t frames_of_last_ = 0;
};

/// The light of every pattern that an exposure saw. nullptr for other patterns.
std::vector<ImageFormation::Light> FrameMaker::lights_of(std::span<const SimulatedExposure> exposures) const {
  std::vector<std::size_t> seen;
  for (const SimulatedExposure& exposure : exposures)
    for (const auto& lit : projector_.shown(exposure.begin, exposure.end)) seen.push_back(lit.index);
  std::sort(seen.begin(), seen.end());
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  std::vector<ImageFormation::Light> lights(seen.empty() ? 0 : seen.back() + 1);
  tbb::parallel_for(std::size_t{0}, seen.size(), [&](std::size_t i) {
    lights[seen[i]] =
        formation_.light_of(projector_.pattern(seen[i]), planned_ ? projector_.place(seen[i]).number
                                                                  : projector_.loaded_before() + seen[i]);
  });
  return lights;
}

/// Mean radiance while the shutter was open.
ImageFormation::Light FrameMaker::during(const SimulatedExposure& exposure,
                                         std::span<const ImageFormation::Light> lights) const {
  std::vector<ImageFormation::Share> shares;
  for (const auto& lit : projector_.shown(exposure.begin, exposure.end))
    shares.push_back({lights[lit.index], lit.share});
  return formation_.during(shares);
}

CameraFrame FrameMaker::frame(const SimulatedExposure& exposure, std::uint64_t noise,
                              std::span<const ImageFormation::Light> lights) const {
  const ImageFormation::Light light = during(exposure, lights);
  CameraFrame frame;
  frame.sequence = exposure.sequence;
  if (!noisy_) {
    frame.attachment = light;
    return frame;
  }
  const double open = static_cast<double>(exposure.end - exposure.begin) * tick_seconds_;
  frame.raw = formation_.expose(*light, open, noise);
  return frame;
}

/// Keys for the noise of frames. Usually the key is the frame's number. With planned exposures, a continued
/// capture does not know this number. Then the key combines the pattern's place and the frame's index among
/// the frames of that pattern. They may be developed one by one.
std::vector<std::uint64_t> FrameMaker::noise_keys(std::span<const SimulatedExposure> exposures) {
  std::vector<std::uint64_t> keys;
  std::map<std::pair<bool, std::uint64_t>, std::uint64_t> frames;  // of each place so far
  if (last_) frames[{last_->dark, last_->number}] = frames_of_last_;
  for (const SimulatedExposure& exposure : exposures) {
    const auto shown = projector_.shown(exposure.begin, exposure.end);
    if (!planned_ || shown.empty()) {
      keys.push_back(exposure.sequence);
      continue;
    }
    // Planes of one picture take turns, so the frames of a pattern need not follow each other.
    const auto place = projector_.place(shown.front().index);
    std::uint64_t& count = frames[{place.dark, place.number}];
    keys.push_back(combine(combine(place.dark ? 0xdaUL : 0x11UL, place.number), count++));
    last_ = place;
    frames_of_last_ = count;
  }
  return keys;
}

std::vector<CameraFrame> FrameMaker::develop(std::span<const SimulatedExposure> exposures) {
  const Stopwatch watch;
  const std::vector<ImageFormation::Light> lights = lights_of(exposures);
  const std::vector<std::uint64_t> keys = noise_keys(exposures);
  std::vector<CameraFrame> frames(exposures.size());
  tbb::parallel_for(std::size_t{0}, frames.size(),
                    [&](std::size_t i) { frames[i] = frame(exposures[i], keys[i], lights); });
  seconds_ += watch.seconds();
  return frames;
}

/// Forwards to a camera that it does not own.
class BorrowedCamera final : public Camera {
 public:
  explicit BorrowedCamera(Camera& camera) : camera_(camera) {}
  Grid grid() const override { return camera_.grid(); }
  int channels() const override { return camera_.channels(); }
  CameraTiming timing() const override { return camera_.timing(); }
  const NoiseModel& noise() const override { return camera_.noise(); }
  const Image<std::uint8_t>* dead() const override { return camera_.dead(); }
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override {
    return camera_.take(count, patience);
  }
  std::string describe() const override { return camera_.describe(); }

 private:
  Camera& camera_;
};

/// Forwards to a projector that it does not own.
class BorrowedProjector final : public Projector {
 public:
  explicit BorrowedProjector(Projector& projector) : projector_(projector) {}
  Grid grid() const override { return projector_.grid(); }
  Nanoseconds refresh_period() const override { return projector_.refresh_period(); }
  Pacing pacing() const override { return projector_.pacing(); }
  Result<void> load(std::span<const Pattern> patterns) override { return projector_.load(patterns); }
  Result<Shown> show(std::size_t index) override { return projector_.show(index); }
  PlaneTiming planes() const override { return projector_.planes(); }
  Result<void> load_planes(std::span<const Pattern> patterns, std::span<const PlanePlan> plans) override {
    return projector_.load_planes(patterns, plans);
  }
  Result<Shown> play(std::span<const std::size_t> order) override { return projector_.play(order); }
  Result<std::vector<ShownPicture>> played() override { return projector_.played(); }
  std::string setting_for_planes(std::span<const int> seen) const override {
    return projector_.setting_for_planes(seen);
  }
  Result<void> check() override { return projector_.check(); }
  std::string describe() const override { return projector_.describe(); }

 private:
  Projector& projector_;
};

class SimulatedRig final : public VirtualRig {
 public:
  static Result<std::unique_ptr<VirtualRig>> open(std::string_view text, VirtualRigHooks hooks);
  /// Its devices without a rig. They keep the bench alive.
  static Result<RigParts> parts(std::string_view text, VirtualRigHooks hooks);
  ~SimulatedRig() override {
    rig_.reset();    // uses the board
    board_.reset();  // uses its peripherals
  }
  SimulatedRig(const SimulatedRig&) = delete;
  SimulatedRig& operator=(const SimulatedRig&) = delete;

  Grid grid() const override { return bench_.truth->grid(); }
  Grid camera_grid() const override { return bench_.view->camera(); }
  ViewLayout views() const override { return views_of(uri_); }
  int channels() const override { return bench_.truth->channels(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return rig_->measure(patterns);
  }
  bool plans_exposures(std::size_t photographs) const override { return rig_->plans_exposures(photographs); }
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override {
    return rig_->measure_expected(patterns, expected);
  }
  std::size_t together() const override { return std::max<std::size_t>(4, rig_->together()); }
  ProbeCost cost() const override {
    ProbeCost cost = rig_->cost();
    cost.simulate_seconds = frame_maker_->seconds();
    return cost;
  }
  Result<void> continue_after(const ProbeCost& spent) override;
  std::string describe() const override { return rig_->describe(); }
  const Scene& truth() const override { return *bench_.truth; }
  const SceneUri& uri() const override { return uri_; }
  std::vector<CornerMap> exact_corners() const override { return bench_.view->corners(); }
  Image<float> ideal_photograph(const Image<float>& pattern) const override {
    return bench_.view->see(pattern, 0);
  }
  const Rig& rig() const override { return *rig_; }

 private:
  SimulatedRig(SceneUri uri, Bench bench, VirtualRigHooks hooks);
  void make_devices(const RigOptions& options);
  std::unique_ptr<SimulatedCamera> make_camera();
  RigOptions rig_options() const;
  RigDevices devices();

  SceneUri uri_;
  Bench bench_;
  VirtualRigHooks hooks_;
  std::unique_ptr<board_sim::SimBoard> board_;
  std::unique_ptr<board_sim::SimProjector> raster_;             // shows whole pictures,
  std::unique_ptr<board_sim::SimPlaneProjector> plane_raster_;  // or bit planes
  board_sim::SimCamera shutter_;
  std::unique_ptr<FrameMaker> frame_maker_;
  std::unique_ptr<SimulatedProjector> projector_;
  std::unique_ptr<SimulatedCamera> camera_;
  std::unique_ptr<Rig> rig_;
};

board_sim::SimProjectorConfig raster_of(const RigProfile& profile) {
  board_sim::SimProjectorConfig config;
  config.refresh_hz = static_cast<std::uint32_t>(profile.refresh_hz);
  return config;
}

board_sim::SimPlaneProjectorConfig planes_of(const RigProfile& profile) {
  board_sim::SimPlaneProjectorConfig config;
  config.refresh_hz = static_cast<std::uint32_t>(profile.refresh_hz);
  config.planes = profile.planes;
  config.plane_line = kPlaneLine;
  return config;
}

board_sim::SimBoardConfig board_of(const RigProfile& profile) {
  board_sim::SimBoardConfig config;
  if (profile.planes > 0) config.lines.push_back({kPlaneLine, false});
  return config;
}

/// The camera is ready a millisecond before the program expects it.
board_sim::SimCameraConfig shutter_of(const RigProfile& profile) {
  board_sim::SimCameraConfig config;
  config.readout_us = static_cast<std::uint64_t>(1e6 * profile.readout_seconds) - 1000;
  return config;
}

SimulatedRig::SimulatedRig(SceneUri uri, Bench bench, VirtualRigHooks hooks)
    : uri_(std::move(uri)),
      bench_(std::move(bench)),
      hooks_(std::move(hooks)),
      board_(std::make_unique<board_sim::SimBoard>(board_of(profile_of(uri_)))),
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
  if (hooks_.planes && plane_raster_) hooks_.planes(*plane_raster_, *board_);
}

RigOptions SimulatedRig::rig_options() const {
  RigOptions options;
  options.exposures = uri_.exposures;
  options.ratio = uri_.ratio;
  options.setup = setup_of(profile_of(uri_));
  options.scale = 1 / (kSensitivity * transmission_of(uri_));
  options.views = views_of(uri_);
  options.name = uri_.to_string();
  if (!uri_.camera_noise) options.reading = std::make_shared<ExactFrames>();
  options.ledger.guards = 0;  // a camera in virtual time loses no frames at its start
  if (hooks_.options) hooks_.options(options);
  return options;
}

std::unique_ptr<SimulatedCamera> SimulatedRig::make_camera() {
  const std::uint64_t key = combine(0xdead, static_cast<std::uint64_t>(uri_.seed));
  SimulatedCameraSpec spec{bench_.view->camera(),
                           bench_.view->channels(),
                           CameraTiming{},
                           frame_maker_->noise(),
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
  SceneUri as_opened = uri_;
  as_opened.exposures = options.exposures;  // a hook may fix what is planned
  frame_maker_ = std::make_unique<FrameMaker>(as_opened, *bench_.view, *projector_, tick_seconds);
  camera_ = make_camera();
}

/// Noise depends on the frame's number and drift on the pattern's number. Both continue where the earlier run
/// of symrig ended. The board's clock need not continue: a photograph's timing relative to its vsync is
/// always the same.
Result<void> SimulatedRig::continue_after(const ProbeCost& spent) {
  const std::int64_t missing = spent.photographs - rig_->cost().photographs;
  if (missing < 0)
    return Error{ErrorCode::bad_argument, "this rig has taken more photographs than the capture to continue",
                 "open the rig again"};
  return rig_->pass_over(missing, [this](std::int64_t photographs) {
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
