// SPDX-License-Identifier: Apache-2.0

#include "viewer/camera_view.hpp"

#include "symrig/hdr/mosaic.hpp"
#include "symrig/tensor/internal/half.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

namespace symrig::viewer {
namespace {

using Parts = CameraTransport::Parts;

struct Place {
  double x = 0, y = 0;
};

/// Of a pixel or cell, in shares of its grid.
Place middle_of(Grid grid, std::int64_t number) {
  const std::int64_t row = number / grid.cols, col = number % grid.cols;
  return {(static_cast<double>(col) + 0.5) / grid.cols, (static_cast<double>(row) + 0.5) / grid.rows};
}

/// A cell and the sum of the places of pixels that look at it.
struct Looked {
  double x = 0, y = 0, pixels = 0;
};

/// The cell that sends most light to the middle of a group straight: that is where its pixels look.
std::int32_t cell_of(const Parts& parts, std::int64_t first, std::int32_t columns) {
  std::int32_t cell = -1;
  float most = 0;
  for (std::int64_t k = first; k < first + columns; ++k) {
    const float middle = tensor::from_half(parts.middles[k]);
    if (parts.columns[k] >= 0 || middle <= most) continue;
    most = middle;
    cell = -1 - parts.columns[k];
  }
  return cell;
}

std::vector<Looked> looked_at(const Parts& parts) {
  std::vector<Looked> cells(parts.cells.grid().size());
  std::int64_t column = 0, pixel = 0;
  for (const CameraTransport::Group& group : parts.groups) {
    const std::int32_t cell = cell_of(parts, column, group.columns);
    for (std::int32_t i = 0; i < group.pixels && cell >= 0; ++i) {
      const Place at = middle_of(parts.camera, parts.pixels[pixel + i]);
      cells[cell].x += at.x;
      cells[cell].y += at.y;
      ++cells[cell].pixels;
    }
    column += group.columns;
    pixel += group.pixels;
  }
  for (Looked& one : cells)
    if (one.pixels > 0) one.x /= one.pixels, one.y /= one.pixels;
  return cells;
}

/// x, y = [0] u + [1] v + [2].
using Affine = std::array<std::array<double, 3>, 2>;
constexpr Affine kSame{{{1, 0, 0}, {0, 1, 0}}};

Place mapped(const Affine& a, const Place& at) {
  return {a[0][0] * at.x + a[0][1] * at.y + a[0][2], a[1][0] * at.x + a[1][1] * at.y + a[1][2]};
}

/// Weighted sums for an affine map, about the middle of the weights.
class AffineSums {
 public:
  void add(double weight, const Place& cell, const Looked& seen) {
    const std::array<double, 4> one{cell.x, cell.y, seen.x, seen.y};
    weight_ += weight;
    for (std::size_t i = 0; i < one.size(); ++i) {
      sum_[i] += weight * one[i];
      for (std::size_t j = 0; j < 2; ++j) product_[i][j] += weight * one[i] * one[j];
    }
  }
  /// Nothing if the cells lie on one line.
  std::optional<Affine> map() const {
    const double uu = moment(0, 0), uv = moment(0, 1), vv = moment(1, 1), size = uu * vv - uv * uv;
    if (!(weight_ > 0 && size > 1e-9 * uu * vv)) return std::nullopt;
    Affine a{};
    for (std::size_t axis = 0; axis < a.size(); ++axis) {
      const double su = moment(2 + axis, 0), sv = moment(2 + axis, 1);
      const double u = (su * vv - sv * uv) / size, v = (sv * uu - su * uv) / size;
      a[axis] = {u, v, (sum_[2 + axis] - u * sum_[0] - v * sum_[1]) / weight_};
    }
    return a;
  }

 private:
  double moment(std::size_t i, std::size_t j) const {
    return product_[i][j] / weight_ - sum_[i] * sum_[j] / weight_ / weight_;
  }

