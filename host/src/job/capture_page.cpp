// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/capture_page.hpp"

#include "symrig/base/progress.hpp"
#include "symrig/job/evaluation.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/viewer/live.hpp"

#include <atomic>
#include <csignal>
#include <thread>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr Nanoseconds kStatusEvery{100'000'000}, kPhotographEvery{500'000'000};
/// A page asks every half second, or every second if it is in the background.
constexpr Nanoseconds kWatches{3'000'000'000}, kMostFarewell{5'000'000'000};
constexpr Nanoseconds kGlanceAtPage{20'000'000};
constexpr Nanoseconds kOthers{600'000'000};  // for the reply on its way, and for other pages

/// Signals go to the thread that captures: its system calls must end when they come.
std::thread thread_without_signals(std::function<void()> work) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread thread(std::move(work));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

/// Runs on the capturing thread.
class Reporter {
 public:
  Reporter(LiveScene& scene, const OpenedRig& rig) : scene_(scene), rig_(rig) {}

  void progress(const ProgressEvent& event) {
    to_go_.report(event, scene_.seconds());
    const bool new_stage = event.stage != stage_;
    if (!status_due_.passed() && !new_stage) return;
    status_due_ = Deadline(kStatusEvery);
    stage_ = event.stage;
    const RigTrouble trouble = rig_.trouble();
    scene_.show(LiveStatus{.stage = stage_,
                           .done = event.done,
                           .expected = event.expected,
                           .steps = event.steps,
                           .computing = event.computing,
                           .frames = cost_.frames,
                           .rig_seconds = cost_.rig_seconds,
                           .to_go = to_go_.seconds(),
                           .lost_frames = lost_frames(trouble.frames),
                           .trouble = trouble_lines(trouble)});
  }

  void see(const ProbeCost& cost, std::span<const Pattern> patterns, std::span<const Radiance> photographs) {
    cost_ = cost;
    if (!photograph_due_.passed()) return;
    photograph_due_ = Deadline(kPhotographEvery);
    scene_.show(LivePhotograph{patterns.back(), photographs.back().mean});
  }

  void snapshot(const CaptureSnapshot& found) {
    std::optional<LiveLevel> level;
    if (found.step)
      level = LiveLevel{found.step->level, found.step->patterns, found.step->error, found.half_width};
    scene_.show(level, found.tensor);
  }

 private:
  LiveScene& scene_;
  const OpenedRig& rig_;
  ProbeCost cost_;
  std::string stage_;
  TimeToGo to_go_;
  Deadline status_due_{Nanoseconds{0}}, photograph_due_{Nanoseconds{0}};
};

}  // namespace

class CapturePage::ServedScene {
 public:
  ServedScene(std::shared_ptr<LiveScene> scene, ViewServer server)
      : scene_(std::move(scene)),
        server_(std::move(server)),
        thread_(thread_without_signals([this] { server_.run([this] { return !ended_; }); })) {}
  ServedScene(const ServedScene&) = delete;
  ServedScene& operator=(const ServedScene&) = delete;
  ~ServedScene() {
    ended_ = true;
    thread_.join();
  }

  LiveScene& scene() const { return *scene_; }
  std::string address() const { return server_.address(); }

 private:
  std::shared_ptr<LiveScene> scene_;
  ViewServer server_;
  std::atomic<bool> ended_ = false;
  std::thread thread_;  // the last member: it uses the others
};

CapturePage::CapturePage(std::unique_ptr<ServedScene> served) : served_(std::move(served)) {}
CapturePage::CapturePage(CapturePage&&) noexcept = default;
CapturePage& CapturePage::operator=(CapturePage&&) noexcept = default;
CapturePage::~CapturePage() = default;

Result<CapturePage> CapturePage::open(const OpenedRig& rig, ViewOptions options) {
  const Probe& probe = *rig.probe;
  if (probe.channels() != 1 && probe.channels() != 3)
    return Error{ErrorCode::bad_value,
                 fmt::format("the rig has {} channels; the page shows 1 or 3", probe.channels()),
                 "capture without the page"};
  auto scene = std::make_shared<LiveScene>(probe.grid(), probe.channels(), probe.views());
  SYMRIG_TRY(ViewServer server, ViewServer::open(scene, std::move(options)));
  return CapturePage(std::make_unique<ServedScene>(std::move(scene), std::move(server)));
}

std::string CapturePage::address() const {
  return served_->address();
}

CaptureJob CapturePage::watched(CaptureJob job, const OpenedRig& rig) const {
  const auto reporter = std::make_shared<Reporter>(served_->scene(), rig);
  job.see = [reporter](const ProbeCost& cost, std::span<const Pattern> patterns,
                       std::span<const Radiance> photographs) { reporter->see(cost, patterns, photographs); };
  job.options.watch = [reporter](const CaptureSnapshot& found) { reporter->snapshot(found); };
  job.options.progress = [reporter, told = std::move(job.options.progress)](const ProgressEvent& event) {
    reporter->progress(event);
    return !told || told(event);
  };
  return job;
}

void CapturePage::complete(const CaptureOutcome& outcome) const {
  StoredScene scene{outcome.result.tensor, outcome.json, outcome.result.held_out, outcome.camera};
  auto truth = true_transport_of(scene);
  served_->scene().complete(std::move(scene), std::move(truth));
}

void CapturePage::fail(std::string line) const {
  LiveScene& scene = served_->scene();
  const bool watched = scene.watched_within(kWatches);
  scene.fail(std::move(line));
  if (!watched) return;
  for (const Deadline deadline(kMostFarewell); !deadline.passed() && !scene.failure_told();)
    std::this_thread::sleep_for(kGlanceAtPage);
  std::this_thread::sleep_for(kOthers);
}

}  // namespace symrig
