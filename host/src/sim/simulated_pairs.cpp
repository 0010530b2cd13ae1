// SPDX-License-Identifier: Apache-2.0

#include "symrig/sim/simulated_pairs.hpp"

#include "sim/image_formation.hpp"
#include "sim/image_source.hpp"
#include "sim/light/random.hpp"
#include "sim/pair_images.hpp"
#include "sim/rig_on_board.hpp"
#include "sim/rig_profiles.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/link.hpp"
#include "symrig/image/internal/size_text.hpp"
#include "symrig/rig/internal/client_talk.hpp"
#include "symrig/rig/internal/each_pair.hpp"
#include "symrig/rig/pairs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {

namespace {

using Images = std::vector<std::shared_ptr<ImageSource>>;

/// One camera on the board's trigger line.
struct PairCamera {
  std::unique_ptr<board_sim::SimCamera> shutter;
  std::unique_ptr<FrameMaker> frames;
  std::unique_ptr<SimulatedCamera> camera;
};

class PairedRig final : public RigOnBoard<SimulatedPairs> {
 public:
  static Result<std::unique_ptr<SimulatedPairs>> open(PairScene scene, std::shared_ptr<const Bench> bench,
                                                      Images images, SimulatedPairHooks hooks);
  ~PairedRig() override { end(); }
  PairedRig(const PairedRig&) = delete;
  PairedRig& operator=(const PairedRig&) = delete;

  Grid grid() const override { return scene_.uri.size; }
  ViewLayout views() const override { return views_of(scene_.uri); }
  int channels() const override { return scene_.uri.channels; }
  /// The pairs work at the same time.
  ProbeCost cost() const override {
    ProbeCost cost = rig_->cost();
    for (const PairCamera& one : cameras_)
      cost.simulate_seconds = std::max(cost.simulate_seconds, one.frames->seconds());
    return cost;
  }
  Result<void> continue_after(const ProbeCost& spent) override;
  std::string identity() const override {
    return fmt::format("{} on {} pairs", describe(), to_string(scene_.layout.layout));
  }
  const SceneUri& uri() const override { return scene_.uri; }

 private:
  PairedRig(PairScene scene, std::shared_ptr<const Bench> bench, Images images, SimulatedPairHooks hooks)
      : RigOnBoard(std::make_unique<board_sim::SimBoard>(board_of(profile_of(scene.uri)))),
        scene_(std::move(scene)),
        bench_(std::move(bench)),
        images_(std::move(images)),
        hooks_(std::move(hooks)) {}
  RigOptions make_devices();
  PairCamera make_camera(std::size_t pair, bool planned);
  RigDevices devices();
  Result<std::unique_ptr<Camera>> open_cameras();

