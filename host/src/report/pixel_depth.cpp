// SPDX-License-Identifier: Apache-2.0
#include "report/pixel_depth.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace symrig::report {
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
