// SPDX-License-Identifier: Apache-2.0

#include "symrig/rig/frame_taker.hpp"

#include "rig/bracket_taker.hpp"
#include "rig/exposure_choice.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/hdr/sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {

namespace {

using namespace std::chrono_literals;

Result<void> check_codes(const CameraFrame& frame, Grid grid) {
  if (frame.raw.empty())
    return Error{ErrorCode::bad_argument, "the camera gives light and no codes, so it has no noise",
                 "give a rig whose camera has noise: remove noise=off"};
  if (std::ssize(frame.raw) == grid.size()) return {};
  return Error{ErrorCode::bad_argument,
               fmt::format("the camera gives {} codes for {} pixels", frame.raw.size(), grid.size()),
               "give a camera with one code for each pixel: remove channels=3"};
}

}  // namespace

FrameTaker::FrameTaker(RigOptions options) : options_(std::move(options)) {}

FrameTaker::~FrameTaker() = default;

Result<std::unique_ptr<FrameTaker>> FrameTaker::open(RigParts parts) {
  std::unique_ptr<FrameTaker> frames(new FrameTaker(std::move(parts.options)));
  RigOptions& options = frames->options_;
  frames->taker_ =
      std::make_unique<BracketTaker>(std::make_unique<DeviceSet>(std::move(parts.devices), options), options);
  SYMRIG_CHECK(frames->taker_->open());
  rig::adopt_timing(options, frames->taker_->camera().timing());
  SYMRIG_TRY(frames->timing_, frames->taker_->timing());
  return frames;
}

Result<RawFrames> FrameTaker::take(const Pattern& pattern, const Exposures& exposures) {
  SYMRIG_TRY(auto taken, taker_->take({&pattern, 1}, {&exposures, 1}));
  for (const CameraFrame& frame : taken.front().frames) SYMRIG_CHECK(check_codes(frame, camera_grid()));
  return RawFrames{std::move(taken.front().frames), std::move(taken.front().exposures)};
}

Grid FrameTaker::grid() const {
  return taker_->projector().grid();
}

Grid FrameTaker::camera_grid() const {
  return taker_->camera().grid();
}

int FrameTaker::bits() const {
  return taker_->camera().noise().bits();
}

Nanoseconds FrameTaker::shortest() const {
  return shortest_exposure(options_, timing_);
}

Nanoseconds FrameTaker::longest() const {
  return possible(timing_.max_exposure);
}

Nanoseconds FrameTaker::possible(Nanoseconds exposure) const {
  const Nanoseconds least = shortest(), period = options_.setup.projector.light_period;
  const Nanoseconds unit = period.count() > 0 ? period : Nanoseconds(1us);
  exposure = std::clamp(exposure, least, std::max(least, timing_.max_exposure));
  return std::max(least, exposure - exposure % unit);
}

const RigTrouble& FrameTaker::trouble() const {
  return taker_->trouble();
}

std::int64_t FrameTaker::frames() const {
  return taker_->frames();
}

double FrameTaker::rig_seconds() const {
  return taker_->rig_seconds();
}

namespace {

using Codes = std::vector<std::uint16_t>;

constexpr double kBrightShare = 0.99;  // of the pixels are darker than the bright parts
constexpr double kFull = 0.8;          // share of the range: bright parts beyond it count as saturated
constexpr double kLeast = 0.1;         // share of the range that the longest exposure must reach
constexpr double kSeen = 10;           // sigmas of dark noise: less light than that tells nothing
constexpr double kFollows = 1.15;      // least growth of the light with an exposure kStep times as long
constexpr int kStep = 4;
constexpr double kGrown = 1.5;  // a picture that grew by this much before has reached its full light
constexpr std::array kShares{0.1, 0.2, 0.35, 0.5, 0.65};  // of the range, for the bright parts
constexpr double kSortShare = 0.5;                        // of the first lit level
constexpr double kSaturates = 2.5;
constexpr double kBright = 0.25;  // share of the bright parts' light: pixels beyond it carry the result
constexpr double kApart = 1.05;   // exposures that are nearer to each other are one level
constexpr double kSpread =
    1.5;  // the darker levels tell less than the brightest, which frames_needed() means
constexpr double kSurely = 1.5;                  // times the range: enough to show where the camera clips
constexpr int kFewestDark = 6;                   // to separate DSNU from noise
constexpr int kMostPairs = 64, kMostDark = 128;  // for small sensors; their errors are then larger

/// What metering found.
struct Metered {
  double rate = 0;       ///< of the bright parts [DN/s]
  double range = 0;      ///< from the dark level to full light [DN]
  std::int64_t lit = 0;  ///< pixels that carry the result
};

class SensorFrameTaker {
 public:
  SensorFrameTaker(FrameTaker& rig, const SceneSink& sink, const SensorFramesOptions& options)
      : rig_(rig), sink_(sink), options_(options), black_(rig.grid()), flood_(rig.grid(), 1, 1.F) {}