  PairScene scene_;
  std::shared_ptr<const Bench> bench_;  // of local images; nullptr: all are remote
  Images images_;
  SimulatedPairHooks hooks_;
  std::unique_ptr<board_sim::SimProjector> raster_;
  std::unique_ptr<SimulatedProjector> projector_;  // what all projectors together show
  std::vector<PairCamera> cameras_;
};

PairCamera PairedRig::make_camera(std::size_t pair, bool planned) {
  const SceneUri& uri = scene_.uri;
  PairCamera one;
  board_sim::SimCameraConfig shutter = shutter_of(profile_of(uri));
  if (pair > 0) shutter.strobe_line.clear();  // the board sees the exposures of the first camera
  one.shutter = std::make_unique<board_sim::SimCamera>(*board_, shutter);
  board_->attach(*one.shutter);
  const double tick_seconds = 1 / static_cast<double>(board_->config().tick_hz);
  one.frames = std::make_unique<FrameMaker>(planned, images_[pair], *projector_, tick_seconds);
  const Tile tile = scene_.layout.tile(pair);
  const auto dead = dead_pixels(uri.size, uri.dead, combine(0xdead, static_cast<std::uint64_t>(uri.seed)));
  SimulatedCameraSpec spec{tile.grid,
                           uri.channels,
                           timing_of(profile_of(uri)),
                           NoiseModel::from_electrons({}),
                           dead.empty() ? dead : cut(dead, tile),
                           board_->config().tick_hz};
  one.camera = std::make_unique<SimulatedCamera>(
      std::move(spec), *one.shutter,
      [frames = one.frames.get()](std::span<const SimulatedExposure> exposures) {
        return frames->develop(exposures);
      });
  return one;
}

RigOptions PairedRig::make_devices() {
  RigOptions options = options_of(scene_.uri);
  if (hooks_.options) hooks_.options(options);
  options.reading = read_pairs(options.reading, scene_.layout);
  raster_ = std::make_unique<board_sim::SimProjector>(*board_, raster_of(profile_of(scene_.uri)));
  board_->attach(*raster_);
  projector_ =
      std::make_unique<SimulatedProjector>(scene_.uri.size, *raster_, options.setup.projector.refresh);
  for (std::size_t k = 0; k < images_.size(); ++k) cameras_.push_back(make_camera(k, options.exposures == 0));
  return options;
}

Result<std::unique_ptr<Camera>> PairedRig::open_cameras() {
  std::vector<std::unique_ptr<Camera>> cameras;
  for (std::size_t k = 0; k < images_.size(); ++k) {
    if (const auto opened = images_[k]->open(); !opened) return rig::of_pair(k, opened.error());
    std::unique_ptr<Camera> camera = std::make_unique<BorrowedCamera>(*cameras_[k].camera);
    cameras.push_back(hooks_.camera ? hooks_.camera(k, std::move(camera)) : std::move(camera));
  }
  return join_cameras(std::move(cameras), scene_.layout);
}

RigDevices PairedRig::devices() {
  RigDevices devices;
  devices.board = [this]() { return Board::connect(make_sim_link(*board_)); };
  devices.projector = [this]() -> Result<std::unique_ptr<Projector>> {
    if (hooks_.projector) return hooks_.projector(*projector_);
    return std::unique_ptr<Projector>(std::make_unique<BorrowedProjector>(*projector_));
  };
  devices.camera = [this]() { return open_cameras(); };
  return devices;
}

/// As the single simulated rig: noise and drift continue where the earlier run of symrig ended.
Result<void> PairedRig::continue_after(const ProbeCost& spent) {
  return pass_over(spent, [this](std::int64_t photographs) {
    const auto count = static_cast<std::uint64_t>(photographs);
    projector_->skip(count);
    for (PairCamera& one : cameras_) one.camera->skip(count * rig_->exposures().size());
  });
}

Result<std::unique_ptr<SimulatedPairs>> PairedRig::open(PairScene scene, std::shared_ptr<const Bench> bench,
                                                        Images images, SimulatedPairHooks hooks) {
  std::unique_ptr<PairedRig> paired(
      new PairedRig(std::move(scene), std::move(bench), std::move(images), std::move(hooks)));
  const RigOptions options = paired->make_devices();
  SYMRIG_TRY(paired->rig_, Rig::open(paired->devices(), options));
  return std::unique_ptr<SimulatedPairs>(std::move(paired));
}

/// What a pair states must fit its place.
Result<void> check_pair(const PairLink& link, std::size_t pair, ViewLayout layout, const std::string& scene) {
  const auto wrong = [&](const char* what, const std::string& is, const std::string& wanted) {
    return rig::of_pair(pair,
                        {ErrorCode::bad_argument,
                         fmt::format("{} has {} {}, but {} is needed", link.place(), what, is, wanted),
                         "start all pairs with one scene and one layout, in the order of the rig file"});
  };
  if (link.fact("layout") != to_string(layout))
    return wrong("the layout", link.fact("layout"), to_string(layout));
  if (link.fact("pair") != std::to_string(pair + 1))
    return wrong("the place", link.fact("pair"), std::to_string(pair + 1));
  if (link.fact("scene") != scene) return wrong("the scene", link.fact("scene"), scene);
  return {};
}

}  // namespace

}  // namespace symrig::sim

namespace symrig {

Result<std::unique_ptr<SimulatedPairs>> open_simulated_pairs(std::string_view uri, ViewLayout pairs,
                                                             SimulatedPairHooks hooks) {
  SYMRIG_TRY(sim::PairScene scene, sim::parse_pair_scene(uri, pairs));
  SYMRIG_TRY(auto made, sim::make_bench(scene.uri));
  const auto bench = std::make_shared<const sim::Bench>(std::move(made));
  sim::Images images;
  for (std::size_t k = 0; k < scene.layout.count(); ++k)
    images.push_back(std::make_shared<sim::LocalImages>(scene.uri, *bench->view, scene.layout.tile(k)));
  return sim::PairedRig::open(std::move(scene), bench, std::move(images), std::move(hooks));
}

Result<std::unique_ptr<SimulatedPairs>> open_simulated_pairs(std::vector<LinkedPair> pairs, ViewLayout layout,
                                                             const PairLink::KeepWaiting& keep_waiting,
                                                             SimulatedPairHooks hooks) {
  if (std::ssize(pairs) != layout.count() || pairs.empty())
    return Error{ErrorCode::bad_argument,
                 fmt::format("a layout of {} pairs has {} places, but there are {} pairs", to_string(layout),
                             layout.count(), pairs.size()),
                 "give rows x columns of pairs, such as \"1x2\""};
  const std::string uri = pairs.front().link->fact("scene");
  SYMRIG_TRY(sim::PairScene scene, sim::parse_pair_scene(uri, layout));
  for (std::size_t k = 0; k < pairs.size(); ++k)
    SYMRIG_CHECK(sim::check_pair(*pairs[k].link, k, layout, uri));
  sim::Images images;
  for (std::size_t k = 0; k < pairs.size(); ++k)
    images.push_back(std::make_shared<sim::RemoteImages>(std::move(pairs[k]), keep_waiting,
                                                         scene.uri.camera_noise, scene.layout.tile(k).grid,
                                                         scene.uri.channels));
  return sim::PairedRig::open(std::move(scene), nullptr, std::move(images), std::move(hooks));
}

}  // namespace symrig

