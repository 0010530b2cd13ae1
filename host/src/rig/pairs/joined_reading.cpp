// SPDX-License-Identifier: Apache-2.0
#include "rig/pairs/each_pair.hpp"
#include "symrig/rig/pairs.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig {
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
