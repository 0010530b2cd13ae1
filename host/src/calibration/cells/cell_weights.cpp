// SPDX-License-Identifier: Apache-2.0

#include "symrig/calibration/cell_weights.hpp"

#include "calibration/cells/cell_weights_builder.hpp"
#include "calibration/cells/ghost_subtraction.hpp"
#include "calibration/cells/neighbour_light.hpp"
#include "calibration/cells/shared_pixels.hpp"
#include "symrig/acquisition/internal/fast_crc32c.hpp"
#include "symrig/calibration/camera_optics.hpp"
#include "symrig/hdr/mosaic.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig {

/// Of the cell with these weights k: (scale / Σ k W)² Σ k².
double CellWeights::Channel::noise_share(std::size_t cell, std::size_t begin, std::size_t end) const {
  double sum = 0, squares = 0;
  for (std::size_t j = begin; j < end; ++j) {
    sum += static_cast<double>(weight[j] * reference[j]);
    squares += std::pow(static_cast<double>(weight[j]), 2);
  }
  return squares * std::pow(static_cast<double>(scale[cell]) / sum, 2);
}

std::string_view to_string(Weighting weighting) {
  switch (weighting) {
    case Weighting::area:
      return "area";
    case Weighting::cores:
      return "cores";
    case Weighting::unmixed:
      return "unmixed";
  }
  return "";
}

namespace {

Result<void> check(Grid cells, std::span<const CornerMap> corners, const Radiance& flood) {
  const int channels = flood.mean.channels();
  if (!cells.valid() || corners.empty() ||
      (corners.size() != 1 && std::cmp_not_equal(corners.size(), channels)))
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} corner maps for photographs with {} channels", corners.size(), channels),
                 "give one map, or one for each channel"};
  const Grid camera = flood.mean.grid();
  for (const CornerMap& map : corners) {
    if (map.grid() != Grid{camera.rows + 1, camera.cols + 1} || map.channels() != 2)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("a corner map is {}, but the flood-lit photograph is {}",
                               to_string(map.grid()), to_string(camera)),
                   "a corner map has one row and one column more than the photograph"};
    if (!std::ranges::all_of(map.values(), [](double v) { return std::isfinite(v); }))
      return Error{ErrorCode::bad_value, "a corner of a camera pixel is not a finite number",
                   "register the camera again"};
  }
  return {};
}

Result<void> check_shares(const Image<float>& shares, const Radiance& flood, std::size_t maps) {
  if (shares.grid() != flood.mean.grid() || std::cmp_not_equal(shares.channels(), 2 * maps))
    return Error{ErrorCode::size_mismatch, "the shares of light do not fit the photograph and the maps",
                 "register the camera again"};
  const auto known = [](float v) { return (v >= 0 && v <= 1) || v == kUnknownShare; };
  if (std::ranges::all_of(shares.values(), known)) return {};
  return Error{ErrorCode::bad_value, "a share of light is not between 0 and 1", "register the camera again"};
}

}  // namespace

Result<CellWeights> CellWeights::make(Grid cells, std::span<const CornerMap> corners, const Radiance& flood,
                                      const WeightOptions& options, const Image<float>* shares) {
  SYMRIG_CHECK(check(cells, corners, flood));
  if (shares != nullptr) SYMRIG_CHECK(check_shares(*shares, flood, corners.size()));
  CellWeights weights;
  weights.cells_ = cells;
  weights.camera_ = flood.mean.grid();
  weights.channels_ = flood.mean.channels();
  const CellWeightsBuilder builder(cells, options);
  double noise = 0, whole = 0, pixels = 0;
  std::int64_t counted = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const auto parts = calibration::cell_overlaps(cells, corners[k], options.margin);
    for (const auto& part : parts) whole += static_cast<double>(part.area), pixels += part.share();
    std::vector<int> channels;
    for (int c = 0; c < weights.channels_; ++c)
      if (corners.size() == 1 || std::cmp_equal(k, c)) channels.push_back(c);
    const auto has_core = builder.cores(parts, flood, channels, k, shares);
    weights.rows_.push_back(builder.rows(parts, has_core));
    const Rows& rows = weights.rows_.back();
    for (const int c : channels)
      weights.channel_.push_back(builder.channel(parts, rows, k, has_core, flood, c, shares));
    const Channel& last = weights.channel_.back();
    for (std::size_t i = 0; i < last.scale.size(); ++i) {
      if (last.scale[i] == 0) continue;
      if (k == 0 && options.weighting == Weighting::cores && !has_core[i]) ++weights.without_core_;
      noise += last.noise_share(i, rows.first[i], rows.first[i + 1]) * static_cast<double>(last.noise[i]);
      ++counted;
    }
  }
  if (pixels > 0) weights.pixel_side_ = std::sqrt(whole / pixels);
  if (counted > 0) weights.noise_share_ = noise / static_cast<double>(counted);
  return weights;
}

