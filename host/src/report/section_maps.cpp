// SPDX-License-Identifier: Apache-2.0
// The hierarchy over the picture: how finely the transport of each pixel is divided, and its number of terms.
#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/pixel_depth.hpp"
#include "report/save_link.hpp"
#include "report/sections.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::report {
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
