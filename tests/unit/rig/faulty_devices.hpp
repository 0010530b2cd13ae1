// SPDX-License-Identifier: Apache-2.0
// Devices that misbehave, and how a test knows that a photograph of a virtual rig is of the right pattern.
#pragma once

#include "symrig/base/statistics.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/projector/projector.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/testing/probe_laws.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace symrig::test {

/// A camera between a rig and another camera, which it borrows.
class OtherCamera : public Camera {
 public:
  explicit OtherCamera(Camera& inner) : inner_(inner) {}
  Grid grid() const override { return inner_.grid(); }
  int channels() const override { return inner_.channels(); }
  CameraTiming timing() const override { return inner_.timing(); }
  const NoiseModel& noise() const override { return inner_.noise(); }
  const Image<std::uint8_t>* dead() const override { return inner_.dead(); }
  std::string describe() const override { return inner_.describe(); }
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override {
    return inner_.take(count, patience);
  }

 private:
  Camera& inner_;
};

/// What a camera does wrong: probabilities a frame, and an unplugged cable.
struct CameraMischief {
  double lost = 0, lost_unnoticed = 0, copied = 0, renumbered = 0, late_stamp = 0, late_arrival = 0,
         damaged = 0;
  int stale = 0;                ///< frames of before that a stream begins with
  std::int64_t unplug_at = -1;  ///< after so many frames, once; -1: never
  int absent = 0;               ///< then it cannot be opened so many times

  Random random{1};
  std::int64_t frames = 0;  ///< handed over so far
  bool unplugged = false;
};

/// A camera that loses, copies, delays and damages what another one sees.
class FaultyCamera final : public OtherCamera {
 public:
  FaultyCamera(Camera& inner, std::shared_ptr<CameraMischief> mischief)
      : OtherCamera(inner), mischief_(std::move(mischief)) {}

  /// As the opener of a rig: refuses while the camera is unplugged.
  static Result<std::unique_ptr<Camera>> open(Camera& inner,
                                              const std::shared_ptr<CameraMischief>& mischief) {
    if (mischief->unplugged && mischief->absent-- > 0)
      return Error{ErrorCode::device_lost, "the camera is not there", "plug it in"};
    mischief->unplugged = false;
    return std::unique_ptr<Camera>(std::make_unique<FaultyCamera>(inner, mischief));
  }

  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override {
    SYMRIG_TRY(auto seen, OtherCamera::take(count, patience));
    std::vector<CameraFrame> out = std::exchange(held_, {});
    for (CameraFrame& frame : seen) {
      if (mischief_->frames++ == mischief_->unplug_at) mischief_->unplugged = true;
      if (mischief_->unplugged)
        return Error{ErrorCode::device_lost, "the camera was unplugged", "plug it in"};
      hand_over(std::move(frame), out);
    }
    return out;
  }

 private:
  bool happens(double probability) { return mischief_->random.uniform() < probability; }

  void hand_over(CameraFrame frame, std::vector<CameraFrame>& out) {
    const CameraMischief& m = *mischief_;
    for (; begun_ < m.stale; ++begun_) stale(frame, out);
    if (happens(m.lost_unnoticed)) return;
    frame.sequence = number_++;
    if (happens(m.lost)) return;
    if (happens(m.late_stamp) && last_stamp_.since.count() != 0)
      frame.stamp = frame.stamp + (frame.stamp - last_stamp_);
    last_stamp_ = frame.stamp;
    if (happens(m.damaged)) {
      frame.damaged = true;
      std::fill(frame.raw.begin(), frame.raw.end(), std::uint16_t{0});
    }
    const bool copied = happens(m.copied), renumbered = happens(m.renumbered);
    CameraFrame copy = copied || renumbered ? frame : CameraFrame{};
    (happens(m.late_arrival) ? held_ : out).push_back(std::move(frame));
    if (renumbered) copy.sequence = number_++;
    if (copied || renumbered) out.push_back(std::move(copy));
  }

  /// A frame that lay in the driver since before the stream began.
  void stale(const CameraFrame& like, std::vector<CameraFrame>& out) {
    CameraFrame old = like;
    old.sequence = number_++;
    old.stamp = like.stamp - Nanoseconds{1'000'000'000 * std::int64_t{1 + begun_}};
    std::fill(old.raw.begin(), old.raw.end(), std::uint16_t{100});
    out.push_back(std::move(old));
  }

  std::shared_ptr<CameraMischief> mischief_;
  std::vector<CameraFrame> held_;
  std::uint64_t number_ = 0;  // a stream begins to count anew
  int begun_ = 0;
  SteadyTime last_stamp_;
};

/// What a projector does wrong.
struct ProjectorMischief {
  std::int64_t unplug_at = -1;  ///< at the show of that number, once
  int absent = 0;
  bool count_stands = false;   ///< its refreshes do not go on
  Nanoseconds says_later{0};   ///< it says that patterns come so much later than they do
  std::int64_t reset_at = -1;  ///< a controller of bit planes is reset at the show of that number, once
  std::function<void()> on_reset;
  Nanoseconds play_takes{0};  ///< the host hears of the first picture so much later
  std::function<void(Nanoseconds)> wait;
  bool was_reset = false;  ///< then check() says so, until it is opened again
  std::int64_t shows = 0;
  bool unplugged = false;
};

/// A screen that is unplugged, or does not tell the truth about its refreshes.
class FaultyProjector final : public Projector {
 public:
  FaultyProjector(Projector& inner, std::shared_ptr<ProjectorMischief> mischief)
      : inner_(inner), mischief_(std::move(mischief)) {}

