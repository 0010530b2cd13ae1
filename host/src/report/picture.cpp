// SPDX-License-Identifier: Apache-2.0

#include "report/picture.hpp"

#include "symrig/base/statistics.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/image.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

namespace symrig::report {

namespace {

// Every 17th of the 256 published sRGB colours of viridis. Its lightness increases evenly, for colour-blind
// readers and for grey print. Linear interpolation errs by at most 7 codes. Source: S. van der Walt, N. J.
// Smith, "A better default colormap for matplotlib", SciPy 2015 (data in the public domain, CC0).
constexpr std::array<Rgb, 16> kViridis{{{68, 1, 84},
                                        {72, 26, 108},
                                        {71, 47, 125},
                                        {65, 68, 135},
                                        {57, 86, 140},
                                        {49, 104, 142},
                                        {42, 120, 142},
                                        {35, 136, 142},
                                        {31, 152, 139},
                                        {34, 168, 132},
                                        {53, 183, 121},
                                        {84, 197, 104},
                                        {122, 209, 81},
                                        {165, 219, 54},
                                        {210, 226, 27},
                                        {253, 231, 37}}};

std::uint8_t byte(double share) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)));
}

void put(Picture& picture, std::int64_t pixel, Rgb colour) {
  for (int c = 0; c < 3; ++c) picture.plane(c)[pixel] = colour[c];
}

}  // namespace

std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < n ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= n ? kDigits[word >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

float white_level(const Image<float>& image, double share) {
  std::vector<float> values;
  values.reserve(image.values().size());
  for (const float v : image.values())
    if (std::isfinite(v)) values.push_back(v);
  if (values.empty()) return 0;
  const float level = quantile(values, share);
  return level > 0 ? level : std::max(0.0F, *std::max_element(values.begin(), values.end()));
}

Picture photograph(const Image<float>& image, float white) {
  Picture picture(image.grid(), 3);
  const Image<std::uint8_t> codes = to_display(image, white > 0 ? 1.0 / static_cast<double>(white) : 1.0);
  const int last = codes.channels() == 3 ? 2 : 0;
  for (int c = 0; c < 3; ++c) std::ranges::copy(codes.plane(std::min(c, last)), picture.plane(c).begin());
  return picture;
}

Picture photograph_with_line(const Image<float>& image, float white, double height) {
  Picture picture = photograph(image, white);
  const Grid grid = image.grid();
  const int thick = std::max(1, grid.rows / 150);
  const int top = std::clamp(static_cast<int>(height * grid.rows) - thick / 2, 0, grid.rows - thick);
  for (int row = top; row < top + thick; ++row)
    for (int col = 0; col < grid.cols; ++col)
      put(picture, std::int64_t{row} * grid.cols + col, {255, 70, 50});
  return picture;
}

Image<float> difference(const Image<float>& a, const Image<float>& b) {
  Image<float> sum(a.grid());
  for (int c = 0; c < a.channels(); ++c)
    for (std::size_t i = 0; i < sum.values().size(); ++i)
      sum.values()[i] += std::abs(a.plane(c)[i] - b.plane(c)[i]) / static_cast<float>(a.channels());
  return sum;
}

Rgb colour_of(double share) {
  const double at = std::clamp(std::isnan(share) ? 0.0 : share, 0.0, 1.0) * (kViridis.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), kViridis.size() - 2);
  const double part = at - static_cast<double>(below);
  Rgb colour{};
  for (std::size_t c = 0; c < colour.size(); ++c)
    colour[c] = byte(((1 - part) * kViridis[below][c] + part * kViridis[below + 1][c]) / 255);
  return colour;
}

Picture false_colour(const Image<float>& image, float top) {
  Picture picture(image.grid(), 3);
  for (std::int64_t i = 0; i < image.grid().size(); ++i)
    put(picture, i, colour_of(top > 0 ? image.plane(0)[i] / top : 0));
  return picture;
}

Picture log_colour(const Image<float>& image, float top, int decades) {
  Picture picture(image.grid(), 3);
  for (std::int64_t i = 0; i < image.grid().size(); ++i) {
    const float v = image.plane(0)[i];
    put(picture, i,
        colour_of(v > 0 && top > 0
                      ? 1 + std::log10(static_cast<double>(v) / static_cast<double>(top)) / decades
                      : 0));
  }
  return picture;
}

