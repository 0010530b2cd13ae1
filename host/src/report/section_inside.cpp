// SPDX-License-Identifier: Apache-2.0
// The hierarchy over the picture: how finely the transport of each pixel is divided, its number of terms, and
// maps of both.

#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/sections.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/image/image.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

namespace symrig::report {

namespace {

constexpr int kDecades = 4;

Image<float> channel_mean(const Image<float>& image) {
  Image<float> mean(image.grid());
  for (int c = 0; c < image.channels(); ++c)
    for (std::size_t i = 0; i < mean.values().size(); ++i)
      mean.values()[i] += image.plane(c)[i] / static_cast<float>(image.channels());
  return mean;
}

/// T between all pairs of pixels on one line of a symmetric tensor, mean over channels.
Result<Image<float>> symmetric_slice(const TransportTensor& tensor, int row) {
  const int cols = tensor.camera_grid().cols;
  Image<float> mean({cols, cols});
  for (int c = 0; c < tensor.channels(); ++c) {
    SYMRIG_TRY(const Image<float> slice, tensor.slice(row, c));
    for (std::size_t i = 0; i < mean.values().size(); ++i)
      mean.values()[i] += slice.values()[i] / static_cast<float>(tensor.channels());
  }
  return mean;
}

/// One column of the picture for each light: the light on one camera row.
template <class LightAt>
Result<Image<float>> seen_on_row(const TransportTensor& tensor, int camera_row, int lights,
                                 LightAt light_at) {
  const int cols = tensor.camera_grid().cols;
  Image<float> seen({cols, lights});
  for (int k = 0; k < lights; ++k) {
    SYMRIG_TRY(const Image<float> photograph, tensor.apply(light_at(k)));
    const Image<float> mean = channel_mean(photograph);
    for (int col = 0; col < cols; ++col) seen.at(col, k) = mean.at(camera_row, col);
  }
  return seen;
}

/// The same slice of a coaxial tensor that is not stored as symmetric: one pattern for each pixel of the
/// line.
Result<Image<float>> pixel_slice(const TransportTensor& tensor, int row) {
  return seen_on_row(tensor, row, tensor.projector_grid().cols, [&](int col) {
    Image<float> light(tensor.projector_grid());
    light.at(row, col) = 1;
    return light;
  });
}

/// If camera and projector have different grids, they have no common line. Then the projector lights stripes,
/// and the camera row is averaged to as many pieces.
Result<Image<float>> stripe_slice(const TransportTensor& tensor, int camera_row) {
  const Grid grid = tensor.projector_grid();
  const int stripes = std::min(grid.cols, 128);
  const auto stripe = [&](int k) {
    Image<float> light(grid);
    const auto begin = static_cast<int>(std::int64_t{grid.cols} * k / stripes);
    const auto end = static_cast<int>(std::int64_t{grid.cols} * (k + 1) / stripes);
    for (int row = 0; row < grid.rows; ++row)
      for (int col = begin; col < end; ++col) light.at(row, col) = 1;
    return light;
  };
  SYMRIG_TRY(const Image<float> seen, seen_on_row(tensor, camera_row, stripes, stripe));
  return resize_box(seen, {std::min(stripes, seen.grid().rows), stripes});
}

Result<Image<float>> slice_of(const TransportTensor& tensor, int row) {
  if (tensor.symmetric()) return symmetric_slice(tensor, row);
  return tensor.camera_grid() == tensor.projector_grid() ? pixel_slice(tensor, row)
                                                         : stripe_slice(tensor, row);
}

/// The value at the bright end of the scale. The diagonal is a thousand times brighter than the rest [Garg06
/// Fig. 2c], so the scale is chosen for the rest: this share of the positive values off the diagonal is below
/// it.
float top_of_scale(const Image<float>& slice) {
  constexpr double kShare = 0.99;
  std::vector<float> values;
  for (int row = 0; row < slice.grid().rows; ++row)
    for (int col = 0; col < slice.grid().cols; ++col)
      if (row != col && slice.at(row, col) > 0) values.push_back(slice.at(row, col));
  if (values.empty()) return *std::max_element(slice.values().begin(), slice.values().end());
  return quantile(values, kShare);
}

std::string slice_caption(const TransportTensor& tensor, int row) {
  if (tensor.camera_grid() == tensor.projector_grid())
    return fmt::format(
        "A slice of T: every pair of pixels on row {} of {}. Down: camera pixel; across: projector pixel. "
        "The diagonal is the direct light.",
        row, tensor.camera_grid().rows);
  return fmt::format(
      "The light on row {} of {} of the camera (down: camera column) when the projector lights "
      "vertical stripes from left to right (across: stripe).",
      row, tensor.camera_grid().rows);
}

std::string slice_figure(const Context& context, const Image<float>& slice, int row) {
  const TransportTensor& tensor = context.tensor();
  const float top = top_of_scale(slice);
  const float most = *std::max_element(slice.values().begin(), slice.values().end());
  const std::string scale = fmt::format(
      " Logarithmic, {} decades; brightest: {} or more (the largest is {}); darkest: less than {}, or "
      "negative. Radiance per unit of projector light.",
      kDecades, short_number(top), short_number(most), short_number(top * std::pow(0.1, kDecades)));
  return figure(log_colour(shrunk(slice, kPictureSide), top, kDecades),
                {.alt = "slice of T",
                 .caption_html = slice_caption(tensor, row) + scale,
                 .scale_html = colour_scale(short_number(top * std::pow(0.1, kDecades)), short_number(top)),
                 .file = context.file("slice"),
                 .values = &slice});
}

Result<std::string> level_figure(const Context& context, int row) {
  const TransportTensor& tensor = context.tensor();
  SYMRIG_TRY(const Image<float> levels, tensor.level_map(row));
  const int deepest = tensor.camera_tree().levels() - 1;
  return figure(
      level_greys(levels, deepest),
      {.alt = "level map of the slice",
       .caption_html =
           "The level of the leaf of each entry of that slice. White: a large block; dark: down to single "
           "pixels; dark red: nothing is stored.",
       .scale_html = level_scale(deepest),
       .file = context.file("slice-levels"),
       .values = &levels});
}

}  // namespace

Result<std::string> inside_section(const Context& context) {
  const TransportTensor& tensor = context.tensor();
  const int row = tensor.camera_grid().rows / 2;
  SYMRIG_TRY(const Image<float> flood, tensor.apply(Image<float>(tensor.projector_grid(), 1, 1.0F)));
  SYMRIG_TRY(const Image<float> slice, slice_of(tensor, row));
  std::vector<std::string> figures{
      figure(photograph_with_line(shrunk(flood, kPictureSide), white_level(flood),
                                  (row + 0.5) / tensor.camera_grid().rows),
             "flood-lit picture with the line of the slice",
             fmt::format("The line of the slice (red): row {}.", row)),
      slice_figure(context, slice, row)};
  if (tensor.symmetric()) {
    SYMRIG_TRY(std::string levels, level_figure(context, row));
    figures.push_back(std::move(levels));
  }
  return section(
      "inside", "Inside the transport",
      paragraph("T holds, for every camera pixel, how much light it gets from every projector pixel: "
                "photograph = T · pattern.") +
          row_of(figures, 300));
}

namespace {

struct Range {
  float low = 0, high = 0;
};

Range range_of(const Image<float>& values) {
  const auto [low, high] = std::minmax_element(values.values().begin(), values.values().end());
  return {*low, *high};
}

/// Colours from low to high, with the flood-lit scene showing through.
Picture over_the_scene(const Image<float>& values, Range range, const Picture& scene) {
  constexpr double kColour = 0.72;
  Picture picture(values.grid(), 3);
  for (std::size_t i = 0; i < values.values().size(); ++i) {
    const double share = range.high > range.low
                             ? static_cast<double>(values.values()[i] - range.low) / (range.high - range.low)
                             : 0;
    const Rgb colour = colour_of(share);
    const double grey = (scene.plane(0)[i] + scene.plane(1)[i] + scene.plane(2)[i]) / 3.0;
    for (int c = 0; c < 3; ++c)
      picture.plane(c)[i] =
          static_cast<std::uint8_t>(std::lround(kColour * colour[c] + (1 - kColour) * grey));
  }
  return picture;
}

/// Ignores a difference below rounding.
Range visible(Range range) {
  return range.high - range.low > 1e-3F * std::max(1.0F, range.high) ? range : Range{range.low, range.low};
}

}  // namespace

Result<std::string> maps_over_the_picture(const Context& context) {
  const TransportTensor& tensor = context.tensor();
  SYMRIG_TRY(const Image<float> flood, tensor.apply(Image<float>(tensor.projector_grid(), 1, 1.0F)));
  const Picture scene = photograph(shrunk(flood, kPictureSide), white_level(flood));
  const PixelDepth depth = pixel_depth(tensor);
  const auto shown = [&](const Image<float>& values, const char* alt, const char* name,
                         const std::string& caption) {
    const Image<float> small = shrunk(values, kPictureSide);
    const Range range = visible(range_of(small));
    return figure(over_the_scene(small, range, scene),
                  {.alt = alt,
                   .caption_html = caption,
                   .scale_html = colour_scale(short_number(range.low), short_number(range.high)),
                   .file = context.file(name),
                   .values = &values});
  };
  return "<h3>Over the picture</h3>\n" +
         row_of({shown(depth.level, "mean level over the picture", "mean-level",
                       fmt::format("How finely the transport of each pixel is divided: the mean level of the "
                                   "leaves in its row of "
                                   "T (0: the whole picture, {}: single pixels). The scene is visible "
                                   "through the colours.",
                                   tensor.camera_tree().levels() - 1)),
                 shown(depth.terms, "terms over the picture", "terms",
                       "The number of terms of each pixel's row of T: products of two pictures and single "
                       "entries. The "
                       "scene is visible through the colours.")},
                300);
}

std::string ranks_of_leaves(const TransportTensor& tensor) {
  std::vector<std::int64_t> count;
  for (const Leaf& leaf : tensor.leaves()) {
    const std::size_t rank = std::max(0, leaf.rank);
    if (rank >= count.size()) count.resize(rank + 1);
    ++count[rank];
  }
  std::vector<Bar> bars;
  constexpr std::size_t kMostBars = 12;
  for (std::size_t rank = 0; rank < count.size() && bars.size() < kMostBars; ++rank)
    if (count[rank] > 0)
      bars.push_back({fmt::format("rank {}", rank), static_cast<double>(count[rank]),
                      grouped(static_cast<double>(count[rank])), true});
  if (bars.empty()) return {};
  return "<h3>Ranks</h3>\n" +
         paragraph(
             "Low-rank leaves by rank. The rank is the number of products of two pictures whose sum is the "
             "leaf.") +
         log_bars(bars, "leaves");
}

}  // namespace symrig::report
