// SPDX-License-Identifier: Apache-2.0
// Closes the loop in the guest. The light of the screen falls on a simulated scene and becomes frames of a
// test camera: of V4L2, or on the network. The camera exposes while the board's trigger line is high.
// README.md of the parent folder says what that proves.
#include "bench-vm/scene/controller_on_usb.hpp"
#include "bench-vm/scene/developer.hpp"
#include "bench-vm/scene/scene_camera.hpp"
#include "bench-vm/scene/watchers.hpp"

#include <csignal>
#include <cstdio>
#include <ctime>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace symrig::bench_vm {
namespace {

struct Options {
  std::string scene;
  std::string picture;
  std::string log;
  std::string gige, usb3, second_gige;
  std::int64_t second_drop_frame = -1;
  double packet_loss = 0;
  std::string planes;
  std::vector<std::string> controller_faults;
  int cell = 1, top = 0, left = 0;
  int picture_top = 0, picture_left = 0;
  double readout_ms = 3;
  double late_ms = 1e3 / 30;
  double jitter_us = 0;
  std::int64_t first_frame = 0;
  bool uncounted = false;
  FaultRates faults;

  /// Projector-camera pairs, side by side.
  std::size_t pairs() const { return second_gige.empty() ? 1 : 2; }
  /// The cells or pixels of one pair.
  Grid part_of(Grid whole) const { return {whole.rows, whole.cols / static_cast<int>(pairs())}; }
};

Nanoseconds nanoseconds_of(double value, double unit) {
  return Nanoseconds{static_cast<std::int64_t>(value * unit)};
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("scene", options.scene, "the scene in front of projector and camera: sim:NAME?...")
      ->required();
  app.add_option("--cell", options.cell, "screen pixels along the side of a cell")->capture_default_str();
  app.add_option("--top", options.top, "screen row of the first cell");
  app.add_option("--left", options.left, "screen column of the first cell");
  app.add_option("--picture", options.picture,
                 "ROWSxCOLUMNS of the test camera's picture, Y12 (default: the scene's camera)");
  app.add_option("--picture-top", options.picture_top, "picture row of the scene's first camera pixel");
  app.add_option("--picture-left", options.picture_left, "picture column of the scene's first camera pixel");
  app.add_option("--gige", options.gige,
                 "the camera is a GigE Vision camera at this address of the loopback network");
  app.add_option("--packet-loss", options.packet_loss, "share of that camera's packets that are lost");
  app.add_option("--usb3", options.usb3,
                 "the camera is a USB3 Vision camera on USB/IP with this serial number");
  app.add_option("--second-gige", options.second_gige,
                 "a second pair, right of the first: BENCH_VKMS_B is its projector, and its camera is a GigE "
                 "Vision camera at this address. Each pair has half of the columns");
  app.add_option("--second-drop-frame", options.second_drop_frame,
                 "number of a frame that the second camera loses");
  app.add_option("--planes", options.planes,
                 "an emulated controller on USB/IP, dlpc350 or dlpc900, shows the bit planes of the screen's "
                 "pictures");
  app.add_option(
      "--controller-fault", options.controller_faults,
      "KIND@EXPOSURES, such as reset@40: what goes wrong with it, so many exposures after its power "
      "came on. table: it changes an entry of its pattern table. reset: it loses its settings in a "
      "sequence. stall: it does not answer three commands. hang: it answers nothing");
  app.add_option("--readout", options.readout_ms, "ms from the end of an exposure to its frame")
      ->capture_default_str();
  app.add_option("--first-frame", options.first_frame, "number of the first frame, which selects its noise");
  app.add_option("--log", options.log, "file for the true exposures and deliveries, JSON lines");
  app.add_option("--drop", options.faults.drop, "share of frames that are lost");
  app.add_option("--drop-frame", options.faults.drop_frame, "number of a frame that is lost, from 0");
  app.add_flag("--uncounted", options.uncounted, "the camera's sequence numbers do not count lost frames");
  app.add_option("--duplicate", options.faults.duplicate, "share of frames that are delivered twice");
  app.add_option("--late", options.faults.late, "share of frames that are delivered and stamped late");
  app.add_option("--late-by", options.late_ms, "ms")->capture_default_str();
  app.add_option("--swap", options.faults.swap, "share of frames that are delivered after the next one");
  app.add_option("--damage", options.faults.damage, "share of frames with half of the data, marked damaged");
  app.add_option("--drop-trigger", options.faults.drop_trigger,
                 "share of triggers that the camera does not see");
  app.add_option("--jitter", options.jitter_us, "us, one sigma of the stamps");
  app.add_option("--fault-seed", options.faults.seed, "selects the faulty frames")->capture_default_str();
}

/// "ROWSxCOLUMNS", or the camera's size if the text is empty.
Result<Grid> picture_size(const std::string& text, Grid camera) {
  if (text.empty()) return camera;
  Grid picture{};
  char more = 0;
  // NOLINTNEXTLINE(cert-err34-c,cppcoreguidelines-pro-type-vararg): checked by valid() and the field count
  const int fields = std::sscanf(text.c_str(), "%dx%d%c", &picture.rows, &picture.cols, &more);
  if (fields == 2 && picture.valid()) return picture;
  return Error{ErrorCode::bad_argument, fmt::format("--picture cannot be '{}'", text),
               "give ROWSxCOLUMNS, such as 48x64"};
}

/// One device on USB/IP, one camera.
Result<void> check_devices(const Options& options) {
  const bool served = !options.usb3.empty(), planes = !options.planes.empty();
  if (served && (planes || !options.gige.empty()))
    return Error{ErrorCode::bad_argument, "--usb3 does not go together with --planes or --gige",
                 "give one of them"};
  if (planes && !options.second_gige.empty())
    return Error{ErrorCode::bad_argument, "--second-gige does not go together with --planes",
                 "give one of them"};
  if (planes || options.controller_faults.empty()) return {};
  return Error{ErrorCode::bad_argument, "--controller-fault needs a controller", "add --planes"};
}

/// Each pair has half of the cells, and a camera pixel for each.
Result<void> check_pairs(const Options& options, const SceneUri& uri, const sim::ImageFormation& formation) {
  const int pairs = static_cast<int>(options.pairs());
  if (pairs == 1 || (uri.size.cols % pairs == 0 && formation.camera() == uri.size)) return {};
  return Error{ErrorCode::bad_argument,
               "two pairs need an even number of columns, and a camera pixel for each cell",
               "change the scene's size, or remove its keys of a camera"};
}

Result<CameraHabits> habits_of(const Options& options) {
  CameraHabits habits;
  habits.first_frame = options.first_frame;
  habits.readout = nanoseconds_of(options.readout_ms, 1e6);
  habits.faults = options.faults;
  habits.faults.late_by = nanoseconds_of(options.late_ms, 1e6);
  habits.faults.jitter = nanoseconds_of(options.jitter_us, 1e3);
  habits.faults.counted = !options.uncounted;
  if (habits.faults.valid() && habits.readout.count() >= 0) return habits;
  return Error{ErrorCode::bad_argument, "shares of faults are from 0 to 1, and their sum is at most 1",
               "times are not negative"};
}

/// SIGTERM and SIGINT stop everything. SIGUSR1 unplugs the camera and SIGUSR2 plugs it in. SIGHUP cycles the
/// power of the controller of bit planes. Blocked in every thread that starts later.
class Signals {
 public:
  explicit Signals(Stage& stage) : stage_(stage) {
    sigemptyset(&known_);
    for (const int signal : {SIGTERM, SIGINT, SIGUSR1, SIGUSR2, SIGHUP}) sigaddset(&known_, signal);
    pthread_sigmask(SIG_BLOCK, &known_, nullptr);
  }
  /// controller: none if it is null.
  void run(SceneController* controller) {
    constexpr timespec kLookAgain{0, 100'000'000};
    while (!stage_.stopped()) {
      const int signal = sigtimedwait(&known_, nullptr, &kLookAgain);
      if (signal == SIGUSR1 || signal == SIGUSR2) stage_.plug_camera(signal == SIGUSR2);
      if (signal == SIGHUP && controller != nullptr) controller->cycle_power(stage_.exposures());
      if (signal == SIGTERM || signal == SIGINT) stage_.stop();
    }
  }

