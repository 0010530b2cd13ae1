// SPDX-License-Identifier: Apache-2.0

#include "viewer/page_tensor.hpp"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

namespace symrig::viewer {

void EntrySums::add(std::int32_t row, std::int32_t col, std::span<const float> values) {
  if (page_.symmetric && row == col) {
    add_to_diagonal(row, values);
    return;
  }
  if (page_.symmetric && row < col) std::swap(row, col);
  Entry entry{row, col, {}};
  std::copy(values.begin(), values.end(), entry.values.begin());
  entries_.push_back(entry);
}

void EntrySums::add(std::span<const ScalarLeaf> at, std::span<const float> values) {
  const std::size_t channels = page_.channels;
  for (std::size_t k = 0; k < at.size(); ++k)
    add(at[k].row, at[k].col, values.subspan(k * channels, channels));
}

void EntrySums::add_to_diagonal(std::int32_t pixel, std::span<const float> values) {
  const std::size_t pixels = page_.camera.order.size();
  page_.diagonal.resize(pixels * values.size());
  for (std::size_t channel = 0; channel < values.size(); ++channel)
    page_.diagonal[channel * pixels + pixel] += values[channel];
}

void EntrySums::finish() {
  const auto place = [](const Entry& entry) { return std::tuple(entry.row, entry.col); };
  // Stable: the order of the sums is that of the entries, so the page has the same bytes every time.
  std::stable_sort(entries_.begin(), entries_.end(),
                   [&](const Entry& a, const Entry& b) { return place(a) < place(b); });
  const std::size_t channels = page_.channels;
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    const bool same = k > 0 && place(entries_[k]) == place(entries_[k - 1]);
    if (!same) {
      page_.entries.push_back({entries_[k].row, entries_[k].col});
      page_.entry_values.resize(page_.entry_values.size() + channels);
    }
    for (std::size_t channel = 0; channel < channels; ++channel)
      page_.entry_values[page_.entry_values.size() - channels + channel] += entries_[k].values[channel];
  }
}

namespace {

PageSide side_of(const BlockTree& tree) {
  return {tree.grid(), {tree.order().begin(), tree.order().end()}, {}};
}

}  // namespace

PageLeaf page_leaf(const Leaf& leaf, bool symmetric) {
  const bool own_mirror_image = leaf.row_begin == leaf.col_begin && leaf.row_end == leaf.col_end;
  return {leaf.row_begin,
          leaf.row_end,
          leaf.col_begin,
          leaf.col_end,
          leaf.rank,
          leaf.level,
          symmetric && !own_mirror_image ? 1 : 0};
}

Result<PageTensor> page_tensor(const TransportTensor& tensor) {
  PageTensor page;
  page.camera = side_of(tensor.camera_tree());
  page.projector = side_of(tensor.projector_tree());
  page.channels = tensor.channels();
  page.symmetric = tensor.symmetric();
  for (const Leaf& leaf : tensor.leaves()) page.leaves.push_back(page_leaf(leaf, page.symmetric));
  SYMRIG_TRY(page.factors, tensor.factors());
  EntrySums sums(page);
  sums.add(tensor.scalars(), tensor.scalar_values());
  sums.finish();
  page.bands = tensor.bands();
  page.columns.assign(tensor.columns().begin(), tensor.columns().end());
  page.column_rows.assign(tensor.column_rows().begin(), tensor.column_rows().end());
  page.column_values.assign(tensor.column_values().begin(), tensor.column_values().end());
  return page;
}

