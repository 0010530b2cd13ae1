// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/camera_fit.hpp"

#include "calibration/camera_fit/cell_rows.hpp"
#include "calibration/camera_fit/footprint.hpp"
#include "calibration/camera_fit/pixel_fitter.hpp"
#include "symrig/image/outline.hpp"
#include "symrig/tensor/internal/half.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace symrig {
namespace {

using calibration::CellRows;
using calibration::FittedRow;
using calibration::PixelFitter;
using calibration::PixelLight;
using Column = CameraTransport::Column;

constexpr double kDoubtful = 1.2;   ///< a misfit above may mean that a pixel belongs to the next cell
constexpr double kBetter = 0.9;     ///< of the misfit in its own cell
constexpr double kUnexplained = 2;  ///< a misfit above is searched for its cause
constexpr double kMostDoubtful = 0.05, kMostSearched = 0.05;  ///< of the pixels
constexpr float kUnknown = -1;                                ///< light of a pixel
constexpr double kLeastBlur = 0.03;                           ///< [cells] no optics are sharper

/// The photographs of one channel, [pixels × photographs].
struct Seen {
  std::size_t photographs = 0;
  std::vector<float> mean, weight;  ///< weight: 1 / variance, 0 where a photograph is not valid

  std::span<const float> mean_of(std::size_t pixel) const {
    return std::span(mean).subspan(pixel * photographs, photographs);
  }
  std::span<const float> weight_of(std::size_t pixel) const {
    return std::span(weight).subspan(pixel * photographs, photographs);
  }
};

/// Rows of the camera that are fitted at once: those of a strip of the log.
struct Strip {
  int number = 0, first_row = 0, rows = 0, cols = 0;

  std::size_t pixels() const { return std::size_t{1} * rows * cols; }
  /// Of a pixel of the camera, counted from the strip's first.
  std::size_t index(std::int32_t pixel) const { return pixel - std::size_t{1} * first_row * cols; }
};

/// The pixels of a strip that belong to each cell, cell after cell.
struct PixelsOfCells {
  std::vector<std::int32_t> cell;   ///< those that any pixel belongs to
  std::vector<std::int64_t> first;  ///< of each of them in `pixel`; and the end
  std::vector<std::int32_t> pixel;

  std::span<const std::int32_t> of(std::size_t number) const {
    return std::span(pixel).subspan(first[number], first[number + 1] - first[number]);
  }
};

Point middle_of(const Outline& outline) {
  Point sum;
  for (const Point& corner : outline) sum.row += corner.row / 4, sum.col += corner.col / 4;
  return sum;
}

PixelsOfCells sorted_by_cell(std::vector<std::pair<std::int32_t, std::int32_t>> cells_and_pixels) {
  std::ranges::sort(cells_and_pixels);
  PixelsOfCells sorted;
  for (const auto& [cell, pixel] : cells_and_pixels) {
    if (sorted.cell.empty() || sorted.cell.back() != cell) {
      sorted.cell.push_back(cell);
      sorted.first.push_back(std::ssize(sorted.pixel));
    }
    sorted.pixel.push_back(pixel);
  }
  sorted.first.push_back(std::ssize(sorted.pixel));
  return sorted;
}

/// What the pixels of a channel share.
struct Channel {
  int number = 0;
  const CellRows& rows;
  CornerMap corners;
  double blur = 0;  ///< as footprint_of()
};

/// The cell that a point lies in; the next one, if the camera does not see that; −1: there is none.
std::int32_t cell_at(const CellRows& rows, const Point& at) {
  const Grid cells = rows.grid();
  if (!(at.row >= 0 && at.col >= 0 && at.row < cells.rows && at.col < cells.cols)) return -1;
  const int row = static_cast<int>(at.row), col = static_cast<int>(at.col);
  if (rows.seen(row * cells.cols + col)) return row * cells.cols + col;
  std::int32_t nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  for (int y = std::max(row - 1, 0); y <= std::min(row + 1, cells.rows - 1); ++y)
    for (int x = std::max(col - 1, 0); x <= std::min(col + 1, cells.cols - 1); ++x) {
      const double away = std::hypot(at.row - y - 0.5, at.col - x - 0.5);
      if (!rows.seen(y * cells.cols + x) || away >= least) continue;
      least = away;
      nearest = y * cells.cols + x;
    }
  return nearest;
}

/// sees: whether a pixel has a row in this channel.
template <class Sees>
PixelsOfCells pixels_of_cells(const Channel& channel, const Strip& strip, Sees&& sees) {
  std::vector<std::pair<std::int32_t, std::int32_t>> found;
  for (int row = strip.first_row; row < strip.first_row + strip.rows; ++row)
    for (int col = 0; col < strip.cols; ++col) {
      if (!sees(row, col)) continue;
      const std::int32_t cell = cell_at(channel.rows, middle_of(outline_of(channel.corners, row, col)));
      if (cell >= 0) found.emplace_back(cell, row * strip.cols + col);
    }
  return sorted_by_cell(std::move(found));
}

/// Everything that a fit of all pixels shares.
class CameraFitter {
 public:
  CameraFitter(const TransportTensor& tensor, const Registration& registration, const PhotographLog& log,
               const CameraFitOptions& options)
      : tensor_(tensor),
        registration_(registration),
        log_(log),
        options_(options),
        work_(options.progress),
        held_out_(options.held_out) {
    std::ranges::sort(held_out_);
  }