Result<CellWeights> CellWeights::of_mosaic(Grid cells, std::span<const CornerMap> corners,
                                           const Radiance& flood, const BayerPattern& filters,
                                           const WeightOptions& options, const Image<float>* shares) {
  SYMRIG_TRY(const Radiance colours, split_mosaic(flood, filters));
  SYMRIG_TRY(CellWeights weights, make(cells, corners, colours, options, shares));
  weights.of_mosaic_ = true;
  return weights;
}

Result<void> CellWeights::divide_by(const Image<float>& gain) {
  if (gain.grid() != cells_)
    return Error{
        ErrorCode::size_mismatch,
        fmt::format("gains of {} cells for weights of {}", to_string(gain.grid()), to_string(cells_)),
        "calibrate the rig again"};
  if (!std::ranges::all_of(gain.plane(0), [](float g) { return g > 0 && std::isfinite(g); }))
    return Error{ErrorCode::bad_value, "a gain is not above 0", "calibrate the rig again"};
  for (Channel& channel : channel_)
    for (std::size_t i = 0; i < channel.scale.size(); ++i) {
      channel.scale[i] /= gain.plane(0)[i];
      if (!channel.unit.empty()) channel.unit[i] /= gain.plane(0)[i];
    }
  return {};
}

Result<void> CellWeights::blur_by(double variance) {
  if (!(variance >= 0 && variance <= 1))
    return Error{ErrorCode::bad_value,
                 fmt::format("photographs cannot be blurred by a variance of {:.3g} cells", variance),
                 "focus camera and projector, or make the cells larger"};
  blur_ = std::sqrt(variance) / pixel_side_;
  // A mean over a cell of side 1, of a picture blurred by σ: ∫ (box * Gaussian)² = 1 − 2 σ / √π along an
  // axis.
  constexpr double kLeast = 0.3;
  const double axis = std::max(1 - 2 * std::sqrt(variance / std::numbers::pi), kLeast);
  blurred_noise_ = static_cast<float>(axis * axis);
  return {};
}

Result<void> CellWeights::subtract_ghost(std::span<const CornerMap> corners, const CameraGhost& ghost) {
  const bool fit = std::ranges::all_of(corners, [&](const CornerMap& map) {
    return map.grid() == Grid{camera_.rows + 1, camera_.cols + 1} && map.channels() == 2;
  });
  if (!fit || (corners.size() != 1 && std::cmp_not_equal(corners.size(), channels_)))
    return Error{ErrorCode::size_mismatch, "the maps of the ghost do not fit the weights",
                 "calibrate the rig again"};
  SYMRIG_TRY(auto subtract, calibration::GhostSubtraction::make(corners, ghost.share, ghost.place));
  ghost_ = std::make_shared<const calibration::GhostSubtraction>(std::move(subtract));
  return {};
}

std::uint32_t CellWeights::digest() const {
  std::vector<std::uint32_t> parts;
  const auto add = [&](const auto& values) {
    parts.push_back(acquisition::fast_crc32c(std::as_bytes(std::span(values))));
  };
  for (const Rows& rows : rows_) add(rows.first), add(rows.pixel);
  for (const Channel& channel : channel_) {
    add(channel.weight), add(channel.reference), add(channel.scale);
    if (channel.shared) parts.push_back(channel.shared->digest());
  }
  parts.push_back(acquisition::fast_crc32c(std::as_bytes(std::span(&blur_, 1))));
  if (shift_) parts.push_back(acquisition::fast_crc32c(std::as_bytes(std::span(&*shift_, 1))));
  if (ghost_) parts.push_back(ghost_->digest());
  return acquisition::fast_crc32c(std::as_bytes(std::span(parts)));
}

std::int64_t CellWeights::valid_cells() const {
  return std::ranges::count_if(channel_.front().scale, [](float s) { return s > 0; });
}

Result<Radiance> CellWeights::gather(const Radiance& photograph) const {
  if (photograph.mean.grid() != camera_ || photograph.mean.channels() != camera_channels())
    return Error{
        ErrorCode::size_mismatch,
        fmt::format("the photograph is {} with {} channels, but the camera was registered with {} and {}",
                    to_string(photograph.mean.grid()), photograph.mean.channels(), to_string(camera_),
                    camera_channels()),
        "register the camera again"};
  return ghost_ ? gather_plain((*ghost_)(photograph)) : gather_plain(photograph);
}

Radiance CellWeights::gather_plain(const Radiance& photograph) const {
  if (shift_) return unmix(photograph);
  return blur_ > 0 ? gather_sharp(calibration::blurred(photograph, blur_)) : gather_sharp(photograph);
}

Radiance CellWeights::unmix(const Radiance& photograph) const {
  Radiance cells = photograph;
  for (int c = 0; c < channels_; ++c) {
    const Channel& channel = channel_[static_cast<std::size_t>(c)];
    calibration::unmix(cells_, *shift_, photograph.mean.plane(c), photograph.valid.plane(c),
                       cells.mean.plane(c));
    const auto mean = cells.mean.plane(c), variance = cells.variance.plane(c);
    for (std::size_t i = 0; i < channel.scale.size(); ++i) {
      mean[i] *= channel.scale[i];
      variance[i] *= channel.scale[i] * channel.scale[i] * static_cast<float>(noise_share_);
    }
  }
  return cells;
}