  double weight_ = 0;
  std::array<double, 4> sum_{};
  std::array<std::array<double, 2>, 4> product_{};
};

double away(const Affine& a, Grid grid, std::int64_t cell, const Looked& seen) {
  const Place at = mapped(a, middle_of(grid, cell));
  return std::hypot(seen.x - at.x, seen.y - at.y);
}

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Of most of the cells: what is far from the map hardly counts in the next round.
std::optional<Affine> affine_of(Grid grid, const std::vector<Looked>& cells) {
  constexpr int kRounds = 8;
  std::optional<Affine> map;
  double usual = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds; ++round) {
    AffineSums sums;
    for (std::size_t c = 0; c < cells.size(); ++c)
      if (cells[c].pixels > 0) {
        const double far = map ? away(*map, grid, c, cells[c]) / usual : 0;
        sums.add(1 / (1 + far * far), middle_of(grid, c), cells[c]);
      }
    map = sums.map();
    if (!map) return map;
    std::vector<double> apart;
    for (std::size_t c = 0; c < cells.size(); ++c)
      if (cells[c].pixels > 0) apart.push_back(away(*map, grid, c, cells[c]));
    usual = std::max(median_of(apart), 1e-9);
  }
  return map;
}

/// What the affine map leaves around a cell: the median along each axis.
Place left_around(const Affine& a, Grid grid, const std::vector<Looked>& cells, int row, int col) {
  constexpr int kAround = 2;
  std::vector<double> x, y;
  for (int r = std::max(row - kAround, 0); r <= std::min(row + kAround, grid.rows - 1); ++r)
    for (int c = std::max(col - kAround, 0); c <= std::min(col + kAround, grid.cols - 1); ++c) {
      const std::int64_t cell = std::int64_t{r} * grid.cols + c;
      if (cells[cell].pixels == 0) continue;
      const Place at = mapped(a, middle_of(grid, cell));
      x.push_back(cells[cell].x - at.x);
      y.push_back(cells[cell].y - at.y);
    }
  return x.empty() ? Place{} : Place{median_of(x), median_of(y)};
}

}  // namespace

CellPlaces cell_places(const CameraTransport& camera) {
  const Grid grid = camera.projector_grid();
  const std::vector<Looked> cells = looked_at(camera.parts());
  const Affine a = affine_of(grid, cells).value_or(kSame);
  CellPlaces places;
  for (std::size_t k = 0; k < places.affine.size(); ++k)
    places.affine[k] = static_cast<float>(a[k / 3][k % 3]);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const Place at = mapped(a, middle_of(grid, std::int64_t{row} * grid.cols + col));
      const Place left = left_around(a, grid, cells, row, col);
      places.x.push_back(static_cast<float>(at.x + left.x));
      places.y.push_back(static_cast<float>(at.y + left.y));
    }
  return places;
}

namespace {

/// The rows of some pixels. to: of each pixel of the camera, its number in this grid, or −1.
Result<CameraTransport> rows_of(const CameraTransport& camera, Grid grid, std::span<const std::int32_t> to) {
  const Parts& from = camera.parts();
  Parts parts;
  parts.cells = from.cells;
  parts.camera = grid;
  parts.channels = from.channels;
  parts.bases = from.bases;
  parts.basis_values = from.basis_values;
  const auto append = [](auto& some, const auto& all, std::int64_t first, std::int32_t count) {
    some.insert(some.end(), all.begin() + first, all.begin() + first + count);
  };
  std::int64_t column = 0, pixel = 0, code = 0;
  for (const CameraTransport::Group& group : from.groups) {
    CameraTransport::Group kept{group.channel, group.columns, 0};
    for (std::int32_t i = 0; i < group.pixels; ++i, ++pixel, code += group.columns) {
      if (to[from.pixels[pixel]] < 0) continue;
      ++kept.pixels;
      parts.pixels.push_back(to[from.pixels[pixel]]);
      parts.brightness.push_back(from.brightness[pixel]);
      append(parts.codes, from.codes, code, group.columns);
    }
    if (kept.pixels > 0) {
      parts.groups.push_back(kept);
      append(parts.columns, from.columns, column, group.columns);
      append(parts.middles, from.middles, column, group.columns);
      append(parts.steps, from.steps, column, group.columns);
    }
    column += group.columns;
  }
  return CameraTransport::make(std::move(parts));
}

/// The pixels of a smaller picture of the same field: the middle one of each block.
std::vector<std::int32_t> thinned(Grid from, Grid to) {
  std::vector<std::int32_t> pixels;
  const auto at = [](int k, int few, int many) {
    return static_cast<int>((2LL * k + 1) * many / (2LL * few));
  };
  for (int row = 0; row < to.rows; ++row)
    for (int col = 0; col < to.cols; ++col)
      pixels.push_back(at(row, to.rows, from.rows) * from.cols + at(col, to.cols, from.cols));
  return pixels;
}

}  // namespace

