// SPDX-License-Identifier: Apache-2.0

#include "symrig/rig/internal/each_pair.hpp"
#include "symrig/rig/pairs.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::rig {

Error of_pair(std::size_t pair, Error error) {
  error.what = fmt::format("pair {}: {}", pair + 1, error.what);
  return error;
}

Result<void> for_each_pair(std::size_t pairs, const std::function<Result<void>(std::size_t)>& each) {
  std::vector<Result<void>> done(pairs);
  {
    std::vector<std::jthread> others;
    others.reserve(pairs);
    for (std::size_t k = 1; k < pairs; ++k) others.emplace_back([&done, &each, k] { done[k] = each(k); });
    if (pairs > 0) done[0] = each(0);
  }
  for (std::size_t k = 0; k < pairs; ++k)
    if (!done[k]) return of_pair(k, done[k].error());
  return {};
}

}  // namespace symrig::rig

namespace symrig {

/// Rows of cells in the first column of pairs, and columns of cells in the first row of them.
Result<PairLayout> pair_layout(ViewLayout layout, std::span<const Grid> cells) {
  if (std::ssize(cells) != layout.count())
    return Error{ErrorCode::bad_argument,
                 fmt::format("a layout of {} pairs has {} places, but there are {} pairs", to_string(layout),
                             layout.count(), cells.size()),
                 "give rows x columns of pairs, such as \"1x2\""};
  PairLayout pairs{layout, {}};
  for (int row = 0; row < layout.rows; ++row)
    pairs.cells.rows += cells[static_cast<std::size_t>(row) * layout.cols].rows;
  for (int col = 0; col < layout.cols; ++col) pairs.cells.cols += cells[col].cols;
  for (std::size_t k = 0; k < cells.size(); ++k)
    if (!layout.fits(pairs.cells) || cells[k] != pairs.tile(k).grid)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("pair {} has cells of {}, but pairs of {} tile a grid only with equal cells",
                               k + 1, to_string(cells[k]), to_string(layout)),
                   "give each pair the same grid"};
  return pairs;
}

namespace {

using Projectors = std::vector<std::unique_ptr<Projector>>;

class JoinedProjector final : public Projector {
 public:
  JoinedProjector(Projectors projectors, PairLayout layout)
      : projectors_(std::move(projectors)), layout_(layout) {}

  Grid grid() const override { return layout_.cells; }
  Pacing pacing() const override { return projectors_.front()->pacing(); }
  Nanoseconds refresh_period() const override {
    Nanoseconds longest{0};
    for (const auto& one : projectors_) longest = std::max(longest, one->refresh_period());
    return longest;
  }

  Result<void> load(std::span<const Pattern> patterns) override {
    for (const Pattern& pattern : patterns)
      if (pattern.grid() != layout_.cells || pattern.channels() != 1)
        return Error{ErrorCode::size_mismatch,
                     fmt::format("a pattern is {} with {} channels, but all pairs show {} with 1",
                                 to_string(pattern.grid()), pattern.channels(), to_string(layout_.cells)),
                     "give patterns on the grid of all pairs"};
    return rig::for_each_pair(projectors_.size(), [&](std::size_t k) -> Result<void> {
      std::vector<Pattern> parts;
      parts.reserve(patterns.size());
      for (const Pattern& pattern : patterns) parts.push_back(cut(pattern, layout_.tile(k)));
      return projectors_[k]->load(parts);
    });
  }

  /// The pattern is there when the last projector shows it. A screen that did not go on stops the count, so
  /// that the rig notices.
  Result<Shown> show(std::size_t index) override {
    std::vector<Shown> now(projectors_.size());
    SYMRIG_CHECK(rig::for_each_pair(projectors_.size(), [&](std::size_t k) -> Result<void> {
      SYMRIG_TRY(now[k], projectors_[k]->show(index));
      return {};
    }));
    bool all_went_on = true;
    for (std::size_t k = 0; k < now.size() && !before_.empty(); ++k)
      all_went_on = all_went_on && now[k].refresh > before_[k].refresh && now[k].since > before_[k].since;
    before_ = now;
    shown_ += all_went_on ? 1 : 0;
    const auto last = std::ranges::max_element(now, {}, &Shown::since);
    return Shown{shown_, last->since, false};
  }

  std::vector<std::string> warnings() const override {
    std::vector<std::string> all;
    for (std::size_t k = 0; k < projectors_.size(); ++k)
      for (const std::string& warning : projectors_[k]->warnings())
        all.push_back(fmt::format("pair {}: {}", k + 1, warning));
    return all;
  }
  Result<void> check() override {
    return rig::for_each_pair(projectors_.size(), [&](std::size_t k) { return projectors_[k]->check(); });
  }
  std::string describe() const override {
    std::string text = fmt::format("{} projectors", projectors_.size());
    for (const auto& one : projectors_) text += (&one == projectors_.data() ? ": " : "; ") + one->describe();
    return text;
  }

 private:
  Projectors projectors_;
  PairLayout layout_;
  std::vector<Shown> before_;
  std::uint64_t shown_ = 0;
};

}  // namespace