  static Result<std::unique_ptr<Projector>> open(Projector& inner,
                                                 const std::shared_ptr<ProjectorMischief>& mischief) {
    if (mischief->unplugged && mischief->absent-- > 0)
      return Error{ErrorCode::device_lost, "nothing is plugged in at the connector", "plug it in"};
    mischief->unplugged = mischief->was_reset = false;
    return std::unique_ptr<Projector>(std::make_unique<FaultyProjector>(inner, mischief));
  }

  Grid grid() const override { return inner_.grid(); }
  Nanoseconds refresh_period() const override { return inner_.refresh_period(); }
  Pacing pacing() const override { return inner_.pacing(); }
  Result<void> load(std::span<const Pattern> patterns) override {
    loaded_ = true;
    return inner_.load(patterns);
  }
  std::string describe() const override { return inner_.describe(); }
  PlaneTiming planes() const override { return inner_.planes(); }
  Result<void> load_planes(std::span<const Pattern> patterns, std::span<const PlanePlan> plans) override {
    loaded_ = true;
    return inner_.load_planes(patterns, plans);
  }
  std::string setting_for_planes(std::span<const int> seen) const override {
    return inner_.setting_for_planes(seen);
  }
  Result<void> check() override {
    if (!mischief_->was_reset) return {};
    return Error{ErrorCode::device_lost, "the controller was reset", "check its power supply"};
  }

  Result<Shown> show(std::size_t index) override {
    SYMRIG_CHECK(before_show());
    SYMRIG_TRY(Shown shown, inner_.show(index));
    return as_told(shown);
  }
  Result<Shown> play(std::span<const std::size_t> order) override {
    SYMRIG_CHECK(before_show());
    SYMRIG_TRY(const Shown shown, inner_.play(order));
    if (mischief_->play_takes.count() > 0) mischief_->wait(mischief_->play_takes);
    return as_told(shown);
  }
  Result<std::vector<ShownPicture>> played() override {
    SYMRIG_TRY(auto all, inner_.played());
    for (ShownPicture& one : all) one.shown = as_told(one.shown);
    return all;
  }

 private:
  Result<void> before_show() {
    if (!loaded_) return Error{ErrorCode::bad_argument, "no pattern was loaded", "load before you show"};
    if (mischief_->shows++ == mischief_->unplug_at) mischief_->unplugged = true;
    if (mischief_->unplugged) return Error{ErrorCode::device_lost, "the screen was unplugged", "plug it in"};
    if (mischief_->shows - 1 == mischief_->reset_at) {
      mischief_->was_reset = true;
      mischief_->on_reset();
    }
    return {};
  }
  Shown as_told(Shown shown) const {
    if (mischief_->count_stands) shown.refresh = 7;
    shown.since = shown.since + mischief_->says_later;
    return shown;
  }

  Projector& inner_;
  std::shared_ptr<ProjectorMischief> mischief_;
  bool loaded_ = false;
};

/// Patterns, each with half of the pixels lit. Half the pixels of each are others than of any other, so that
/// a photograph of the wrong one shows.
inline std::vector<Pattern> distinct_patterns(Grid grid, int count, std::uint64_t first_seed) {
  std::vector<Pattern> patterns;
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(count); ++i)
    patterns.push_back(probe_laws::law_pattern(grid, first_seed + i));
  return patterns;
}

/// Mean over n pixels of (photograph - T p)² / Var: 1 ± √(2/n) for the right pattern. In a wrong one half the
/// pixels lie hundreds of sigmas away.
inline double misfit(const VirtualRig& rig, const Pattern& pattern, const Radiance& photograph) {
  const Image<float> truth = rig.truth().apply(pattern);
  double sum = 0;
  std::int64_t count = 0;
  for (std::size_t i = 0; i < truth.values().size(); ++i) {
    if (photograph.valid.values()[i] == 0) continue;
    const double off = photograph.mean.values()[i] - truth.values()[i];
    sum += off * off / photograph.variance.values()[i];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : INFINITY;
}

}  // namespace symrig::test