Result<CellWeights> CellWeights::unmixing(Grid cells, int channels, Point shift) {
  if (!(std::abs(shift.row) <= largest_shift && std::abs(shift.col) <= largest_shift))
    return Error{
        ErrorCode::limit,
        fmt::format("the camera's pixels are off by {:+.2f} and {:+.2f} cells, and {:.2f} is the most "
                    "that can be corrected",
                    shift.row, shift.col, largest_shift),
        "align the rig, or use a camera with 2.2 pixels along the side of a cell"};
  CellWeights weights;
  weights.cells_ = weights.camera_ = cells;
  weights.channels_ = channels;
  weights.shift_ = shift;
  weights.noise_share_ = calibration::unmixed_noise(shift);
  weights.channel_.assign(static_cast<std::size_t>(channels),
                          {.scale = std::vector<float>(static_cast<std::size_t>(cells.size()), 1.F)});
  return weights;
}

CellWeights::Missing CellWeights::missing(const Channel& channel, std::size_t begin, std::size_t end,
                                          std::span<const std::uint32_t> pixel, std::span<const float> mean,
                                          std::span<const std::uint8_t> valid) {
  // Ratios y / W, weighted by |weight| · W: a plane may have weights below 0.
  float light = 0, known = 0, unknown = 0;
  Missing more;
  float signed_unknown = 0;
  for (std::size_t k = begin; k < end; ++k) {
    const float w = std::abs(channel.weight[k]) * channel.light[k];
    if (!(w > 0)) continue;
    if (valid[pixel[k]]) {
      known += w, light += std::abs(channel.weight[k]) * mean[pixel[k]];
    } else {
      unknown += w, signed_unknown += channel.weight[k] * channel.light[k];
      more.reference += channel.weight[k] * channel.reference[k];
    }
  }
  if (!(unknown > 0 && known > 0)) return {};
  const float ratio = light / known;
  float squares = 0;
  std::size_t others = 0;
  for (std::size_t k = begin; k < end; ++k) {
    const float w = std::abs(channel.weight[k]) * channel.light[k];
    if (!(w > 0) || !valid[pixel[k]]) continue;
    const float off = std::clamp(mean[pixel[k]] / channel.light[k], 0.F, 1.F) - ratio;
    squares += w * off * off;
    ++others;
  }
  // A single pixel says nothing of how much they differ. A clipped one may have any ratio up to 1: no pattern
  // gives a pixel more than all light, and a mirror may give it all of that.
  const float above = 1 - std::clamp(ratio, 0.F, 1.F);
  const float spread = std::max(others > 1 ? squares / known : ratio * ratio, above * above / 3);
  more.light = ratio * signed_unknown;
  more.noise = std::pow(1 + unknown / known, 2.F);
  more.doubt = unknown * unknown * spread;
  return more;
}

Radiance CellWeights::gather_sharp(const Radiance& photograph) const {
  Radiance cells{Image<float>(cells_, channels_), Image<float>(cells_, channels_),
                 Image<std::uint8_t>(cells_, channels_)};
  for (int c = 0; c < channels_; ++c) {
    const Channel& channel = channel_[static_cast<std::size_t>(c)];
    const Rows& rows = rows_[channel.rows];
    const int plane = of_mosaic_ ? 0 : c;
    const auto mean = photograph.mean.plane(plane);
    const auto variance = photograph.variance.plane(plane);
    const auto valid = photograph.valid.plane(plane);
    const auto to_mean = cells.mean.plane(c);
    const auto to_variance = cells.variance.plane(c);
    const auto to_valid = cells.valid.plane(c);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, channel.scale.size(), 1024), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        float light = 0, reference = 0, noise = 0;
        bool all = true;
        for (std::size_t k = rows.first[i]; k < rows.first[i + 1]; ++k) {
          const std::size_t pixel = rows.pixel[k];
          if (!valid[pixel]) {
            all = false;
            continue;
          }
          const float w = channel.weight[k];
          light += w * mean[pixel];
          noise += w * w * variance[pixel];
          reference += w * channel.reference[k];
        }
        if (channel.scale[i] == 0 || !(reference > 0)) continue;
        float doubt = 0;
        if (!all) {
          const Missing more = missing(channel, rows.first[i], rows.first[i + 1], rows.pixel, mean, valid);
          light += more.light, noise *= more.noise;
          doubt = more.doubt, reference += more.reference;
        }
        const float scale = channel.scale[i] / reference;
        to_mean[i] = scale * light;
        to_variance[i] = scale * scale * (noise * channel.noise[i] * blurred_noise_ + doubt);
        to_valid[i] = 1;
      }
    });
    if (channel.shared)
      channel.shared->add({mean, variance, valid, rows.first, rows.pixel}, channel.unit, to_mean,
                          to_variance);
  }
  return cells;
}

}  // namespace symrig