Result<std::unique_ptr<Projector>> join_projectors(Projectors projectors, const PairLayout& layout) {
  for (std::size_t k = 0; k < projectors.size(); ++k) {
    const Projector& one = *projectors[k];
    if (one.grid() != layout.tile(k).grid)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("pair {}: its projector shows {}, but its cells are {}", k + 1,
                               to_string(one.grid()), to_string(layout.tile(k).grid)),
                   "connect the projector that the capture began with"};
    if (one.planes().planes > 0)
      return Error{ErrorCode::bad_argument, fmt::format("pair {}: its projector shows bit planes", k + 1),
                   "several pairs need projectors that show whole pictures"};
    if (one.pacing() != projectors.front()->pacing())
      return Error{ErrorCode::bad_argument,
                   fmt::format("pair {}: its projector is not paced as that of pair 1", k + 1),
                   "give each pair a screen, or each a projector with a trigger line"};
  }
  return std::unique_ptr<Projector>(std::make_unique<JoinedProjector>(std::move(projectors), layout));
}

namespace {

using Cameras = std::vector<std::unique_ptr<Camera>>;

class JoinedCamera final : public Camera {
 public:
  JoinedCamera(Cameras cameras, PairLayout layout) : cameras_(std::move(cameras)), layout_(layout) {}

  Grid grid() const override { return layout_.cells; }
  int channels() const override { return cameras_.front()->channels(); }
  /// What every camera keeps.
  CameraTiming timing() const override {
    CameraTiming all = cameras_.front()->timing();
    Nanoseconds gap{0};  // until each takes its next trigger
    for (const auto& one : cameras_) {
      const CameraTiming timing = one->timing();
      gap = std::max(gap, timing.readout - timing.overlap);
      all.min_exposure = std::max(all.min_exposure, timing.min_exposure);
      all.max_exposure = std::min(all.max_exposure, timing.max_exposure);
      all.readout = std::max(all.readout, timing.readout);
    }
    all.overlap = all.readout - gap;
    return all;
  }
  /// For planning. Each frame is read with the noise of its own camera.
  const NoiseModel& noise() const override { return cameras_.front()->noise(); }
  const Image<std::uint8_t>* dead() const override { return nullptr; }

  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override {
    std::vector<std::vector<CameraFrame>> taken(cameras_.size());
    SYMRIG_CHECK(rig::for_each_pair(cameras_.size(), [&](std::size_t k) -> Result<void> {
      SYMRIG_TRY(taken[k], cameras_[k]->take(count, patience));
      for (CameraFrame& frame : taken[k]) frame.camera = k;
      return {};
    }));
    std::vector<CameraFrame> all;
    for (auto& frames : taken) std::ranges::move(frames, std::back_inserter(all));
    return all;
  }

  std::size_t count() const override { return cameras_.size(); }
  const Camera& part(std::size_t index) const override { return *cameras_[index]; }
  std::string describe() const override {
    std::string text = fmt::format("{} cameras", cameras_.size());
    for (const auto& one : cameras_) text += (&one == cameras_.data() ? ": " : "; ") + one->describe();
    return text;
  }

 private:
  Cameras cameras_;
  PairLayout layout_;
};

}  // namespace

Result<std::unique_ptr<Camera>> join_cameras(Cameras cameras, const PairLayout& layout) {
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    if (cameras[k]->channels() != cameras.front()->channels())
      return Error{ErrorCode::bad_argument,
                   fmt::format("pair {}: its camera has {} channels, but that of pair 1 has {}", k + 1,
                               cameras[k]->channels(), cameras.front()->channels()),
                   "give all pairs cameras of one kind"};
    const Nanoseconds delay = cameras[k]->timing().trigger_delay, first = cameras[0]->timing().trigger_delay;
    if (delay != first)
      return Error{
          ErrorCode::bad_argument,
          fmt::format("pair {}: its camera exposes {} ns after the trigger, but that of pair 1 {} ns", k + 1,
                      delay.count(), first.count()),
          "set the delays of all cameras to the longest one: camera.features.TriggerDelay"};
  }
  return std::unique_ptr<Camera>(std::make_unique<JoinedCamera>(std::move(cameras), layout));
}

