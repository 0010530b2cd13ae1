// SPDX-License-Identifier: Apache-2.0

#include "symrig/job/dense_file.hpp"

#include "symrig/base/files.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {

namespace {

using Bytes = std::vector<std::byte>;

void append(Bytes& to, const void* from, std::size_t size) {
  const auto* bytes = static_cast<const std::byte*>(from);
  to.insert(to.end(), bytes, bytes + size);
}

/// The head of a .npy file, version 1: a dictionary that ends at a multiple of 64 bytes (NumPy Enhancement
/// Proposal 1).
Bytes npy_head(std::int64_t rows, std::int64_t cols, bool fortran) {
  std::string text = fmt::format("{{'descr': '<f4', 'fortran_order': {}, 'shape': ({}, {}), }}",
                                 fortran ? "True" : "False", rows, cols);
  constexpr std::size_t kBefore = 10, kMultiple = 64;
  text.append((kMultiple - (kBefore + text.size() + 1) % kMultiple) % kMultiple, ' ');
  text.push_back('\n');
  Bytes head;
  append(head, "\x93NUMPY\x01\x00", 8);
  const auto size = static_cast<std::uint16_t>(text.size());
  append(head, &size, sizeof size);
  append(head, text.data(), text.size());
  return head;
}

/// The head of a matrix in a MATLAB level 4 file: five numbers, then its name.  single: 32-bit, else 64-bit
/// floats.
void append_mat_head(Bytes& to, std::string_view name, std::int64_t rows, std::int64_t cols, bool single) {
  const std::array<std::int32_t, 5> head{single ? 10 : 0, static_cast<std::int32_t>(rows),
                                         static_cast<std::int32_t>(cols), 0,
                                         static_cast<std::int32_t>(name.size() + 1)};
  append(to, head.data(), sizeof head);
  append(to, name.data(), name.size());
  to.push_back(std::byte{0});
}

void append_mat_size(Bytes& to, std::string_view name, Grid grid) {
  append_mat_head(to, name, 1, 2, false);
  const std::array<double, 2> size{static_cast<double>(grid.rows), static_cast<double>(grid.cols)};
  append(to, size.data(), sizeof size);
}

/// The raster index of pixel k in MATLAB's order, column after column.
std::int64_t raster_of(Grid grid, std::int64_t k) {
  return k % grid.rows * grid.cols + k / grid.rows;
}

/// Appends T column by column. matlab: pixels of both pictures in MATLAB's order.
Result<void> append_columns(Bytes& to, const TransportTensor& tensor, bool matlab, const Progress& progress) {
  constexpr std::int64_t kTogether = 64;
  const Grid in = tensor.projector_grid(), out = tensor.camera_grid();
  std::vector<float> column(static_cast<std::size_t>(out.size()));
  for (std::int64_t first = 0; first < in.size(); first += kTogether) {
    if (progress && !progress({"columns of T", first, in.size(), kNoneToCome}))
      return Error{ErrorCode::interrupted, "stopped before the matrix was complete", "nothing was written"};
    const std::int64_t count = std::min(kTogether, in.size() - first);
    std::vector<Image<float>> units(static_cast<std::size_t>(count), Image<float>(in));
    for (std::int64_t k = 0; k < count; ++k)
      units[k].values()[matlab ? raster_of(in, first + k) : first + k] = 1;
    SYMRIG_TRY(const std::vector<Image<float>> seen, tensor.apply_batch(units));
    for (const Image<float>& one : seen) {
      for (std::int64_t i = 0; i < out.size(); ++i) column[i] = one.values()[matlab ? raster_of(out, i) : i];
      append(to, column.data(), column.size() * sizeof(float));
    }
  }
  return {};
}

Result<void> check_savable(const std::filesystem::path& path, const TransportTensor& tensor,
                           std::int64_t max_bytes) {
  if (path.extension() != ".npy" && path.extension() != ".mat")
    return Error{ErrorCode::bad_argument,
                 fmt::format("{} has neither the suffix .npy nor .mat", path.string()),
                 "give T.npy or T.mat"};
  if (tensor.channels() != 1)
    return Error{ErrorCode::bad_argument,
                 fmt::format("the scene has {} channels, a matrix one", tensor.channels()),
                 "use scene.to_numpy() of the Python package"};
  if (tensor.dense_bytes() <= static_cast<double>(max_bytes)) return {};
  return Error{ErrorCode::limit,
               fmt::format("T as a matrix has {:.3g} bytes, the limit is {:.3g}", tensor.dense_bytes(),
                           static_cast<double>(max_bytes)),
               "use the scene file itself: relight, or the Python package"};
}

}  // namespace

Result<void> save_dense(const std::filesystem::path& path, const TransportTensor& tensor,
                        std::int64_t max_bytes, const Progress& progress) {
  static_assert(std::endian::native == std::endian::little);
  SYMRIG_CHECK(check_savable(path, tensor, max_bytes));
  const std::int64_t rows = tensor.camera_grid().size(), cols = tensor.projector_grid().size();
  const bool matlab = path.extension() == ".mat";
  Bytes bytes;
  if (matlab) {
    append_mat_size(bytes, "light_size", tensor.projector_grid());
    append_mat_size(bytes, "photo_size", tensor.camera_grid());
    append_mat_head(bytes, "T", rows, cols, true);
  } else {
    bytes = npy_head(rows, cols, true);
  }
  bytes.reserve(bytes.size() + static_cast<std::size_t>(rows * cols) * sizeof(float));
  SYMRIG_CHECK(append_columns(bytes, tensor, matlab, progress));
  return write_file_atomically(path, bytes);
}

namespace {

/// The level that tells most against data-sparse transport, or nothing.
std::string evidence_text(const Undetermined& found) {
  const LevelEvidence* most = nullptr;
  for (const LevelEvidence& level : found.levels)
    if (level.tested > 0 && (most == nullptr || level.unexplained > most->unexplained)) most = &level;
  if (most == nullptr) return {};
  return fmt::format("; on level {}, {} of {} nodes are leaves and {:.0f} % of their energy is unexplained",
                     most->level, most->leaves, most->tested, 100 * most->unexplained);
}

Result<void> refuse_not_sparse(const CaptureResult& result) {
  if (!result.undetermined) return {};
  const Undetermined& found = *result.undetermined;
  return Error{ErrorCode::bad_value,
               fmt::format("the matrix is not data-sparse: {} (the search would need at least {} products, "
                           "and the matrix has {} columns{})",
                           found.reason, found.forecast, found.brute_force, evidence_text(found)),
               "algorithm brute stores it column by column"};
}

}  // namespace

Result<ImportOutcome> import_matrix(CaptureJob job, OpenedRig& matrix) {
  job.accept = refuse_not_sparse;
  SYMRIG_TRY(CaptureOutcome capture, run_job(job, matrix));
  SYMRIG_TRY(Judged judged, judge_by_rig(capture.result.tensor, *matrix.probe, job.options.progress));
  const double bytes = capture.result.tensor.dense_bytes();
  return ImportOutcome{std::move(capture), std::move(judged), bytes};
}

}  // namespace symrig