namespace symrig::sim {

namespace {

constexpr std::size_t kQuotedRequest = 60;

Error bad_request(std::string what) {
  return {ErrorCode::protocol, std::move(what), "see docs/pair-protocol.md"};
}

template <class T>
bool receive_one(rig::ClientTalk& talk, T& value) {
  return talk.receive(std::as_writable_bytes(std::span(&value, 1)));
}

class SimulatedPair final : public PairService {
 public:
  SimulatedPair(PairScene scene, Bench bench, std::size_t pair)
      : scene_(std::move(scene)),
        bench_(std::move(bench)),
        pair_(pair),
        images_(scene_.uri, *bench_.view, scene_.layout.tile(pair)) {}

  std::string facts() const override {
    return fmt::format("kind=simulated pair={} layout={} scene={}", pair_ + 1,
                       to_string(scene_.layout.layout), scene_.uri.to_string());
  }

  Result<bool> answer(const std::string& request, rig::ClientTalk& talk) override {
    const auto header = parse_develop(request);
    if (!header)
      return bad_request(fmt::format("'{}' is not 'develop PATTERNS EXPOSURES' with at most {} and {}",
                                     request.substr(0, kQuotedRequest), kMostPatterns, kMostExposures));
    std::vector<Pattern> patterns(header->patterns, Pattern(scene_.layout.cells));
    std::vector<LitPattern> lit(header->patterns);
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      if (!receive_one(talk, lit[i].shown_before) ||
          !talk.receive(std::as_writable_bytes(patterns[i].values())))
        return false;
      if (!std::ranges::all_of(patterns[i].values(), [](float v) { return v >= 0 && v <= 1; }))
        return bad_request(fmt::format("pattern {} has values that are not from 0 to 1", i + 1));
      lit[i].pattern = &patterns[i];
    }
    std::vector<LitExposure> exposures(header->exposures);
    for (LitExposure& exposure : exposures) {
      SYMRIG_TRY(const bool there, receive_exposure(talk, patterns.size(), exposure));
      if (!there) return false;
    }
    SYMRIG_TRY(const auto frames, images_.develop(lit, exposures));
    for (std::size_t k = 0; k < frames.size(); ++k)
      if (!send(k + 1, frames[k], talk)) return false;
    return true;
  }

 private:
  /// false: the host has gone.
  static Result<bool> receive_exposure(rig::ClientTalk& talk, std::size_t patterns, LitExposure& exposure) {
    ExposureHead head;
    if (!receive_one(talk, head)) return false;
    if (!(head.seconds > 0 && head.seconds <= kLongestExposure) || head.shares > kMostPatterns)
      return bad_request(fmt::format("an exposure of {} s with {} patterns", head.seconds, head.shares));
    exposure.seconds = head.seconds;
    exposure.noise = head.noise;
    for (std::uint64_t i = 0; i < head.shares; ++i) {
      ShareRecord record;
      if (!receive_one(talk, record)) return false;
      if (record.pattern >= patterns || !(record.share >= 0 && record.share <= 1))
        return bad_request(fmt::format("an exposure names pattern {} of {} with the share {}",
                                       record.pattern + 1, patterns, record.share));
      exposure.shares.push_back({static_cast<std::uint32_t>(record.pattern), record.share});
    }
    return true;
  }

  static bool send(std::size_t number, const CameraFrame& frame, rig::ClientTalk& talk) {
    const auto* light = std::any_cast<ImageFormation::Light>(&frame.attachment);
    const auto bytes =
        light == nullptr ? std::as_bytes(std::span(frame.raw)) : std::as_bytes((*light)->values());
    return talk.send(fmt::format("frame {} {}\n", number, bytes.size())) && talk.send(bytes);
  }

  PairScene scene_;
  Bench bench_;
  std::size_t pair_;
  LocalImages images_;
};

}  // namespace

}  // namespace symrig::sim

namespace symrig {

Result<std::unique_ptr<PairService>> make_simulated_pair(std::string_view uri, ViewLayout pairs,
                                                         std::size_t pair) {
  SYMRIG_TRY(sim::PairScene scene, sim::parse_pair_scene(uri, pairs));
  if (pair >= scene.layout.count())
    return Error{ErrorCode::bad_argument,
                 fmt::format("there is no pair {} in a layout of {}", pair + 1, to_string(pairs)),
                 fmt::format("give a pair from 1 to {}", scene.layout.count())};
  SYMRIG_TRY(auto bench, sim::make_bench(scene.uri));
  return std::unique_ptr<PairService>(
      std::make_unique<sim::SimulatedPair>(std::move(scene), std::move(bench), pair));
}

}  // namespace symrig
