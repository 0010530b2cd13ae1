// SPDX-License-Identifier: Apache-2.0
// Thousands of triggers over a network that loses packets, with a camera that makes mistakes and restarts:
// the driver and the ledger together, against the truth that each picture carries.
#include "assert_ok.hpp"
#include "gige/gige_camera.hpp"
#include "rig/evidence.hpp"
#include "symrig/camera/internal/genicam_camera.hpp"
#include "symrig/rig/camera_ledger.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace symrig::genicam_campaign_test {
namespace {

using namespace std::chrono_literals;
using camera::GenicamCamera;
using camera::GenicamSettings;
using gige::CameraTraits;
using gige::GigeCamera;
using gige::Mishap;

constexpr std::size_t kFrames = 4, kPhotographs = 4;  // of one run
constexpr Nanoseconds kShortest = 100us, kGap = 4ms, kPatience = 150ms, kLinger = 20ms;

/// What a camera can tell of its frames.
struct Kind {
  const char* name;
  bool chunks, clock;
};

struct Tally {
  std::int64_t exposed = 0, unsent = 0, delivered = 0, damaged = 0, missing = 0, overflowed = 0;
  std::int64_t photographs = 0, taken = 0, wrong = 0, reboots = 0, losses = 0;
  FrameCounts verdicts;
};

/// An exposure that the board asked for. None: the camera did not see the trigger.
struct Asked {
  Nanoseconds width{};
  std::optional<std::uint32_t> counter;
};

CameraTraits faulty(const Kind& kind) {
  CameraTraits traits;
  traits.packet_loss = 0.01;
  traits.has_chunks = kind.chunks;
  traits.has_clock = kind.clock;
  // If a camera has nothing but ids, nobody can see that it swapped two frames before it numbered them.
  traits.ids_when_sent = kind.chunks || kind.clock;
  return traits;
}

class Campaign {
 public:
  explicit Campaign(const Kind& kind) : kind_(kind), device_(faulty(kind), gige::numbered_scene) {}

  /// Opens the camera, and takes guard frames as a rig does.
  void open();
  /// One run of the board: photographs of a bracket each. reboot_at: the exposure before which the camera
  /// restarts.
  void run(std::size_t photographs, bool faults, std::optional<std::size_t> reboot_at = {});
  /// Ends the stream after a frame without a mishap, and compares the driver's account with the truth.
  void close();
  /// Waits until the driver reports that the camera is gone.
  void lose();
  void lock();

  const Tally& tally() const { return tally_; }

 private:
  GenicamSettings settings() const;
  Mishap roll();
  void drain();
  void expose(std::size_t k, Mishap mishap);
  RunIdentity judge(std::span<const CameraFrame> frames);
  void check(const RunIdentity& identity, std::span<const CameraFrame> frames);
  bool is_wrong(const CameraFrame& frame, std::size_t exposure) const;
  static bool arrived(std::span<const CameraFrame> frames, const Asked& asked);

