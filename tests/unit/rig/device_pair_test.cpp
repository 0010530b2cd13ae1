// SPDX-License-Identifier: Apache-2.0
// Cameras and projectors behind sockets: the rig's own machinery does not notice.
#include "assert_ok.hpp"
#include "faulty_devices.hpp"
#include "scratch.hpp"
#include "symrig/rig/pair_link.hpp"
#include "symrig/rig/pairs.hpp"
#include "symrig/sim/simulated_pairs.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/testing/probe_laws.hpp"

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace symrig::device_pair_test {
namespace {

using namespace std::chrono_literals;
using probe_laws::law_pattern;

constexpr ViewLayout kSideBySide{1, 2};

/// A pair of devices that serves in a thread until it is destroyed.
class ServedDevices {
 public:
  ServedDevices(RigDevices devices, std::size_t pair, const std::string& place) {
    auto server = PairServer::open(serve_devices(std::move(devices), kSideBySide, pair), place, "");
    EXPECT_TRUE(server.ok()) << server.error().line();
    server_ = std::make_unique<PairServer>(*std::move(server));
    thread_ = std::thread([this] { server_->run([this] { return !end_; }); });
  }
  ServedDevices(const ServedDevices&) = delete;
  ServedDevices& operator=(const ServedDevices&) = delete;
  ~ServedDevices() {
    end_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> end_ = false;
  std::unique_ptr<PairServer> server_;
  std::thread thread_;
};

/// What the projectors of both pairs show together, on the projector of the simulated rig.
struct Wall {
  PairLayout layout;
  Projector* whole = nullptr;
  std::mutex mutex;
  std::vector<std::vector<Pattern>> parts;  // of each pair, until all have come

  Result<void> load(std::size_t pair, std::span<const Pattern> patterns) {
    const std::scoped_lock lock(mutex);
    parts.resize(layout.count());
    parts[pair].assign(patterns.begin(), patterns.end());
    for (const auto& part : parts)
      if (part.size() != patterns.size()) return {};
    std::vector<Pattern> all(patterns.size(), Pattern(layout.cells));
    for (std::size_t k = 0; k < parts.size(); ++k)
      for (std::size_t i = 0; i < all.size(); ++i) paste(parts[k][i], layout.tile(k), all[i]);
    parts.clear();
    return whole->load(all);
  }
};

class PartOfWall final : public Projector {
 public:
  PartOfWall(std::shared_ptr<Wall> wall, std::size_t pair) : wall_(std::move(wall)), pair_(pair) {}
  Grid grid() const override { return wall_->layout.tile(pair_).grid; }
  Nanoseconds refresh_period() const override { return 16'666'667ns; }
  Result<void> load(std::span<const Pattern> patterns) override { return wall_->load(pair_, patterns); }
  std::string describe() const override { return "a part"; }

 private:
  std::shared_ptr<Wall> wall_;
  std::size_t pair_;
};

/// All devices of the pairs behind sockets; the board and the shutters are in this process.
struct Bench {
  test::Scratch folder;
  std::shared_ptr<Wall> wall = std::make_shared<Wall>();
  std::vector<std::unique_ptr<Camera>> cameras;
  std::vector<std::unique_ptr<ServedDevices>> servers;
  std::vector<RigDevices> linked;

  std::string place(std::size_t pair) const { return "unix:" + (folder / std::to_string(pair)).string(); }

  void serve(std::size_t pair) {
    RigDevices own;
    own.camera = [this, pair]() -> Result<std::unique_ptr<Camera>> {
      return std::unique_ptr<Camera>(std::make_unique<test::OtherCamera>(*cameras[pair]));
    };
    own.projector = [this, pair]() -> Result<std::unique_ptr<Projector>> {
      return std::unique_ptr<Projector>(std::make_unique<PartOfWall>(wall, pair));
    };
    servers[pair] = std::make_unique<ServedDevices>(own, pair, place(pair));
  }

  SimulatedPairHooks hooks() {
    SimulatedPairHooks all;
    all.camera = [this](std::size_t pair, std::unique_ptr<Camera> camera) -> std::unique_ptr<Camera> {
      const bool first = pair >= cameras.size();
      if (first) {
        cameras.push_back(std::move(camera));
        servers.emplace_back();
        serve(pair);
        linked.push_back(linked_devices({*DeviceUri::parse(place(pair)), ""}, kSideBySide, pair,
                                        wall->layout.tile(pair).grid, {}));
      }
      auto opened = linked[pair].camera();
      EXPECT_TRUE(opened.ok()) << opened.error().line();
      return *std::move(opened);
    };
    all.projector = [this](Projector& whole) -> Result<std::unique_ptr<Projector>> {
      wall->whole = &whole;
      std::vector<std::unique_ptr<Projector>> parts;
      for (const RigDevices& one : linked) {
        SYMRIG_TRY(auto part, one.projector());
        parts.push_back(std::move(part));
      }
      return join_projectors(std::move(parts), wall->layout);
    };
    all.options = [](RigOptions& options) { options.pause = [](Nanoseconds) {}; };
    return all;
  }
};

std::vector<Pattern> three_patterns(Grid grid) {
  return {law_pattern(grid, 1), Pattern(grid, 1, 1.F), law_pattern(grid, 2)};
}

void expect_equal(const Result<std::vector<Radiance>>& a, const Result<std::vector<Radiance>>& b) {
  ASSERT_OK(a);
  ASSERT_OK(b);
  for (std::size_t i = 0; i < a->size(); ++i) {
    EXPECT_EQ((*a)[i].mean, (*b)[i].mean) << i;
    EXPECT_EQ((*a)[i].variance, (*b)[i].variance) << i;
    EXPECT_EQ((*a)[i].valid, (*b)[i].valid) << i;
  }
}

TEST(DevicePair, cameras_and_projectors_behind_sockets_take_the_same_photographs) {
  for (const std::string uri :
       {"sim:views2?size=24x20", "sim:views2?size=24x20&exposures=3&channels=3&dead=0.05"}) {
    Bench bench;
    bench.wall->layout = {kSideBySide, {24, 20}};
    const auto pairs = open_simulated_pairs(uri, kSideBySide, bench.hooks());
    ASSERT_OK(pairs);
    const auto alone = open_virtual_rig(uri);
    ASSERT_OK(alone);
    const auto patterns = three_patterns({24, 20});
    for (int time = 0; time < 3; ++time)
      expect_equal((*pairs)->measure(patterns), (*alone)->measure(patterns));
  }
}

/// The server of a pair ends and comes back: the connection is made again, and all pairs repeat.
TEST(DevicePair, a_lost_server_is_connected_again) {
  Bench bench;
  bench.wall->layout = {kSideBySide, {24, 20}};
  const auto pairs = open_simulated_pairs("sim:views2?size=24x20", kSideBySide, bench.hooks());
  ASSERT_OK(pairs);
  const auto patterns = three_patterns({24, 20});
  ASSERT_OK((*pairs)->measure(patterns));
  bench.servers[1].reset();
  bench.serve(1);
  const auto seen = (*pairs)->measure(patterns);
  ASSERT_OK(seen);
  EXPECT_GE((*pairs)->rig().trouble().projectors_reopened + (*pairs)->rig().trouble().cameras_reopened, 1);
}

/// A camera without light, and a screen that keeps what it shows.
class DarkCamera final : public Camera {
 public:
  Grid grid() const override { return {2, 3}; }
  int channels() const override { return 1; }
  CameraTiming timing() const override { return {1ms, 2s, 5ms, 30us, 2ms}; }
  const NoiseModel& noise() const override { return noise_; }
  const Image<std::uint8_t>* dead() const override { return nullptr; }
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds /*patience*/) override {
    if (count == 7) return Error{ErrorCode::device_lost, "the camera was unplugged", "plug it in"};
    std::vector<CameraFrame> frames(count);
    for (CameraFrame& frame : frames) frame.raw.assign(6, 64);
    if (!frames.empty()) frames.back().damaged = true;
    if (!frames.empty()) frames.back().raw.clear();
    return frames;
  }
  std::string describe() const override { return "dark"; }

 private:
  NoiseModel noise_ = NoiseModel::from_electrons({});
};

class Screen final : public Projector {
 public:
  Grid grid() const override { return {2, 3}; }
  Nanoseconds refresh_period() const override { return 10ms; }
  Pacing pacing() const override { return Pacing::host; }
  Result<void> load(std::span<const Pattern> /*patterns*/) override { return {}; }
  Result<Shown> show(std::size_t index) override { return Shown{index + 5, {1ms}, true}; }
  std::string describe() const override { return "a screen"; }
};

RigDevices dark_devices() {
  RigDevices devices;
  devices.camera = []() -> Result<std::unique_ptr<Camera>> {
    return std::unique_ptr<Camera>(std::make_unique<DarkCamera>());
  };
  devices.projector = []() -> Result<std::unique_ptr<Projector>> {
    return std::unique_ptr<Projector>(std::make_unique<Screen>());
  };
  return devices;
}

TEST(DevicePair, tells_all_of_its_devices) {
  const test::Scratch folder;
  const std::string place = "unix:" + (folder / "socket").string();
  const ServedDevices served(dark_devices(), 1, place);
  const PairAddress address{*DeviceUri::parse(place), ""};
  const RigDevices linked = linked_devices(address, kSideBySide, 1, {2, 3}, {});
  const auto camera = linked.camera();
  ASSERT_OK(camera);
  const auto screen = linked.projector();
  ASSERT_OK(screen);
  EXPECT_EQ((*camera)->noise(), NoiseModel::from_electrons({}));
  EXPECT_EQ((*camera)->timing().max_exposure, 2s);
  EXPECT_EQ((*camera)->timing().trigger_delay, 30us);
  EXPECT_EQ((*camera)->timing().overlap, 2ms);
  EXPECT_EQ((*screen)->pacing(), Pacing::host);
  const auto frames = (*camera)->take(3, 0s);
  ASSERT_OK(frames);
  ASSERT_EQ(frames->size(), 3U);
  EXPECT_EQ(frames->front().raw, std::vector<std::uint16_t>(6, 64));
  EXPECT_EQ(frames->front().stamp_of, StampOf::nothing);
  EXPECT_TRUE(frames->back().damaged);
  const Pattern pattern({2, 3});
  ASSERT_OK((*screen)->load({&pattern, 1}));
  const auto shown = (*screen)->show(0);
  ASSERT_OK(shown);
  EXPECT_EQ(shown->refresh, 5U);
  EXPECT_GT(shown->since.since, 1ms) << "this computer's clock";
  ASSERT_OK((*screen)->check());

  const auto unloaded = (*screen)->show(1);
  ASSERT_FALSE(unloaded.ok());
  EXPECT_EQ(unloaded.error().code, ErrorCode::device_lost) << "the rig then loads again";
  EXPECT_EQ((*camera)->take(1, 0s).error().code, ErrorCode::device_lost) << "until it is opened again";
  const auto again = linked.camera();
  ASSERT_OK(again);
  const auto unplugged = (*again)->take(7, 0s);
  ASSERT_FALSE(unplugged.ok());
  EXPECT_EQ(unplugged.error().code, ErrorCode::device_lost);
  EXPECT_NE(unplugged.error().what.find("the camera was unplugged"), std::string::npos);
}

TEST(DevicePair, another_place_or_grid_is_refused) {
  const test::Scratch folder;
  const std::string place = "unix:" + (folder / "socket").string();
  const ServedDevices served(dark_devices(), 1, place);
  const PairAddress address{*DeviceUri::parse(place), ""};
  EXPECT_EQ(linked_devices(address, kSideBySide, 0, {2, 3}, {}).camera().error().code,
            ErrorCode::bad_argument);
  EXPECT_EQ(linked_devices(address, {2, 1}, 1, {2, 3}, {}).camera().error().code, ErrorCode::bad_argument);
  EXPECT_EQ(linked_devices(address, kSideBySide, 1, {4, 3}, {}).camera().error().code,
            ErrorCode::size_mismatch);
  for (const char* const request :
       {"take 99999999 0\n", "load 0\n", "load 5000\n", "take 1\n", "show -1\n", "nonsense\n"}) {
    auto one = PairLink::open(address);
    ASSERT_OK(one);
    ASSERT_OK((*one)->send(std::string_view(request)));
    EXPECT_EQ((*one)->receive_line().error().code, ErrorCode::device_refused) << request;
  }
}

}  // namespace
}  // namespace symrig::device_pair_test