  Result<CameraTransport> fit();

 private:
  Result<void> check() const;
  Result<void> show_patterns();
  Result<Radiance> flood_on_cells() const;
  void show_bases(std::size_t from);
  Result<Seen> see(int channel, const Strip& strip, std::vector<float>& flood) const;
  using Rows = std::vector<FittedRow>;
  PixelFitter fitter_of(const Channel& channel) const { return {channel.rows, shown_, channel.blur}; }
  static std::vector<std::int32_t> worst(const Strip& strip, const PixelsOfCells& pixels, const Rows& best,
                                         double misfit, double share);
  Rows fit_rows(const Channel& channel, const Strip& strip, const PixelsOfCells& pixels,
                FittedRow (PixelFitter::*how)(const PixelLight&), std::span<const double> to_beat = {});
  void try_neighbours(const Channel& channel, const Strip& strip, const PixelsOfCells& pixels, Rows& best);
  void search(const Channel& channel, const Strip& strip, const PixelsOfCells& pixels, Rows& best);
  PackedRows packed(PixelFitter& fitter, const Strip& strip, std::span<const std::int32_t> pixels,
                    const Rows& best) const;
  Result<void> fit_strip(const Channel& channel, const Strip& strip);
  Result<void> fit_channel(int number);

  const TransportTensor& tensor_;
  const Registration& registration_;
  const PhotographLog& log_;
  const CameraFitOptions& options_;
  Work work_;
  std::vector<std::int64_t> held_out_;  // sorted
  std::size_t photographs_ = 0;
  std::vector<char> white_;
  Radiance seen_cells_;  // the flood-lit scene; a cell that the camera does not see is not valid
  calibration::Shown shown_;
  Seen seen_;                 // of the strip that is fitted
  std::vector<float> flood_;  // light of its pixels in the flood-lit scene
  std::vector<float> basis_values_;
  CameraTransport::Parts parts_;
};

Result<void> CameraFitter::check() const {
  const auto differ = [](const char* what, Grid theirs, Grid ours) {
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} has {}, the scene {}", what, to_string(theirs), to_string(ours)),
                 "take scene, registration and photographs of one capture"};
  };
  if (!tensor_.symmetric())
    return Error{ErrorCode::bad_argument,
                 "T on the cells is not symmetric, so its rows are not those of a camera pixel",
                 "capture the scene with an algorithm that uses symmetry, such as symrig"};
  if (registration_.cells != tensor_.projector_grid())
    return differ("the registration", registration_.cells, tensor_.projector_grid());
  if (log_.grid() != tensor_.projector_grid())
    return differ("the log", log_.grid(), tensor_.projector_grid());
  if (log_.camera_grid() != registration_.camera())
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the log's photographs are {}, the registered camera is {}",
                             to_string(log_.camera_grid()), to_string(registration_.camera())),
                 "keep the camera's own photographs in the log"};
  const bool of_mosaic = options_.mosaic.has_value();
  if (log_.channels() != (of_mosaic ? 1 : tensor_.channels()) || (of_mosaic && tensor_.channels() != 3))
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the log has {} channels, the scene {}", log_.channels(), tensor_.channels()),
                 "take scene and photographs of one capture"};
  return {};
}