Result<Image<float>> CameraView::Pixels::relit(const Image<float>& light) const {
  SYMRIG_TRY(Image<float> photograph, rows->apply(light));
  return colours.empty() ? std::move(photograph) : coloured(photograph, colours);
}

std::optional<CameraView> CameraView::make(std::shared_ptr<const CameraTransport> camera,
                                           std::int64_t most_quick) {
  if (camera->channels() != 1 && camera->channels() != 3) return std::nullopt;
  CameraView view;
  if (!camera->parts().mosaic.empty()) {
    const auto filters = parse_bayer(camera->parts().mosaic);
    const auto flood = camera->apply(Image<float>(camera->projector_grid(), 1, 1.F));
    auto colours = filters && flood ? colour_factors(*flood, *filters) : Error{ErrorCode::bad_value, "", ""};
    if (!colours) return std::nullopt;
    view.whole_.colours = *std::move(colours);
  }
  view.whole_.rows = std::move(camera);
  const Grid grid = view.camera().camera_grid();
  const double share = std::sqrt(static_cast<double>(most_quick) / static_cast<double>(grid.size()));
  if (share < 1)
    view.make_quick(
        {std::max(static_cast<int>(grid.rows * share), 1), std::max(static_cast<int>(grid.cols * share), 1)});
  return view;
}

void CameraView::make_quick(Grid grid) {
  const std::vector<std::int32_t> pixels = thinned(camera().camera_grid(), grid);
  std::vector<std::int32_t> to(camera().camera_grid().size(), -1);
  for (std::size_t k = 0; k < pixels.size(); ++k) to[pixels[k]] = static_cast<std::int32_t>(k);
  auto rows = rows_of(camera(), grid, to);
  if (!rows) return;
  quick_.rows = std::make_shared<const CameraTransport>(*std::move(rows));
  if (whole_.colours.empty()) return;
  quick_.colours = Image<float>(grid, 3);
  for (int channel = 0; channel < 3; ++channel)
    for (std::size_t k = 0; k < pixels.size(); ++k)
      quick_.colours.plane(channel)[k] = whole_.colours.plane(channel)[pixels[k]];
}

std::optional<Grid> CameraView::quick_grid() const {
  return quick_.rows ? std::optional(quick_.rows->camera_grid()) : std::nullopt;
}

Result<Image<float>> CameraView::seen_by(std::int32_t pixel) const {
  std::vector<std::int32_t> to(camera().camera_grid().size(), -1);
  to[pixel] = 0;
  SYMRIG_TRY(const CameraTransport row, rows_of(camera(), {1, 1}, to));
  const bool mosaic = !whole_.colours.empty();
  Image<float> seen(camera().projector_grid(), mosaic ? 1 : camera().channels());
  for (int channel = 0; channel < seen.channels(); ++channel) {
    Image<float> unit({1, 1}, camera().channels(), mosaic ? 1.F : 0.F);
    unit.plane(channel)[0] = 1;
    SYMRIG_TRY(const Image<float> light, row.adjoint(unit));
    std::ranges::copy(light.values(), seen.plane(channel).begin());
  }
  return seen;
}

}  // namespace symrig::viewer
