// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"
#include "report/picture.hpp"
#include "report/sections.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::report {
namespace {

constexpr int kDecades = 5;

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

/// One column of the picture for each light: what one camera row sees of it.
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

/// The same slice of a coaxial tensor that is not stored as symmetric: one pattern a pixel of the line.
Result<Image<float>> pixel_slice(const TransportTensor& tensor, int row) {
  return seen_on_row(tensor, row, tensor.projector_grid().cols, [&](int col) {
    Image<float> light(tensor.projector_grid());
    light.at(row, col) = 1;
    return light;
  });
}

/// Where camera and projector have different grids there is no common line: the projector lights stripes.
Result<Image<float>> stripe_slice(const TransportTensor& tensor, int camera_row) {
  const Grid grid = tensor.projector_grid();
  const int stripes = std::min(grid.cols, 128);
  return seen_on_row(tensor, camera_row, stripes, [&](int k) {
    Image<float> light(grid);
    const auto begin = static_cast<int>(std::int64_t{grid.cols} * k / stripes);
    const auto end = static_cast<int>(std::int64_t{grid.cols} * (k + 1) / stripes);
    for (int row = 0; row < grid.rows; ++row)
      for (int col = begin; col < end; ++col) light.at(row, col) = 1;
    return light;
  });
}

Result<Image<float>> slice_of(const TransportTensor& tensor, int row) {
  if (tensor.symmetric()) return symmetric_slice(tensor, row);
  return tensor.camera_grid() == tensor.projector_grid() ? pixel_slice(tensor, row)
                                                         : stripe_slice(tensor, row);
}

std::string slice_figure(const TransportTensor& tensor, const Image<float>& slice, int row) {
  const float top = *std::max_element(slice.values().begin(), slice.values().end());
  const bool coaxial = tensor.camera_grid() == tensor.projector_grid();
  const std::string what =
      coaxial
          ? fmt::format(
                "A slice of T: every pair of pixels on row {} of {} (row of the picture: camera pixel; "
                "column: "
                "projector pixel). The diagonal is the direct light.",
                row, tensor.camera_grid().rows)
          : fmt::format(
                "What camera row {} of {} sees (row of the picture: camera column) when the projector lights "
                "vertical stripes from left to right (column of the picture: stripe).",
                row, tensor.camera_grid().rows);
  return figure(
      log_colour(shrunk(slice, kPictureSide), top, kDecades), "slice of T",
      what +
          fmt::format(" Logarithmic, {} decades; black: less than 10⁻{} of the largest entry, or negative.",
                      kDecades, kDecades),
      colour_scale(short_number(top * 1e-5), short_number(top)));
}

Result<std::string> level_figure(const TransportTensor& tensor, int row) {
  SYMRIG_TRY(const Image<float> levels, tensor.level_map(row));
  const int deepest = tensor.camera_tree().levels() - 1;
  return figure(level_greys(levels, deepest), "level map",
                "The level at which each entry of that slice was found to be a leaf. White: a large block "
                "was enough; dark: "
                "down to single pixels; dark red: nothing is stored.",
                level_scale(deepest));
}

}  // namespace

Result<std::string> inside_section(const Context& context) {
  const TransportTensor& tensor = context.tensor();
  const int row = tensor.camera_grid().rows / 2;
  SYMRIG_TRY(const Image<float> flood, tensor.apply(Image<float>(tensor.projector_grid(), 1, 1.0F)));
  SYMRIG_TRY(const Image<float> slice, slice_of(tensor, row));
  std::vector<std::string> figures{figure(photograph_with_line(flood, white_level(flood), row),
                                          "flood-lit picture with the line of the slice",
                                          fmt::format("The line of the slice (red): row {}.", row)),
                                   slice_figure(tensor, slice, row)};
  if (tensor.symmetric()) {
    SYMRIG_TRY(std::string levels, level_figure(tensor, row));
    figures.push_back(std::move(levels));
  }
  return section(
      "inside", "Inside the transport",
      paragraph("T holds, for every camera pixel, how much light it gets from every projector pixel: "
                "photograph = T · pattern.") +
          row_of(figures, 300));
}

}  // namespace symrig::report