/// The patterns, cell by cell.
Result<void> CameraFitter::show_patterns() {
  photographs_ = static_cast<std::size_t>(log_.size());
  const std::size_t cells = tensor_.projector_grid().size();
  shown_.photographs = photographs_;
  shown_.cells.resize(cells * photographs_);
  white_.assign(photographs_, 0);
  for (std::size_t k = 0; k < photographs_; ++k) {
    SYMRIG_TRY(const Pattern pattern, log_.pattern(static_cast<std::int64_t>(k)));
    white_[k] = std::ranges::all_of(pattern.values(), [](float v) { return v == 1; }) ? 1 : 0;
    for (std::size_t n = 0; n < cells; ++n) shown_.cells[n * photographs_ + k] = pattern.values()[n];
  }
  if (std::ranges::none_of(white_, [](char w) { return w != 0; }))
    return Error{ErrorCode::bad_value, "none of the photographs shows the flood-lit scene",
                 "keep all photographs of the capture"};
  return {};
}

Result<Radiance> CameraFitter::flood_on_cells() const {
  SYMRIG_TRY(const CellWeights weights,
             options_.mosaic ? registration_.weights_of_mosaic(*options_.mosaic) : registration_.weights());
  return weights.gather(registration_.flood);
}

/// Of the bases from number `from` on.
void CameraFitter::show_bases(std::size_t from) {
  const std::span<const std::int32_t> order = tensor_.camera_tree().order();
  std::size_t value = 0;
  for (std::size_t q = 0; q < from; ++q)
    value += static_cast<std::size_t>(parts_.bases[q].end - parts_.bases[q].begin) * parts_.bases[q].rank;
  const std::size_t columns = parts_.bases.empty() ? 0 : parts_.bases.back().first + parts_.bases.back().rank;
  shown_.bases.resize(columns * photographs_);
  std::vector<std::size_t> at(parts_.bases.size());
  for (std::size_t q = from; q < parts_.bases.size(); ++q) {
    at[q] = value;
    value += static_cast<std::size_t>(parts_.bases[q].end - parts_.bases[q].begin) * parts_.bases[q].rank;
  }
  tbb::parallel_for(from, parts_.bases.size(), [&](std::size_t q) {
    const LightBasis& basis = parts_.bases[q];
    const std::size_t length = basis.end - basis.begin;
    for (std::int32_t k = 0; k < basis.rank; ++k) {
      Eigen::Map<Eigen::VectorXf> sum(&shown_.bases[(basis.first + k) * photographs_],
                                      static_cast<Eigen::Index>(photographs_));
      sum.setZero();
      for (std::size_t j = 0; j < length; ++j)
        sum += basis_values_[at[q] + k * length + j] *
               Eigen::Map<const Eigen::VectorXf>(&shown_.cells[order[basis.begin + j] * photographs_],
                                                 static_cast<Eigen::Index>(photographs_));
    }
  });
}

/// flood: becomes the flood-lit light of each pixel, the weighted mean of all photographs of it; below 0:
/// none is valid.
Result<Seen> CameraFitter::see(int channel, const Strip& strip, std::vector<float>& flood) const {
  const std::size_t pixels = strip.pixels(), size = pixels * photographs_;
  Seen seen{photographs_, std::vector<float>(size), std::vector<float>(size)};
  std::vector<double> sum(pixels), weights(pixels);
  const int plane = options_.mosaic ? 0 : channel;
  Radiance photograph;
  for (std::size_t k = 0; k < photographs_; ++k) {
    SYMRIG_CHECK(log_.rows(static_cast<std::int64_t>(k), strip.number, photograph));
    const bool used = !std::ranges::binary_search(held_out_, static_cast<std::int64_t>(k));
    const auto mean = photograph.mean.plane(plane), variance = photograph.variance.plane(plane);
    const auto valid = photograph.valid.plane(plane);
    for (std::size_t i = 0; i < pixels; ++i) {
      const float weight = used && valid[i] != 0 ? 1 / std::max(variance[i], 1e-30F) : 0;
      seen.mean[i * photographs_ + k] = mean[i];
      seen.weight[i * photographs_ + k] = weight;
      if (white_[k] != 0) sum[i] += static_cast<double>(weight) * mean[i], weights[i] += weight;
    }
    work_.look();
  }
  flood.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    flood[i] = weights[i] > 0 ? std::max(static_cast<float>(sum[i] / weights[i]), 0.F) : kUnknown;
  return seen;
}