namespace {

/// The frames of one exposure, one of each camera.
using Parts = std::shared_ptr<const std::vector<CameraFrame>>;

/// nullptr: not a frame of join_frames().
const std::vector<CameraFrame>* parts_of(const CameraFrame& frame) {
  const auto* parts = std::any_cast<Parts>(&frame.attachment);
  return parts == nullptr ? nullptr : parts->get();
}

/// The frames of one camera.
std::vector<CameraFrame> frames_of(std::span<const CameraFrame> joined, std::size_t camera) {
  std::vector<CameraFrame> own;
  own.reserve(joined.size());
  for (const CameraFrame& frame : joined)
    if (const auto* parts = parts_of(frame)) own.push_back((*parts)[camera]);
  return own;
}

Radiance cut_photograph(const Radiance& whole, const Tile& tile) {
  return {cut(whole.mean, tile), cut(whole.variance, tile), cut(whole.valid, tile)};
}

/// photograph -= black, as merge() does it.
void subtract(const Radiance& black, Radiance& photograph) {
  const auto mean = photograph.mean.values(), variance = photograph.variance.values();
  const auto valid = photograph.valid.values();
  for (std::size_t i = 0; i < mean.size(); ++i) {
    valid[i] = valid[i] != 0 && black.valid.values()[i] != 0 ? 1 : 0;
    mean[i] = valid[i] != 0 ? mean[i] - black.mean.values()[i] : 0;
    variance[i] = valid[i] != 0 ? variance[i] + black.variance.values()[i] : 0;
  }
}

class PairReading final : public FrameReading {
 public:
  PairReading(std::shared_ptr<const FrameReading> each, PairLayout layout, std::vector<ToCells> to_cells)
      : each_(std::move(each)), layout_(layout), to_cells_(std::move(to_cells)) {
    to_cells_.resize(layout_.count());
  }

  std::optional<double> brightest_rate(const CameraFrame& frame, Nanoseconds exposure, const Camera& camera,
                                       double scale) const override {
    const auto* parts = parts_of(frame);
    if (parts == nullptr) return std::nullopt;
    double brightest = 0;
    for (std::size_t k = 0; k < parts->size(); ++k) {
      const auto rate = each_->brightest_rate((*parts)[k], exposure, camera.part(k), scale);
      if (!rate) return std::nullopt;
      brightest = std::max(brightest, *rate);
    }
    return brightest;
  }

  Result<Radiance> photograph(std::span<const CameraFrame> frames, std::span<const Nanoseconds> exposures,
                              const Camera& camera, const PhotographUnits& units) const override {
    std::optional<Radiance> whole;
    for (std::size_t k = 0; k < layout_.count(); ++k) {
      auto part = photograph_of(k, frames_of(frames, k), exposures, camera.part(k), units);
      if (!part) return rig::of_pair(k, part.error());
      if (!whole) {
        const int channels = part->mean.channels();
        whole.emplace(Radiance{Image<float>(layout_.cells, channels), Image<float>(layout_.cells, channels),
                               Image<std::uint8_t>(layout_.cells, channels)});
      }
      const Tile tile = layout_.tile(k);
      if (part->mean.grid() != tile.grid || part->mean.channels() != whole->mean.channels())
        return rig::of_pair(
            k, {ErrorCode::size_mismatch,
                fmt::format("its photograph is {} with {} channels, but its cells are {}",
                            to_string(part->mean.grid()), part->mean.channels(), to_string(tile.grid)),
                "register the pair's camera, or let it share the projector's cells"});
      paste(part->mean, tile, whole->mean);
      paste(part->variance, tile, whole->variance);
      paste(part->valid, tile, whole->valid);
    }
    return *std::move(whole);
  }

  std::string contradicted_exposures(std::span<const CameraFrame> frames,
                                     std::span<const Nanoseconds> exposures,
                                     const NoiseModel& noise) const override {
    for (std::size_t k = 0; k < layout_.count(); ++k) {
      const std::string how = each_->contradicted_exposures(frames_of(frames, k), exposures, noise);
      if (!how.empty()) return fmt::format("pair {}: {}", k + 1, how);
    }
    return "";
  }

  bool exact() const override { return each_->exact(); }

 private:
  /// On the cells of pair k.
  Result<Radiance> photograph_of(std::size_t k, const std::vector<CameraFrame>& frames,
                                 std::span<const Nanoseconds> exposures, const Camera& camera,
                                 PhotographUnits units) const {
    if (frames.size() != exposures.size())
      return Error{ErrorCode::frame_missing, "a frame has no part of this pair", "take the photograph again"};
    std::optional<Radiance> black;
    if (units.black != nullptr) black = cut_photograph(*units.black, layout_.tile(k));
    const bool registered = to_cells_[k] != nullptr;
    units.black = black && !registered ? &*black : nullptr;
    SYMRIG_TRY(Radiance seen, each_->photograph(frames, exposures, camera, units));
    if (!registered) return seen;
    SYMRIG_TRY(Radiance cells, to_cells_[k](seen));
    if (black) subtract(*black, cells);  // on the cells: gathering is linear
    return cells;
  }

  std::shared_ptr<const FrameReading> each_;
  PairLayout layout_;
  std::vector<ToCells> to_cells_;  // empty function: the camera's pixels are the cells
};

}  // namespace

CameraFrame join_frames(std::vector<CameraFrame> parts) {
  CameraFrame joined;
  joined.sequence = parts.front().sequence;
  joined.stamp = parts.front().stamp;
  joined.stamp_of = parts.front().stamp_of;
  joined.attachment = Parts(std::make_shared<const std::vector<CameraFrame>>(std::move(parts)));
  return joined;
}

std::shared_ptr<const FrameReading> read_pairs(std::shared_ptr<const FrameReading> each,
                                               const PairLayout& layout, std::vector<ToCells> to_cells) {
  return std::make_shared<PairReading>(std::move(each), layout, std::move(to_cells));
}

}  // namespace symrig