namespace {

/// The pixels of one side, and the coarse pixel of each.
struct Coarse {
  PageSide side;
  std::vector<std::int32_t> of;  // [pixel of the scene] = coarse pixel; tree order
};

/// Numbers the different values of a list in their order: {40, 10, 40} becomes {1, 0, 1}.
std::vector<int> ranks_of(const std::vector<int>& values, int& count) {
  std::map<int, int> rank;
  for (const int value : values) rank.emplace(value, 0);
  count = 0;
  for (auto& [value, number] : rank) number = count++;
  std::vector<int> ranks(values.size());
  std::transform(values.begin(), values.end(), ranks.begin(), [&](int value) { return rank.at(value); });
  return ranks;
}

/// The tree cuts rows and columns apart, so the blocks of a level form a grid of unequal rows and columns.
Result<Coarse> coarse_side(const BlockTree& tree, int levels) {
  const int level = tree.levels() - 1 - levels;
  if (level < 0)
    return Error{ErrorCode::limit, "the scene cannot be reduced any further", "allow a larger page"};
  std::vector<int> tops, lefts;
  Coarse coarse;
  for (const Block& block : tree.level(level)) {
    tops.push_back(block.row);
    lefts.push_back(block.col);
    coarse.side.areas.push_back(static_cast<float>(block.size()));
    coarse.of.insert(coarse.of.end(), block.size(), static_cast<std::int32_t>(tops.size()) - 1);
  }
  const std::vector<int> rows = ranks_of(tops, coarse.side.grid.rows);
  const std::vector<int> cols = ranks_of(lefts, coarse.side.grid.cols);
  if (coarse.side.grid.size() != std::ssize(rows))
    return Error{ErrorCode::limit, "the blocks of this scene form no smaller grid", "allow a larger page"};
  for (std::size_t k = 0; k < rows.size(); ++k)
    coarse.side.order.push_back(rows[k] * coarse.side.grid.cols + cols[k]);
  return coarse;
}

/// Adds up the pixels of each coarse pixel: columns of a factor with the range [begin, end).
std::vector<float> summed(std::span<const float> factor, std::int32_t begin, std::int32_t end,
                          std::int32_t rank, const std::vector<std::int32_t>& of) {
  const std::int32_t first = of[begin], wide = of[end - 1] - first + 1;
  std::vector<float> sums(static_cast<std::size_t>(wide) * rank);
  for (std::int32_t k = 0; k < rank; ++k)
    for (std::int32_t i = 0; i < end - begin; ++i)
      sums[static_cast<std::size_t>(k) * wide + of[begin + i] - first] +=
          factor[static_cast<std::size_t>(k) * (end - begin) + i];
  return sums;
}

class Reduction {
 public:
  Reduction(const PageTensor& fine, Coarse camera, Coarse projector)
      : fine_(fine), rows_(std::move(camera.of)), cols_(std::move(projector.of)), sums_(page_) {
    page_.camera = std::move(camera.side);
    page_.projector = std::move(projector.side);
    page_.channels = fine.channels;
    page_.symmetric = fine.symmetric;
  }

  PageTensor run() && {
    add_leaves();
    add_diagonal();
    for (std::size_t k = 0; k < fine_.entries.size(); ++k)
      add_entry(fine_.entries[k], std::span(fine_.entry_values)
                                      .subspan(k * fine_.channels, static_cast<std::size_t>(fine_.channels)));
    for (const BandLeaf& band : fine_.bands) add_band(band);
    sums_.finish();
    return std::move(page_);
  }

 private:
  /// An entry off the diagonal of a symmetric tensor may land on it, together with its mirror image.
  void add_entry(const ScalarLeaf& at, std::span<const float> values) {
    const std::int32_t row = rows_[at.row], col = cols_[at.col];
    sums_.add(row, col, values);
    if (fine_.symmetric && at.row != at.col && row == col) sums_.add(row, col, values);
  }

  void add_diagonal() {
    const std::size_t pixels = rows_.size();
    std::vector<float> values(fine_.channels);
    for (std::size_t i = 0; i < (fine_.diagonal.empty() ? 0 : pixels); ++i) {
      for (std::size_t c = 0; c < values.size(); ++c) values[c] = fine_.diagonal[c * pixels + i];
      sums_.add(rows_[i], cols_[i], values);
    }
  }

  void add_leaves() {
    const float* at = fine_.factors.data();
    for (const PageLeaf& leaf : fine_.leaves) {
      std::vector<std::vector<float>> sides;
      for (int side = 0; side < 2 * fine_.channels; ++side) {
        const bool a = side % 2 == 0;
        const std::int32_t begin = a ? leaf.row_begin : leaf.col_begin, end = a ? leaf.row_end : leaf.col_end;
        const std::size_t values = static_cast<std::size_t>(end - begin) * leaf.rank;
        sides.push_back(summed({at, values}, begin, end, leaf.rank, a ? rows_ : cols_));
        at += values;
      }
      add_leaf({rows_[leaf.row_begin], rows_[leaf.row_end - 1] + 1, cols_[leaf.col_begin],
                cols_[leaf.col_end - 1] + 1, leaf.rank, leaf.level, leaf.mirrored},
               sides);
    }
  }