/// In the order of pixels.pixel. to_beat: a misfit for each pixel of the strip; rows that are no better are
/// empty.
CameraFitter::Rows CameraFitter::fit_rows(const Channel& channel, const Strip& strip,
                                          const PixelsOfCells& pixels,
                                          FittedRow (PixelFitter::*how)(const PixelLight&),
                                          std::span<const double> to_beat) {
  const int cols = registration_.cells.cols;
  Rows rows(pixels.pixel.size());
  tbb::enumerable_thread_specific<PixelFitter> fitters([&] { return fitter_of(channel); });
  tbb::parallel_for(std::size_t{0}, pixels.cell.size(), [&](std::size_t g) {
    const std::int32_t cell = pixels.cell[g];
    PixelFitter& fitter = fitters.local();
    fitter.begin(cell);
    for (std::int64_t k = pixels.first[g]; k < pixels.first[g + 1]; ++k) {
      const std::int32_t pixel = pixels.pixel[k];
      const std::size_t at = strip.index(pixel);
      const Outline outline = outline_of(channel.corners, pixel / strip.cols, pixel % strip.cols);
      PixelLight light{calibration::footprint_of(outline, cell / cols, cell % cols, channel.blur), flood_[at],
                       seen_.mean_of(at), seen_.weight_of(at)};
      if (flood_[at] == kUnknown) light.flood = flood_[at] = static_cast<float>(fitter.light_of(light));
      rows[k] = (fitter.*how)(light);
      if (!to_beat.empty() && !(rows[k].misfit < to_beat[at])) rows[k] = {};
      work_.add(fitter.operations());
    }
  });
  return rows;
}

/// Pixels whose misfit is above this one: at most a share of those of the strip, because they take long.
std::vector<std::int32_t> CameraFitter::worst(const Strip& strip, const PixelsOfCells& pixels,
                                              const Rows& best, double misfit, double share) {
  std::vector<std::pair<double, std::int32_t>> found;
  for (const std::int32_t pixel : pixels.pixel)
    if (best[strip.index(pixel)].misfit > misfit) found.emplace_back(-best[strip.index(pixel)].misfit, pixel);
  std::ranges::sort(found);
  const auto most = static_cast<std::size_t>(share * static_cast<double>(pixels.pixel.size()));
  found.resize(std::min(found.size(), most));
  std::vector<std::int32_t> numbers;
  numbers.reserve(found.size());
  for (const auto& [misfit_of_one, pixel] : found) numbers.push_back(pixel);
  return numbers;
}

// A cell at the edge of an object is measured by the pixels on one side of the edge. Those on the other are
// like the next cell, whose columns have their light. The photographs tell which pixels these are.
void CameraFitter::try_neighbours(const Channel& channel, const Strip& strip, const PixelsOfCells& pixels,
                                  Rows& best) {
  const Grid cells = registration_.cells;
  std::vector<double> to_beat(strip.pixels());
  std::vector<std::pair<std::int32_t, std::int32_t>> found;
  for (const std::int32_t pixel : worst(strip, pixels, best, kDoubtful, kMostDoubtful)) {
    to_beat[strip.index(pixel)] = kBetter * best[strip.index(pixel)].misfit;
    const Point at = middle_of(outline_of(channel.corners, pixel / strip.cols, pixel % strip.cols));
    const int row = static_cast<int>(at.row), col = static_cast<int>(at.col);
    const int other_row = at.row - row < 0.5 ? row - 1 : row + 1;
    const int other_col = at.col - col < 0.5 ? col - 1 : col + 1;
    for (const auto& [y, x] : {std::pair{other_row, col}, {row, other_col}, {other_row, other_col}})
      if (y >= 0 && x >= 0 && y < cells.rows && x < cells.cols && channel.rows.seen(y * cells.cols + x))
        found.emplace_back(y * cells.cols + x, pixel);
  }
  const PixelsOfCells others = sorted_by_cell(std::move(found));
  Rows rows = fit_rows(channel, strip, others, &PixelFitter::fit, to_beat);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    FittedRow& row = best[strip.index(others.pixel[k])];
    if (!rows[k].row.empty() && rows[k].misfit < row.misfit) row = std::move(rows[k]);
  }
}