  Kind kind_;
  GigeCamera device_;
  CameraLedger ledger_;
  std::unique_ptr<GenicamCamera> camera_;
  std::mt19937 random_{11};  // NOLINT: the same faults each time
  NoiseModel noise_ = NoiseModel::from_variance_line({.offset = 4, .slope = 1, .bits = 16, .pedestal = 0});
  Nanoseconds now_ = 1h;
  std::uint32_t counter_ = 0;              // of the camera
  std::int64_t exposed_ = 0, unsent_ = 0;  // since the camera was opened
  std::vector<SeenExposure> exposures_;    // of this run
  std::vector<Asked> asked_;
  Tally tally_;
};

GenicamSettings Campaign::settings() const {
  GenicamSettings settings;
  settings.device = device_.address();
  settings.format = "Mono16";
  if (kind_.clock) settings.stamp = StampOf::exposure_end;
  return settings;
}

void Campaign::open() {
  auto opened = GenicamCamera::open(settings());
  ASSERT_OK(opened);
  camera_ = *std::move(opened);
  ledger_.restart();
  exposed_ = unsent_ = 0;
  run(1, false);
  lock();
}

void Campaign::lock() {
  for (int tries = 0; ledger_.needs_guards(); ++tries) {
    ASSERT_LT(tries, 60) << "the ledger does not lock";
    run(1, true);
  }
}

/// 0.5 % of each mishap.
Mishap Campaign::roll() {
  constexpr std::array kMishaps{Mishap::trigger_dropped, Mishap::frame_dropped, Mishap::swapped,
                                Mishap::late};
  const auto roll = static_cast<std::size_t>(random_() % 200);
  return roll < kMishaps.size() ? kMishaps[roll] : Mishap::none;
}

void Campaign::expose(std::size_t k, Mishap mishap) {
  const Nanoseconds width = kShortest * (1 << 2 * (k % kFrames));
  const SteadyTime begin{now_}, end{now_ + width};
  now_ += width + kGap;
  Asked asked{width, {}};
  if (device_.pulse(width, mishap, end.since)) {
    asked.counter = ++counter_;
    ++exposed_;
    unsent_ += mishap == Mishap::frame_dropped ? 1 : 0;
  }
  exposures_.push_back({begin, end, 50us});
  asked_.push_back(asked);
}

/// Frames that come after their run belong to no photograph.
void Campaign::drain() {
  exposures_.clear();
  asked_.clear();
  const auto late = camera_->take(0, 0ns);
  ASSERT_OK(late);
  if (!late->empty()) judge(*late);
}

RunIdentity Campaign::judge(std::span<const CameraFrame> frames) {
  std::vector<SeenFrame> seen;
  for (const CameraFrame& frame : frames) seen.push_back(camera_evidence(frame, noise_));
  RunIdentity identity = ledger_.judge(exposures_, seen);
  tally_.verdicts += identity.counts;
  check(identity, frames);
  return identity;
}

void Campaign::run(std::size_t photographs, bool faults, std::optional<std::size_t> reboot_at) {
  drain();
  const bool locked = !ledger_.needs_guards();
  for (std::size_t k = 0; k < photographs * kFrames; ++k) {
    if (k == reboot_at) {
      device_.reboot();
      counter_ = 0;
    }
    expose(k, faults ? roll() : Mishap::none);
  }
  auto frames = camera_->take(exposures_.size(), kPatience);
  if (!frames) frames = std::vector<CameraFrame>();  // the camera is gone
  if (frames->size() >= exposures_.size())
    if (auto more = camera_->take(1, kLinger)) std::ranges::move(*more, std::back_inserter(*frames));
  const RunIdentity identity = judge(*frames);
  if (!locked) return;
  for (std::size_t i = 0; i < photographs; ++i) {
    bool believed = true, wrong = false;
    for (std::size_t j = i * kFrames; j < (i + 1) * kFrames; ++j) {
      believed = believed && identity.frame[j];
      wrong = wrong || (identity.frame[j] && is_wrong((*frames)[*identity.frame[j]], j));
    }
    ++tally_.photographs;
    tally_.taken += believed ? 1 : 0;
    tally_.wrong += believed && wrong ? 1 : 0;
  }
}

bool Campaign::is_wrong(const CameraFrame& frame, std::size_t exposure) const {
  const Asked& asked = asked_[exposure];
  return !asked.counter || frame.damaged || !gige::shows(frame.raw, *asked.counter, asked.width);
}

bool Campaign::arrived(std::span<const CameraFrame> frames, const Asked& asked) {
  return std::ranges::any_of(frames, [&asked](const CameraFrame& frame) {
    return !frame.damaged && gige::shows(frame.raw, *asked.counter, asked.width);
  });
}

/// Each exposure whose picture did not come whole has a word: the exposure is missing, or a frame that claims
/// it is damaged or has another verdict than certain. A guard is never used.
void Campaign::check(const RunIdentity& identity, std::span<const CameraFrame> frames) {
  const auto lost = std::ranges::count_if(
      asked_, [&](const Asked& asked) { return asked.counter && !arrived(frames, asked); });
  std::int64_t named = identity.counts.missing;
  for (std::size_t k = 0; k < frames.size(); ++k)
    named += frames[k].damaged || identity.frames[k] > Verdict::guard ? 1 : 0;
  EXPECT_GE(named, lost) << kind_.name << ": " << identity.counts.trouble();
  tally_.losses += lost;
}

void Campaign::close() {
  for (int tries = 0;; ++tries) {
    ASSERT_LT(tries, 20) << "no frame arrives";
    drain();
    expose(0, Mishap::none);
    const auto frames = camera_->take(1, 2s);
    ASSERT_OK(frames);
    judge(*frames);
    if (arrived(*frames, asked_.front())) break;
  }
  const StreamReport report = camera_->report();
  // Without a trigger counter, the camera's ids do not show the triggers that it sent no frame for.
  const std::int64_t countable = exposed_ - (kind_.chunks ? 0 : unsent_);
  const auto named = static_cast<std::int64_t>(report.delivered + report.missing + report.overflowed);
  EXPECT_GE(named, countable) << kind_.name << ": " << report.to_string();
  // A damaged frame has no counter. Its id places it, which may be beside its place.
  EXPECT_LE(named, countable + static_cast<std::int64_t>(report.damaged))
      << kind_.name << ": " << report.to_string();
  tally_.exposed += exposed_;
  tally_.unsent += unsent_;
  tally_.delivered += static_cast<std::int64_t>(report.delivered);
  tally_.damaged += static_cast<std::int64_t>(report.damaged);
  tally_.missing += static_cast<std::int64_t>(report.missing);
  tally_.overflowed += static_cast<std::int64_t>(report.overflowed);
  exposed_ = unsent_ = 0;
}

void Campaign::lose() {
  for (int tries = 0; tries < 60; ++tries) {
    const auto frames = camera_->take(1, 1s);
    if (frames) continue;
    EXPECT_EQ(frames.error().code, ErrorCode::device_lost) << frames.error().line();
    EXPECT_NE(frames.error().line().find(device_.address()), std::string::npos) << frames.error().line();
    ++tally_.reboots;
    camera_.reset();
    return;
  }
  FAIL() << "nothing told that the camera is gone";
}

class GenicamCampaign : public testing::TestWithParam<Kind> {};

/// 600 triggers and a restart. SYMRIG_LONG: 10,000 and 10.
TEST_P(GenicamCampaign, no_photograph_has_a_wrong_frame_and_each_loss_is_named) {
  const bool complete = std::getenv("SYMRIG_LONG") != nullptr;
  const int sessions = complete ? 11 : 2;
  const std::int64_t each = complete ? 10'000 / sessions + 1 : 300;
  Campaign campaign(GetParam());
  for (int session = 0; session < sessions; ++session) {
    campaign.open();
    const std::int64_t before = campaign.tally().photographs;
    while (static_cast<std::int64_t>(kFrames) * (campaign.tally().photographs - before) < each) {
      campaign.lock();
      campaign.run(kPhotographs, true);
      ASSERT_FALSE(testing::Test::HasFatalFailure());
    }
    campaign.close();
    ASSERT_FALSE(testing::Test::HasFatalFailure());
    if (session + 1 == sessions) break;
    campaign.run(kPhotographs, true, 7);
    campaign.lose();
    ASSERT_FALSE(testing::Test::HasFatalFailure());
  }
  const Tally& tally = campaign.tally();
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_EQ(tally.reboots, sessions - 1);
  EXPECT_GT(tally.taken, tally.photographs / 3);
  std::printf(
      "%s: %d exposures; %d frames, %d damaged, %d missing, %d overflowed; %d never sent; %d restarts\n",
      GetParam().name, static_cast<int>(tally.exposed), static_cast<int>(tally.delivered),
      static_cast<int>(tally.damaged), static_cast<int>(tally.missing), static_cast<int>(tally.overflowed),
      static_cast<int>(tally.unsent), static_cast<int>(tally.reboots));
  std::printf("  %d of %d photographs taken at once, %d wrong; %d losses; ledger: %s\n",
              static_cast<int>(tally.taken), static_cast<int>(tally.photographs),
              static_cast<int>(tally.wrong), static_cast<int>(tally.losses),
              tally.verdicts.trouble().c_str());
}

INSTANTIATE_TEST_SUITE_P(Cameras, GenicamCampaign,
                         testing::Values(Kind{"counter_and_clock", true, true},
                                         Kind{"clock_only", false, true}, Kind{"counter_only", true, false},
                                         Kind{"ids_only", false, false}),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace symrig::genicam_campaign_test