  Result<void> run() {
    SYMRIG_TRY(const Metered metered, meter());
    plan(metered);
    for (const Level& level : levels_) SYMRIG_CHECK(take(level));
    return {};
  }

 private:
  struct Level {
    bool lit = false;
    Nanoseconds exposure{0};
    int pairs = 1;
  };

  Result<void> report(std::string_view stage) {
    if (!options_.progress || options_.progress({stage, done_, expected_, kNoneToCome})) return {};
    return Error{ErrorCode::interrupted, fmt::format("stopped after {} frames", done_), "run it again"};
  }

  /// One frame of the flood-lit scene.
  struct Seen {
    double bright = 0;     ///< code of the bright parts above the dark level
    double seconds = 0;    ///< its exposure, as the board saw it
    std::int64_t lit = 0;  ///< pixels that carry the result
  };

  Result<void> look_at_dark();
  Result<Seen> look(Nanoseconds exposure);
  Result<Metered> meter();
  Error too_bright() const;
  static Error does_not_follow(double longer, double growth);
  void plan(const Metered& metered);
  Result<void> take(const Level& level);

  FrameTaker& rig_;
  const SceneSink& sink_;
  const SensorFramesOptions& options_;
  Pattern black_, flood_;
  double dark_ = 0, noise_ = 1;  // of a code
  std::vector<Level> levels_;
  std::int64_t done_ = 0, expected_ = 0;
};

Error SensorFrameTaker::too_bright() const {
  return {ErrorCode::limit,
          fmt::format("the flood-lit scene saturates the camera at its shortest exposure, {:.3g} ms",
                      1e3 * seconds(rig_.shortest())),
          "use less light or close the aperture"};
}

Error SensorFrameTaker::does_not_follow(double longer, double growth) {
  return {ErrorCode::device_refused,
          fmt::format("the camera does not follow its exposure: {:.2g} times as long gives {:.2f} times the "
                      "light",
                      longer, growth),
          "let it expose as long as its trigger is active, and switch its automatic functions off"};
}

/// Takes one frame of the flood-lit scene.
Result<SensorFrameTaker::Seen> SensorFrameTaker::look(Nanoseconds exposure) {
  SYMRIG_CHECK(report("metering"));
  SYMRIG_TRY(RawFrames taken, rig_.take(flood_, {exposure}));
  ++done_;
  Codes codes = std::move(taken.frames.front().raw);
  Seen seen{quantile(codes, kBrightShare) - dark_, symrig::seconds(taken.exposures.front()), 0};
  seen.lit = std::ranges::count_if(codes, [&](double code) { return code - dark_ >= kBright * seen.bright; });
  return seen;
}

/// Sets the dark level and its noise from two frames.
Result<void> SensorFrameTaker::look_at_dark() {
  SYMRIG_CHECK(report("metering"));
  SYMRIG_TRY(const RawFrames black, rig_.take(black_, {rig_.shortest(), rig_.shortest()}));
  done_ += 2;
  const Codes &first = black.frames[0].raw, &second = black.frames[1].raw;
  std::vector<double> difference;
  for (std::size_t i = 0; i < first.size(); ++i)
    difference.push_back(first[i] - static_cast<double>(second[i]));
  noise_ = std::max(0.5, robust_sigma(difference) / std::sqrt(2.0));
  Codes codes = first;
  dark_ = median(codes);
  return {};
}

/// Makes the exposure longer until the bright parts are nearly full.
Result<Metered> SensorFrameTaker::meter() {
  SYMRIG_CHECK(look_at_dark());
  Metered found;
  found.range = (1 << rig_.bits()) - 1 - dark_;
  double before = 0;
  bool follows = false;
  Nanoseconds last{0};
  for (Nanoseconds exposure = rig_.shortest(); exposure > last; exposure = rig_.possible(kStep * exposure)) {
    SYMRIG_TRY(const Seen seen, look(exposure));
    if (seen.bright >= kFull * found.range) {
      if (last.count() == 0) return too_bright();
      break;
    }
    const bool tells = before > kSeen * noise_ && 2 * exposure >= kStep * last;
    if (tells && seen.bright < kFollows * before) {
      if (!follows) return does_not_follow(seconds(exposure) / seconds(last), seen.bright / before);
      found.range = std::min(found.range, seen.bright);  // it clips below the largest code
      break;
    }
    follows = follows || (tells && seen.bright > kGrown * before);
    found.rate = seen.bright / seen.seconds;
    found.lit = seen.lit;
    before = seen.bright;
    last = exposure;
  }
  if (found.rate * seconds(rig_.longest()) >= kLeast * found.range) return found;
  return Error{ErrorCode::limit,
               fmt::format("the flood-lit scene is too dark: at the longest exposure, {:.3g} s, its bright "
                           "parts are {:.1f} DN above the dark level",
                           seconds(rig_.longest()), found.rate * seconds(rig_.longest())),
               "use more light, open the aperture, or remove the lens cap"};
}

/// Sets the levels to take.
void SensorFrameTaker::plan(const Metered& metered) {
  const auto at = [&](double share) {
    return rig_.possible(Nanoseconds(
        std::llround(std::min(1e9 * seconds(rig_.longest()), 1e9 * share * metered.range / metered.rate))));
  };
  std::vector<Nanoseconds> exposures;
  for (const double share : kShares)
    if (const Nanoseconds one = at(share);
        exposures.empty() || seconds(one) > kApart * seconds(exposures.back()))
      exposures.push_back(one);
  const FramesNeeded by_light = frames_needed(metered.lit, options_.gain_error, options_.read_noise_error);
  const FramesNeeded by_pixels =
      frames_needed(rig_.camera_grid().size(), options_.gain_error, options_.read_noise_error);
  const auto count = static_cast<double>(exposures.size());
  const int pairs =
      std::clamp(static_cast<int>(std::ceil(kSpread * by_light.flat_pairs / count)), 1, kMostPairs);
  levels_.push_back({false, rig_.shortest(), std::clamp(by_pixels.dark, kFewestDark, kMostDark) / 2});
  const Nanoseconds saturated = at(kSaturates);
  for (const Nanoseconds dark : {exposures.back(), saturated})
    if (dark > 2 * levels_.back().exposure) levels_.push_back({false, dark, 1});
  levels_.push_back({true, at(kSortShare), 2});
  for (const Nanoseconds exposure : exposures) levels_.push_back({true, exposure, pairs});
  if (seconds(saturated) * metered.rate > kSurely * metered.range) levels_.push_back({true, saturated, 1});
  levels_.push_back({true, at(kSortShare), 2});
  expected_ = done_;
  for (const Level& level : levels_) expected_ += std::int64_t{2} * level.pairs;
}

Result<void> SensorFrameTaker::take(const Level& level) {
  const Exposures exposures{level.exposure, level.exposure};
  for (int k = 0; k < level.pairs; ++k) {
    SYMRIG_CHECK(report(level.lit ? "flood-lit" : "dark"));
    SYMRIG_TRY(const RawFrames taken, rig_.take(level.lit ? flood_ : black_, exposures));
    if (k == 0) SYMRIG_CHECK(sink_.begin({level.lit, taken.exposures.front()}));
    SYMRIG_CHECK(sink_.pair(taken.frames[0].raw, taken.frames[1].raw));
    done_ += 2;
  }
  return {};
}

}  // namespace

Result<void> take_sensor_frames(FrameTaker& rig, const SceneSink& sink, const SensorFramesOptions& options) {
  return SensorFrameTaker(rig, sink, options).run();
}

}  // namespace symrig