void CameraFitter::search(const Channel& channel, const Strip& strip, const PixelsOfCells& pixels,
                          Rows& best) {
  std::vector<std::pair<std::int32_t, std::int32_t>> found;
  for (const std::int32_t pixel : worst(strip, pixels, best, kUnexplained, kMostSearched))
    found.emplace_back(best[strip.index(pixel)].cell, pixel);
  const PixelsOfCells searched = sorted_by_cell(std::move(found));
  Rows rows = fit_rows(channel, strip, searched, &PixelFitter::fit_and_search);
  for (std::size_t k = 0; k < rows.size(); ++k) best[strip.index(searched.pixel[k])] = std::move(rows[k]);
}

/// Cells that a search found for one pixel are columns of all pixels of its group.
PackedRows CameraFitter::packed(PixelFitter& fitter, const Strip& strip, std::span<const std::int32_t> pixels,
                                const Rows& best) const {
  std::vector<Column> columns = fitter.columns();
  std::vector<float> shown = fitter.most_shown(), rows, light;
  const std::size_t own = columns.size();
  for (const std::int32_t pixel : pixels)
    for (const CellRows::Entry& entry : best[strip.index(pixel)].found)
      if (std::ranges::find(columns.begin() + own, columns.end(), -1 - entry.cell) == columns.end()) {
        columns.push_back(-1 - entry.cell);
        shown.push_back(1);
      }
  for (const std::int32_t pixel : pixels) {
    const FittedRow& row = best[strip.index(pixel)];
    const std::size_t first = rows.size();
    rows.insert(rows.end(), row.row.begin(), row.row.end());
    rows.resize(first + columns.size());
    for (const CellRows::Entry& entry : row.found)
      rows[first + (std::ranges::find(columns.begin() + own, columns.end(), -1 - entry.cell) -
                    columns.begin())] = entry.value;
    light.push_back(flood_[strip.index(pixel)]);
  }
  return pack_rows(columns, shown, rows, light);
}

Result<void> CameraFitter::fit_strip(const Channel& channel, const Strip& strip) {
  const auto sees = [&](int row, int col) {
    return !options_.mosaic || options_.mosaic->at(row, col) == channel.number;
  };
  PixelsOfCells pixels = pixels_of_cells(channel, strip, sees);
  seen_ = {};  // before the next is there
  SYMRIG_TRY(seen_, see(channel.number, strip, flood_));
  Rows best(strip.pixels()), rows = fit_rows(channel, strip, pixels, &PixelFitter::fit);
  for (std::size_t k = 0; k < rows.size(); ++k) best[strip.index(pixels.pixel[k])] = std::move(rows[k]);
  try_neighbours(channel, strip, pixels, best);
  search(channel, strip, pixels, best);

  std::vector<std::pair<std::int32_t, std::int32_t>> chosen;
  chosen.reserve(pixels.pixel.size());
  for (const std::int32_t pixel : pixels.pixel) chosen.emplace_back(best[strip.index(pixel)].cell, pixel);
  pixels = sorted_by_cell(std::move(chosen));
  std::vector<PackedRows> groups(pixels.cell.size());
  tbb::enumerable_thread_specific<PixelFitter> fitters([&] { return fitter_of(channel); });
  tbb::parallel_for(std::size_t{0}, pixels.cell.size(), [&](std::size_t g) {
    PixelFitter& fitter = fitters.local();
    fitter.begin(pixels.cell[g]);
    groups[g] = packed(fitter, strip, pixels.of(g), best);
  });
  for (const PackedRows& group : groups) {
    parts_.groups.push_back({channel.number, static_cast<std::int32_t>(group.columns.size()),
                             static_cast<std::int32_t>(group.brightness.size())});
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(parts_.columns, group.columns);
    append(parts_.middles, group.middles);
    append(parts_.steps, group.steps);
    append(parts_.brightness, group.brightness);
    append(parts_.codes, group.codes);
  }
  parts_.pixels.insert(parts_.pixels.end(), pixels.pixel.begin(), pixels.pixel.end());
  seen_ = {};
  return {};
}