Rgb level_grey(int level, int deepest) {
  if (level < 0) return {90, 20, 20};
  const std::uint8_t v = byte(1 - 0.85 * level / std::max(1, deepest));
  return {v, v, v};
}

Picture level_greys(const Image<float>& levels, int deepest) {
  Picture picture(levels.grid(), 3);
  for (std::int64_t i = 0; i < levels.grid().size(); ++i)
    put(picture, i, level_grey(static_cast<int>(levels.plane(0)[i]), deepest));
  return picture;
}

Image<float> shrunk(const Image<float>& image, int side) {
  const Grid grid = image.grid();
  const int longer = std::max(grid.rows, grid.cols);
  if (longer <= side) return image;
  const auto scaled = [&](int n) { return std::max(1, static_cast<int>(std::int64_t{n} * side / longer)); };
  return resize_box(image, {scaled(grid.rows), scaled(grid.cols)});
}

std::string data_uri(const Picture& picture) {
  return "data:image/png;base64," + base64(encode_png(picture));
}

namespace {

/// Sums over ranges of pixels in tree order: each range costs two additions.
class RangeSums {
 public:
  explicit RangeSums(std::int64_t pixels) : steps_(static_cast<std::size_t>(pixels) + 1) {}

  void add(std::int32_t begin, std::int32_t end, double value) {
    steps_[begin] += value;
    steps_[end] -= value;
  }
  std::vector<double> sums() const {
    std::vector<double> out(steps_.size() - 1);
    double sum = 0;
    for (std::size_t t = 0; t < out.size(); ++t) out[t] = sum += steps_[t];
    return out;
  }

 private:
  std::vector<double> steps_;
};

class Depth {
 public:
  explicit Depth(std::int64_t pixels) : entries_(pixels), levels_(pixels), terms_(pixels) {}

  /// Adds a leaf between two ranges; it also counts for its mirror image.
  void add(std::int32_t row_begin, std::int32_t row_end, std::int32_t col_begin, std::int32_t col_end,
           int level, double terms) {
    add_rows(row_begin, row_end, col_end - col_begin, level, terms);
    if (row_begin != col_begin) add_rows(col_begin, col_end, row_end - row_begin, level, terms);
  }
  void add_rows(std::int32_t begin, std::int32_t end, double cols, int level, double terms) {
    entries_.add(begin, end, cols);
    levels_.add(begin, end, cols * level);
    terms_.add(begin, end, terms);
  }
  PixelDepth on(const BlockTree& tree) const {
    PixelDepth depth{Image<float>(tree.grid()), Image<float>(tree.grid())};
    const std::vector<double> entries = entries_.sums(), levels = levels_.sums(), terms = terms_.sums();
    for (std::size_t t = 0; t < entries.size(); ++t) {
      const std::size_t raster = tree.order()[t];
      depth.level.values()[raster] = entries[t] > 0.5 ? static_cast<float>(levels[t] / entries[t]) : 0.0F;
      depth.terms.values()[raster] = static_cast<float>(std::max(0.0, terms[t]));
    }
    return depth;
  }

 private:
  RangeSums entries_, levels_, terms_;
};

}  // namespace

PixelDepth pixel_depth(const TransportTensor& tensor) {
  const BlockTree& tree = tensor.camera_tree();
  const auto pixels = static_cast<std::int32_t>(tree.grid().size());
  Depth depth(pixels);
  for (const Leaf& leaf : tensor.leaves())
    depth.add(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.level, leaf.rank);
  for (const ScalarLeaf& at : tensor.scalars())
    depth.add(at.row, at.row + 1, at.col, at.col + 1, tensor.scalar_level(at), 1);
  for (int l = 0; l < std::min(tensor.levels(), tree.levels()); ++l)
    for (const EmptyLeaf& empty : tensor.empties(l)) {
      const Block& i = tree.level(l)[empty.row_block];
      const Block& j = tree.level(l)[empty.col_block];
      depth.add(i.begin, i.end, j.begin, j.end, l, 0);
    }
  for (const BandLeaf& band : tensor.bands()) {
    const double near = 2.0 * static_cast<double>(band_offsets(band.radius).size());
    depth.add_rows(0, pixels, near, tree.levels() - 1, near);
  }
  return depth.on(tree);
}

}  // namespace symrig::report