 private:
  Stage& stage_;
  sigset_t known_{};
};

/// Runs the watchers beside the developer until everything is stopped.
class Watching {
 public:
  Watching(Stage& stage, const std::vector<std::function<void()>>& watchers) : stage_(stage) {
    for (const auto& watcher : watchers) threads_.emplace_back(watcher);
  }
  Watching(const Watching&) = delete;
  Watching& operator=(const Watching&) = delete;
  ~Watching() { join(); }

  void join() {
    stage_.stop();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

 private:
  Stage& stage_;
  std::vector<std::thread> threads_;
};

Result<std::shared_ptr<SceneController>> serve_controller(const Options& options) {
  std::vector<ControllerFault> faults;
  for (const std::string& text : options.controller_faults) {
    SYMRIG_TRY(faults.emplace_back(), parse_controller_fault(text));
  }
  return SceneController::serve(options.planes, std::move(faults));
}

/// What lies between the screens and the scene: nothing, or a controller of bit planes.
struct ScreenWatch {
  std::vector<RefreshWatch> plain;
  std::shared_ptr<SceneController> controller;
  std::unique_ptr<PlaneWatch> planes;

  static Result<ScreenWatch> open(const Options& options, const BenchPlaces& places,
                                  const Placement& placement, Stage& stage) {
    ScreenWatch watch;
    if (!options.planes.empty()) {
      SYMRIG_TRY(watch.controller, serve_controller(options));
      const auto shown = [controller = watch.controller.get(), &stage] {
        return controller->next_refresh(stage.exposures());
      };
      SYMRIG_TRY(watch.planes, PlaneWatch::open(places, placement, shown, stage));
      return watch;
    }
    const std::size_t screens = options.pairs();
    watch.plain.reserve(screens);
    for (std::size_t screen = 0; screen < screens; ++screen) {
      SYMRIG_TRY(RefreshWatch plain, RefreshWatch::open(places, screen, placement, stage));
      watch.plain.push_back(std::move(plain));
    }
    return watch;
  }
  std::vector<std::function<void()>> watchers() {
    if (planes) return {[this] { planes->run(); }, [this] { planes->run_triggers(); }};
    std::vector<std::function<void()>> all;
    for (RefreshWatch& screen : plain) all.emplace_back([&screen] { screen.run(); });
    return all;
  }
  std::string report() const {
    if (planes)
      return fmt::format(
          "{} refreshes, {} missed; edges of planes at most {:.1f} us late; {} faults of the controller",
          planes->refreshes(), planes->missed(), 1e6 * seconds(planes->latest()), controller->faults());
    std::string text;
    for (const RefreshWatch& screen : plain)
      text += fmt::format("{}{} refreshes, {} missed",
                          text.empty() ? "" : "; second screen: ", screen.refreshes(), screen.missed());
    return text;
  }
};

void report(const TriggerWatch& trigger, const ScreenWatch& screen, const DeliveryTally& tally,
            const SceneCamera& camera) {
  fmt::print(
      "bench_scene: {} exposures, {} triggers too early, {} not seen, {} frames delivered, {} not taken, {} "
      "with a fault\n"
      "bench_scene: {}; strobe at most {:.1f} us after its trigger, exposures "
      "known "
      "to {:.1f} us\n",
      trigger.exposures(), trigger.missed(), trigger.unseen(), tally.delivered, tally.not_taken, tally.faults,
      screen.report(), 1e6 * seconds(trigger.slowest()), 1e6 * seconds(tally.largest_doubt));
  if (const std::string more = camera.report(); !more.empty()) fmt::print("bench_scene: {}\n", more);
}

Result<std::unique_ptr<SceneCamera>> open_camera(const Options& options, const CameraHabits& habits,
                                                 const sim::ImageFormation& formation, Grid camera) {
  if (!options.usb3.empty()) return open_usb3_camera({options.usb3, camera, habits.readout}, habits.faults);
  if (!options.gige.empty())
    return open_gige_camera({options.gige, camera, habits.readout, options.packet_loss}, habits.faults);
  SYMRIG_TRY(const Grid size, picture_size(options.picture, camera));
  return open_v4l2_camera({size, camera, options.picture_top, options.picture_left,
                           static_cast<std::uint16_t>(formation.noise().pedestal())});
}

/// All cameras, as one. whole: all pixels.
Result<std::unique_ptr<SceneCamera>> open_cameras(const Options& options, const CameraHabits& habits,
                                                  const sim::ImageFormation& formation, Grid whole) {
  const Grid each = options.part_of(whole);
  SYMRIG_TRY(auto first, open_camera(options, habits, formation, each));
  if (options.pairs() == 1) return first;
  SYMRIG_TRY(auto second, open_gige_camera({options.second_gige, each, habits.readout, 0}, FaultRates{}));
  std::optional<std::uint64_t> lost;
  if (options.second_drop_frame >= 0) lost = static_cast<std::uint64_t>(options.second_drop_frame);
  return pair_cameras(std::move(first), std::move(second), each, lost);
}

Result<void> close_loop(const Options& options) {
  SYMRIG_TRY(const SceneUri uri, parse_scene_uri(options.scene));
  if (uri.channels != 1 || !uri.camera_noise)
    return Error{ErrorCode::bad_argument, "the test camera is grey and has noise",
                 "remove the keys channels and noise"};
  SYMRIG_CHECK(check_devices(options));
  SYMRIG_TRY(const CameraHabits habits, habits_of(options));
  SYMRIG_TRY(const auto bench, sim::make_bench(uri));
  const sim::ImageFormation formation(uri, *bench.view);
  SYMRIG_TRY(const BenchPlaces places, BenchPlaces::from_environment());
  SYMRIG_CHECK(check_pairs(options, uri, formation));
  Stage stage(options.pairs());
  Signals signals(stage);  // before any thread: the camera has one, too
  SYMRIG_TRY(TriggerWatch trigger, TriggerWatch::open(places, habits.readout, habits.faults, stage));
  SYMRIG_TRY(ScreenWatch screen,
             ScreenWatch::open(options, places,
                               {options.part_of(uri.size), options.cell, options.top, options.left}, stage));
  SYMRIG_TRY(const auto camera, open_cameras(options, habits, formation, formation.camera()));
  SYMRIG_TRY(TruthLog log, TruthLog::open(options.log));
  Developer developer(formation, stage, *camera, habits, std::move(log));
  std::vector<std::function<void()>> watchers = screen.watchers();
  watchers.emplace_back([&] { signals.run(screen.controller.get()); });
  watchers.emplace_back([&trigger] { trigger.run(); });
  Watching watching(stage, watchers);
  fmt::print(stderr, "bench_scene: ready, {}\n", uri.to_string());  // unbuffered: a job waits for it
  SYMRIG_TRY(const DeliveryTally tally, developer.run());
  watching.join();
  report(trigger, screen, tally, *camera);
  if (const auto failure = stage.failure()) return *failure;
  return {};
}

}  // namespace
}  // namespace symrig::bench_vm

int main(int argc, char** argv) {
  try {
    CLI::App app(
        "Closes the loop in the guest: screen -> scene -> camera, exposed by the board's trigger line.");
    app.footer(
        "Signals: USR1 unplugs the camera, USR2 plugs it in again, HUP cycles the controller's power, TERM "
        "ends.");
    symrig::bench_vm::Options options;
    symrig::bench_vm::add_options(app, options);
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      return app.exit(error) == 0 ? 0 : symrig::exit_code(symrig::ErrorCode::bad_argument);
    }
    const auto closed = symrig::bench_vm::close_loop(options);
    if (closed) return 0;
    fmt::print(stderr, "bench_scene: {}\n", closed.error().line());
    return symrig::exit_code(closed.error().code);
  } catch (const std::exception& error) {  // memory
    static_cast<void>(std::fputs(error.what(), stderr));
    return symrig::exit_code(symrig::ErrorCode::limit);
  }
}