Result<void> CameraFitter::fit_channel(int number) {
  const std::size_t first_basis = parts_.bases.size();
  SYMRIG_TRY(const CellRows rows, CellRows::make(tensor_, number, seen_cells_.valid.plane(number),
                                                 parts_.bases, basis_values_, work_));
  show_bases(first_basis);
  const OpticsBlur& optics = registration_.blur;
  const double measured = optics.measured ? std::hypot(optics.projector, optics.camera) : 0;
  const Channel channel{number, rows,
                        registration_.maps[registration_.maps.size() == 1 ? 0 : number].corners(),
                        std::hypot(measured, kLeastBlur, registration_.error())};
  const Grid camera = registration_.camera();
  for (int row = 0, strip = 0; row < camera.rows; row += kLogStripRows, ++strip)
    SYMRIG_CHECK(fit_strip(channel, {strip, row, std::min(kLogStripRows, camera.rows - row), camera.cols}));
  return {};
}

Result<CameraTransport> CameraFitter::fit() {
  SYMRIG_CHECK(check());
  return stoppable(work_, [&]() -> Result<CameraTransport> {
    work_.begin("fitting the camera's pixels", 0, log_.size());
    SYMRIG_TRY(seen_cells_, flood_on_cells());  // while there is memory
    SYMRIG_CHECK(show_patterns());
    parts_.cells = tensor_.camera_tree();
    parts_.camera = registration_.camera();
    parts_.channels = tensor_.channels();
    parts_.registration = options_.registration;
    if (options_.mosaic)
      for (const int colour : options_.mosaic->colours) parts_.mosaic += "RGB"[colour];
    for (int channel = 0; channel < parts_.channels; ++channel) SYMRIG_CHECK(fit_channel(channel));
    parts_.basis_values.reserve(basis_values_.size());
    for (const float value : basis_values_) parts_.basis_values.push_back(tensor::to_half(value));
    return CameraTransport::make(std::move(parts_));
  });
}

}  // namespace

Result<CameraTransport> fit_camera(const TransportTensor& tensor, const Registration& registration,
                                   const PhotographLog& photographs, const CameraFitOptions& options) {
  return CameraFitter(tensor, registration, photographs, options).fit();
}

// As well known as a cell, all would be as on the ideal rig, but for one thing: light between two cells is
// measured in both directions, and the row of a pixel in one. That would ask for half of the variance. The
// row of a pixel is mostly told by photographs that leave it dark, so these get most of the time. The numbers
// are those that meet the errors of docs/research/camera-pixels.md in the least time.
ExposureGoal goal_of_pixels(const ExposureGoal& goal, double noise_share) {
  constexpr double kFloorVariance = 0.8, kLitVariance = 0.55, kDarkVariance = 0.16;  // of a cell's
  ExposureGoal of_pixels = goal;
  of_pixels.share_of_tolerance *= std::sqrt(kFloorVariance * noise_share);
  of_pixels.relative *= std::sqrt(kLitVariance * noise_share);
  of_pixels.relative_dark *= std::sqrt(kDarkVariance * noise_share);
  return of_pixels;
}

std::int64_t camera_fit_bytes(const TransportTensor& tensor, Grid camera, std::int64_t photographs) {
  // Of a row: its codes, while an array grows, and its number. Of a column of a cell: with its numbers.
  constexpr std::int64_t kFloat = 4, kColumns = 80, kRow = 2 * kColumns + 40, kColumn = 12;
  constexpr std::int64_t kCell = 800;    // T on the cells, row by row, and partners
  constexpr std::int64_t kFitted = 200;  // columns of a cell before they are packed, usually
  std::int64_t columns = 0, values = 0;  // a leaf and its mirror image
  for (const Leaf& leaf : tensor.leaves()) {
    columns += std::int64_t{2} * leaf.rank * tensor.channels();
    values += std::int64_t{2} * static_cast<std::int64_t>(leaf.values(tensor.channels()));
  }
  const std::int64_t cells = tensor.projector_grid().size(), channels = tensor.channels();
  const std::int64_t shown = (cells + columns) * photographs * kFloat;
  const std::int64_t seen = std::int64_t{kLogStripRows} * camera.cols * photographs * 2 * kFloat;
  // Of each pixel of a strip its row, one with other columns, and the packed one. Of each thread its
  // equations.
  const std::int64_t fitted = std::int64_t{kLogStripRows} * camera.cols * 3 * kFitted * kFloat;
  const std::int64_t equations = tbb::this_task_arena::max_concurrency() * (2 * photographs + 2 * kFitted) *
                                 kFitted * std::int64_t{sizeof(double)};
  return shown + seen + fitted + equations + 2 * values * kFloat + camera.size() * channels * kRow +
         2 * cells * channels * (kColumns * kColumn + kCell);
}

}  // namespace symrig
