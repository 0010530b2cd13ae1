// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/file.hpp"

#include "tensor/h5.hpp"
#include "tensor/tree_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <mutex>

#include <fcntl.h>
#include <unistd.h>

namespace symrig {
namespace {

namespace fs = std::filesystem;
constexpr std::int32_t kVersionMajor = 1;
constexpr std::int32_t kVersionMinor = 0;

/// HDF5 as Debian builds it is not thread-safe: one scene file at a time.
std::mutex& hdf5_mutex() {
  static std::mutex mutex;
  return mutex;
}

Error io_error(const fs::path& path, const std::string& what) {
  return {ErrorCode::io, path.string() + ": " + what + " (" + std::strerror(errno) + ")",
          "check the folder, its permissions and the free space"};
}

Error bad_file(const fs::path& path, const std::string& what) {
  return {ErrorCode::bad_format, path.string() + ": " + what,
          "the file is damaged or not a scene; capture or fit it again"};
}

Error named(const fs::path& path, Error error) {
  error.what = path.string() + ": " + error.what;
  return error;
}

// ---- writing
// -------------------------------------------------------------------------------------------------------------

std::span<const std::int32_t> one(const std::int32_t& value) {
  return {&value, 1};
}

bool write_root(hid_t file, const StoredScene& scene) {
  const TransportTensor& t = scene.tensor;
  const std::array<std::int32_t, 2> camera{t.camera_grid().rows, t.camera_grid().cols};
  const std::array<std::int32_t, 2> projector{t.projector_grid().rows, t.projector_grid().cols};
  return h5::write_attribute(file, "format", std::string("symrig-scene")) &&
         h5::write_attribute(file, "version_major", one(kVersionMajor)) &&
         h5::write_attribute(file, "version_minor", one(kVersionMinor)) &&
         h5::write_attribute(file, "symmetric", one(t.symmetric() ? 1 : 0)) &&
         h5::write_attribute(file, "channels", one(t.channels())) &&
         h5::write_attribute(file, "camera_grid", camera) &&
         h5::write_attribute(file, "projector_grid", projector) &&
         h5::write_attribute(file, "held_out_count", one(static_cast<std::int32_t>(scene.held_out.size()))) &&
         h5::write_attribute(file, "capture", scene.capture_json);
}

bool write_leaves(hid_t group, const TransportTensor& t) {
  std::vector<std::int32_t> range, rank, level;
  std::vector<std::int64_t> offset;
  for (const Leaf& leaf : t.leaves()) {
    range.insert(range.end(), {leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end});
    rank.push_back(leaf.rank);
    level.push_back(leaf.level);
    offset.push_back(leaf.factors);
  }
  const hsize_t n = rank.size();
  return h5::write_dataset<std::int32_t>(group, "range", {n, 4}, range) &&
         h5::write_dataset<std::int32_t>(group, "rank", {n}, rank) &&
         h5::write_dataset<std::int32_t>(group, "level", {n}, level) &&
         h5::write_dataset<std::int64_t>(group, "offset", {n}, offset) &&
         h5::write_dataset<float>(group, "factors", {t.factors().size()}, t.factors());
}

bool write_empties(hid_t group, const TransportTensor& t) {
  std::vector<std::int32_t> rows;
  for (int l = 0; l < t.levels(); ++l)
    for (const EmptyLeaf& empty : t.empties(l))
      rows.insert(rows.end(), {l, empty.row_block, empty.col_block});
  return h5::write_dataset<std::int32_t>(group, "empty", {rows.size() / 3, 3}, rows);
}

bool write_scalars(hid_t group, const TransportTensor& t) {
  std::vector<std::int32_t> at;
  for (const ScalarLeaf& scalar : t.scalars()) at.insert(at.end(), {scalar.row, scalar.col});
  const hsize_t n = t.scalars().size();
  return h5::write_dataset<std::int32_t>(group, "at", {n, 2}, at) &&
         h5::write_dataset<float>(group, "values", {n, static_cast<hsize_t>(t.channels())},
                                  t.scalar_values());
}

bool write_columns(hid_t group, const TransportTensor& t) {
  std::vector<std::int32_t> range;
  std::vector<std::int64_t> first{0};
  for (const SparseColumn& column : t.columns()) {
    range.insert(range.end(), {column.col_begin, column.col_end});
    first.push_back(column.last);
  }
  const hsize_t entries = t.column_rows().size();
  return h5::write_dataset<std::int32_t>(group, "range", {t.columns().size(), 2}, range) &&
         h5::write_dataset<std::int64_t>(group, "first", {first.size()}, first) &&
         h5::write_dataset<std::int32_t>(group, "rows", {entries}, t.column_rows()) &&
         h5::write_dataset<float>(group, "values", {entries, static_cast<hsize_t>(t.channels())},
                                  t.column_values());
}

h5::Handle new_group(hid_t place, const std::string& name) {
  return {H5Gcreate2(place, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose};
}

bool write_held_out(hid_t group, const std::vector<HeldOut>& all) {
  for (std::size_t k = 0; k < all.size(); ++k) {
    const HeldOut& one_of = all[k];
    const h5::Handle place = new_group(group, std::to_string(k));
    const Grid p = one_of.pattern.grid();
    const Grid c = one_of.photograph.grid();
    const bool ok =
        place.ok() && h5::write_attribute(place.id(), "name", one_of.name) &&
        h5::write_dataset<float>(place.id(), "pattern", {hsize_t(p.rows), hsize_t(p.cols)},
                                 one_of.pattern.plane(0)) &&
        h5::write_dataset<float>(place.id(), "photograph",
                                 {hsize_t(one_of.photograph.channels()), hsize_t(c.rows), hsize_t(c.cols)},
                                 one_of.photograph.values());
    if (!ok) return false;
  }
  return true;
}

bool write_all(hid_t file, const StoredScene& scene) {
  const TransportTensor& t = scene.tensor;
  const h5::Handle leaves = new_group(file, "leaves");
  const h5::Handle scalars = new_group(file, "scalars");
  const h5::Handle columns = new_group(file, "columns");
  const h5::Handle held_out = new_group(file, "held_out");
  return write_root(file, scene) && tensor::write_tree(file, "camera", t.camera_tree()) &&
         tensor::write_tree(file, "projector", t.projector_tree()) && leaves.ok() &&
         write_leaves(leaves.id(), t) && write_empties(leaves.id(), t) && scalars.ok() &&
         write_scalars(scalars.id(), t) && columns.ok() && write_columns(columns.id(), t) && held_out.ok() &&
         write_held_out(held_out.id(), scene.held_out);
}

constexpr std::size_t kGrowBy = std::size_t{1} << 16;

/// Put together in memory and written when it is closed: a data set that the disk has no room for would end
/// the process inside the library. Metadata with checksums needs the library's newer file layout (HDF5
/// ≥ 1.10).
h5::Handle file_access() {
  h5::Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_libver_bounds(access.id(), H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
  H5Pset_fapl_core(access.id(), kGrowBy, true);
  return access;
}

bool sync_file(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool ok = ::fsync(fd) == 0;
  return (::close(fd) == 0) && ok;
}

// ---- reading
// -------------------------------------------------------------------------------------------------------------

/// An open scene file and its size, against which every claimed size is checked.
struct Source {
  h5::Handle file;
  std::uint64_t bytes;
};

struct Head {
  bool symmetric;
  int channels;
  Grid camera, projector;
};

Result<Grid> read_grid(const Source& source, const char* name) {
  SYMRIG_TRY(const std::vector<std::int32_t> size, h5::read_integers(source.file.id(), name, 2));
  const Grid grid{size[0], size[1]};
  if (!grid.valid())
    return Error{ErrorCode::bad_format,
                 std::string("attribute '") + name + "' is not a grid of 1 to 2^30 pixels",
                 "the file is damaged"};
  return grid;
}

Result<Head> read_head(const Source& source) {
  const hid_t file = source.file.id();
  SYMRIG_TRY(const std::string format, h5::read_text(file, "format"));
  if (format != "symrig-scene")
    return Error{ErrorCode::bad_format, "attribute 'format' is not 'symrig-scene'", "is this a scene.h5?"};
  SYMRIG_TRY(const std::vector<std::int32_t> major, h5::read_integers(file, "version_major", 1));
  if (major[0] != kVersionMajor)
    return Error{ErrorCode::bad_format,
                 "file version " + std::to_string(major[0]) + ", this program reads version 1",
                 "use the symrig release that wrote it"};
  SYMRIG_TRY(const std::vector<std::int32_t> symmetric, h5::read_integers(file, "symmetric", 1));
  SYMRIG_TRY(const std::vector<std::int32_t> channels, h5::read_integers(file, "channels", 1));
  SYMRIG_TRY(const Grid camera, read_grid(source, "camera_grid"));
  SYMRIG_TRY(const Grid projector, read_grid(source, "projector_grid"));
  if (channels[0] < 1 || channels[0] > 64)
    return Error{ErrorCode::bad_format, "attribute 'channels' is not in 1..64", "the file is damaged"};
  if (symmetric[0] != 0 && !(camera == projector))
    return Error{ErrorCode::bad_format, "a symmetric tensor with two different grids", "the file is damaged"};
  return Head{symmetric[0] != 0, channels[0], camera, projector};
}

bool all_finite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

Error not_finite(const char* what) {
  return {ErrorCode::bad_value, std::string(what) + " has a value that is not a finite number",
          "the file is damaged"};
}

Error damaged(const std::string& what) {
  return {ErrorCode::bad_format, what, "the file is damaged"};
}

struct Trees {
  const BlockTree* camera;
  const BlockTree* projector;

  int levels() const { return std::max(camera->levels(), projector->levels()); }
  /// Blocks of a level; 0 beyond the tree's last.
  static std::int64_t blocks(const BlockTree& tree, int level) {
    return level < tree.levels() ? std::ssize(tree.level(level)) : 0;
  }
};

bool range_ok(std::int32_t begin, std::int32_t end, std::int64_t size) {
  return 0 <= begin && begin < end && end <= size;
}

Result<void> read_leaves(const Source& source, const Head& head, const Trees& trees, TensorBuilder& builder) {
  const hid_t file = source.file.id();
  h5::Shape s;
  SYMRIG_TRY(const auto range, h5::read_dataset<std::int32_t>(file, "leaves/range", 2, source.bytes, s));
  const std::size_t n = s[0];
  if (s[1] != 4)
    return Error{ErrorCode::bad_format, "dataset 'leaves/range' has not four columns", "the file is damaged"};
  SYMRIG_TRY(const auto rank, h5::read_dataset<std::int32_t>(file, "leaves/rank", 1, source.bytes, s));
  SYMRIG_TRY(const auto level, h5::read_dataset<std::int32_t>(file, "leaves/level", 1, source.bytes, s));
  SYMRIG_TRY(const auto offset, h5::read_dataset<std::int64_t>(file, "leaves/offset", 1, source.bytes, s));
  SYMRIG_TRY(const auto factors, h5::read_dataset<float>(file, "leaves/factors", 1, source.bytes, s));
  if (rank.size() != n || level.size() != n || offset.size() != n)
    return Error{ErrorCode::bad_format, "the datasets in 'leaves' differ in length", "the file is damaged"};
  if (!all_finite(factors)) return not_finite("dataset 'leaves/factors'");
  std::int64_t used = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const std::int32_t* r = &range[4 * k];
    const bool ok = range_ok(r[0], r[1], head.camera.size()) && range_ok(r[2], r[3], head.projector.size()) &&
                    level[k] >= 0 && level[k] < trees.levels() && rank[k] >= 0 &&
                    rank[k] <= std::min(r[1] - r[0], r[3] - r[2]) && offset[k] == used;
    const std::int64_t size =
        ok ? std::int64_t{head.channels} * rank[k] * (std::int64_t{r[1]} - r[0] + r[3] - r[2]) : 0;
    if (!ok || used + size > std::ssize(factors))
      return Error{ErrorCode::bad_format,
                   "leaf " + std::to_string(k) + " in 'leaves' breaks the rules of the format",
                   "the file is damaged"};
    builder.add_leaf(
        r[0], r[1], r[2], r[3], rank[k], level[k],
        std::span(factors).subspan(static_cast<std::size_t>(used), static_cast<std::size_t>(size)));
    used += size;
  }
  if (used != std::ssize(factors))
    return Error{ErrorCode::bad_format, "'leaves/factors' has values of no leaf", "the file is damaged"};
  return {};
}

Result<void> read_empties(const Source& source, const Trees& trees, TensorBuilder& builder) {
  h5::Shape s;
  SYMRIG_TRY(const auto rows,
             h5::read_dataset<std::int32_t>(source.file.id(), "leaves/empty", 2, source.bytes, s));
  if (s[1] != 3) return damaged("dataset 'leaves/empty' has not three columns");
  for (std::size_t k = 0; k < s[0]; ++k) {
    const std::int32_t level = rows[3 * k], row = rows[3 * k + 1], col = rows[3 * k + 2];
    const bool ok = level >= 0 && level < trees.levels() && row >= 0 &&
                    row < Trees::blocks(*trees.camera, level) && col >= 0 &&
                    col < Trees::blocks(*trees.projector, level);
    if (!ok) return damaged("empty leaf " + std::to_string(k) + " names blocks that are not there");
    builder.add_empty(level, row, col);
  }
  return {};
}

Result<void> read_scalars(const Source& source, const Head& head, TensorBuilder& builder) {
  h5::Shape s;
  SYMRIG_TRY(const auto at,
             h5::read_dataset<std::int32_t>(source.file.id(), "scalars/at", 2, source.bytes, s));
  const std::size_t n = s[0];
  if (s[1] != 2) return damaged("dataset 'scalars/at' has not two columns");
  SYMRIG_TRY(const auto values,
             h5::read_dataset<float>(source.file.id(), "scalars/values", 2, source.bytes, s));
  const auto channels = static_cast<std::size_t>(head.channels);
  if (s[0] != n || s[1] != channels) return damaged("dataset 'scalars/values' does not fit 'scalars/at'");
  if (!all_finite(values)) return not_finite("dataset 'scalars/values'");
  for (std::size_t k = 0; k < n; ++k) {
    const std::int32_t row = at[2 * k], col = at[2 * k + 1];
    if (row < 0 || row >= head.camera.size() || col < 0 || col >= head.projector.size())
      return damaged("scalar " + std::to_string(k) + " points outside the grid");
    builder.add_scalar(row, col, std::span(values).subspan(k * channels, channels));
  }
  return {};
}

Result<void> read_columns(const Source& source, const Head& head, TensorBuilder& builder) {
  const hid_t file = source.file.id();
  h5::Shape s;
  SYMRIG_TRY(const auto range, h5::read_dataset<std::int32_t>(file, "columns/range", 2, source.bytes, s));
  const std::size_t n = s[0];
  if (s[1] != 2) return damaged("dataset 'columns/range' has not two columns");
  SYMRIG_TRY(const auto first, h5::read_dataset<std::int64_t>(file, "columns/first", 1, source.bytes, s));
  SYMRIG_TRY(const auto rows, h5::read_dataset<std::int32_t>(file, "columns/rows", 1, source.bytes, s));
  SYMRIG_TRY(const auto values, h5::read_dataset<float>(file, "columns/values", 2, source.bytes, s));
  const auto channels = static_cast<std::size_t>(head.channels);
  const bool fit = first.size() == n + 1 && first.front() == 0 && first.back() == std::ssize(rows) &&
                   s[0] == rows.size() && s[1] == channels;
  if (!fit || (head.symmetric && n > 0)) return damaged("the datasets in 'columns' do not fit together");
  if (!all_finite(values)) return not_finite("dataset 'columns/values'");
  for (const std::int32_t row : rows)
    if (row < 0 || row >= head.camera.size())
      return damaged("dataset 'columns/rows' points outside the grid");
  for (std::size_t k = 0; k < n; ++k) {
    const bool ok = range_ok(range[2 * k], range[2 * k + 1], head.projector.size()) &&
                    first[k] <= first[k + 1] && first[k + 1] <= std::ssize(rows);
    if (!ok) return damaged("column " + std::to_string(k) + " in 'columns' breaks the rules of the format");
    const auto begin = static_cast<std::size_t>(first[k]);
    const auto size = static_cast<std::size_t>(first[k + 1] - first[k]);
    builder.add_column(range[2 * k], range[2 * k + 1], std::span(rows).subspan(begin, size),
                       std::span(values).subspan(begin * channels, size * channels));
  }
  return {};
}

Result<HeldOut> read_held_out(const Source& source, const Head& head, const std::string& path) {
  const h5::Handle group(H5Gopen2(source.file.id(), path.c_str(), H5P_DEFAULT), H5Gclose);
  if (!group.ok())
    return Error{ErrorCode::bad_format, "group '" + path + "' is missing or damaged", "the file is damaged"};
  h5::Shape p, c;
  SYMRIG_TRY(std::string name, h5::read_text(group.id(), "name"));
  SYMRIG_TRY(const auto pattern, h5::read_dataset<float>(group.id(), "pattern", 2, source.bytes, p));
  SYMRIG_TRY(const auto photograph, h5::read_dataset<float>(group.id(), "photograph", 3, source.bytes, c));
  if (p != h5::Shape{hsize_t(head.projector.rows), hsize_t(head.projector.cols)} ||
      c != h5::Shape{hsize_t(head.channels), hsize_t(head.camera.rows), hsize_t(head.camera.cols)})
    return Error{ErrorCode::bad_format, "'" + path + "' does not fit the grids", "the file is damaged"};
  if (!all_finite(pattern) || !all_finite(photograph)) return not_finite(path.c_str());
  HeldOut held{std::move(name), Image<float>(head.projector), Image<float>(head.camera, head.channels)};
  std::copy(pattern.begin(), pattern.end(), held.pattern.values().begin());
  std::copy(photograph.begin(), photograph.end(), held.photograph.values().begin());
  return held;
}

Result<StoredScene> read_all(const Source& source) {
  SYMRIG_TRY(const Head head, read_head(source));
  SYMRIG_TRY(std::string capture, h5::read_text(source.file.id(), "capture"));
  SYMRIG_TRY(const BlockTree camera,
             tensor::read_tree(source.file.id(), "camera", head.camera, source.bytes));
  SYMRIG_TRY(const BlockTree projector,
             tensor::read_tree(source.file.id(), "projector", head.projector, source.bytes));
  const Trees trees{&camera, &projector};
  TensorBuilder builder =
      head.symmetric ? TensorBuilder(camera, head.channels) : TensorBuilder(camera, projector, head.channels);
  SYMRIG_CHECK(read_leaves(source, head, trees, builder));
  SYMRIG_CHECK(read_empties(source, trees, builder));
  SYMRIG_CHECK(read_scalars(source, head, builder));
  SYMRIG_CHECK(read_columns(source, head, builder));
  SYMRIG_TRY(const std::vector<std::int32_t> held_out_count,
             h5::read_integers(source.file.id(), "held_out_count", 1));
  std::vector<HeldOut> held_out;
  for (std::int32_t k = 0; k < held_out_count[0]; ++k) {
    SYMRIG_TRY(HeldOut one_of, read_held_out(source, head, "held_out/" + std::to_string(k)));
    held_out.push_back(std::move(one_of));
  }
  return StoredScene{std::move(builder).finish(), std::move(capture), std::move(held_out)};
}

}  // namespace

Result<void> save_scene(const fs::path& path, const StoredScene& scene) {
  const std::scoped_lock lock(hdf5_mutex());
  h5::be_quiet();
  const fs::path temporary = path.string() + ".part" + std::to_string(::getpid());
  const h5::Handle access = file_access();
  h5::Handle file(H5Fcreate(temporary.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose);
  const bool written = file.ok() && write_all(file.id(), scene);
  std::error_code ignored;
  if (!file.close() || !written || !sync_file(temporary)) {
    const Error error = io_error(path, "cannot be written");
    fs::remove(temporary, ignored);
    return error;
  }
  std::error_code failed;
  fs::rename(temporary, path, failed);
  if (failed) {
    fs::remove(temporary, ignored);
    return Error{ErrorCode::io, path.string() + ": cannot be put in place (" + failed.message() + ")",
                 "check the folder and its permissions"};
  }
  return {};
}

Result<StoredScene> load_scene(const fs::path& path) {
  const std::scoped_lock lock(hdf5_mutex());
  h5::be_quiet();
  std::error_code failed;
  if (!fs::exists(path, failed))
    return Error{ErrorCode::not_found, path.string() + ": no such file",
                 "`symrig capture` makes scene files"};
  if (!fs::is_regular_file(path, failed))
    return Error{ErrorCode::bad_format, path.string() + ": not a file", "name a scene.h5"};
  const std::uint64_t bytes = fs::file_size(path, failed);
  const Source source{h5::Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose), bytes};
  if (!source.file.ok()) return bad_file(path, "cannot be read as HDF5");
  auto scene = read_all(source);
  if (!scene) return named(path, std::move(scene).error());
  return scene;
}

}  // namespace symrig