  /// A product that takes no less space than its entries becomes entries.
  void add_leaf(const PageLeaf& leaf, const std::vector<std::vector<float>>& sides) {
    if (static_cast<std::int64_t>(leaf.rank) * (leaf.rows() + leaf.cols()) <
        static_cast<std::int64_t>(leaf.rows()) * leaf.cols()) {
      page_.leaves.push_back(leaf);
      for (const auto& side : sides) page_.factors.insert(page_.factors.end(), side.begin(), side.end());
      return;
    }
    std::vector<float> values(fine_.channels);
    for (std::int32_t i = 0; i < leaf.rows(); ++i)
      for (std::int32_t j = 0; j < leaf.cols(); ++j) {
        for (std::size_t c = 0; c < values.size(); ++c)
          values[c] = product(leaf, sides[2 * c], sides[2 * c + 1], i, j);
        add_product(leaf, i, j, values);
      }
  }

  static float product(const PageLeaf& leaf, std::span<const float> a, std::span<const float> b,
                       std::int32_t i, std::int32_t j) {
    float sum = 0;
    for (std::int32_t k = 0; k < leaf.rank; ++k)
      sum +=
          a[static_cast<std::size_t>(k) * leaf.rows() + i] * b[static_cast<std::size_t>(k) * leaf.cols() + j];
    return sum;
  }

  /// EntrySums takes an entry off the diagonal for two. A leaf that is its own mirror image lists both, so
  /// the second one is left out. A mirrored leaf lists one, and on the diagonal that one counts twice.
  void add_product(const PageLeaf& leaf, std::int32_t i, std::int32_t j, std::span<const float> values) {
    const std::int32_t row = leaf.row_begin + i, col = leaf.col_begin + j;
    if (fine_.symmetric && leaf.mirrored == 0 && row < col) return;
    sums_.add(row, col, values);
    if (leaf.mirrored != 0 && row == col) sums_.add(row, col, values);
  }

  void add_band(const BandLeaf& band) {
    const std::vector<BandOffset> offsets = band_offsets(band.radius);
    const Grid grid = fine_.camera.grid;
    const std::size_t pixels = grid.size();
    std::vector<std::int32_t> tree(pixels);  // [raster] = tree index
    for (std::size_t t = 0; t < pixels; ++t) tree[fine_.camera.order[t]] = static_cast<std::int32_t>(t);
    std::vector<float> values(fine_.channels);
    for (std::size_t k = 0; k < offsets.size(); ++k)
      for (std::size_t i = 0; i < pixels; ++i) {
        const int row = static_cast<int>(i / grid.cols) + offsets[k].dy;
        const int col = static_cast<int>(i % grid.cols) + offsets[k].dx;
        if (row >= grid.rows || col < 0 || col >= grid.cols) continue;
        for (std::size_t c = 0; c < values.size(); ++c)
          values[c] = band.values[(c * offsets.size() + k) * pixels + i];
        add_entry({tree[i], tree[static_cast<std::size_t>(row) * grid.cols + col]}, values);
      }
  }

  const PageTensor& fine_;
  std::vector<std::int32_t> rows_, cols_;
  PageTensor page_;
  EntrySums sums_;
};

}  // namespace

Result<PageTensor> reduced_tensor(const TransportTensor& tensor, int levels) {
  if (!tensor.camera_tree().views().single())
    return Error{ErrorCode::limit, "a scene of several views cannot be reduced", "allow a larger page"};
  if (!tensor.columns().empty())
    return Error{ErrorCode::limit, "measured columns cannot be reduced", "allow a larger page"};
  SYMRIG_TRY(Coarse camera, coarse_side(tensor.camera_tree(), levels));
  SYMRIG_TRY(Coarse projector, coarse_side(tensor.projector_tree(), levels));
  SYMRIG_TRY(const PageTensor fine, page_tensor(tensor));
  return Reduction(fine, std::move(camera), std::move(projector)).run();
}

}  // namespace symrig::viewer
