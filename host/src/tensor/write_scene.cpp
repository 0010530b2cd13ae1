// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/internal/half.hpp"
#include "tensor/h5_file.hpp"
#include "tensor/h5_write.hpp"
#include "tensor/scene_file.hpp"

namespace symrig {
namespace {

namespace fs = std::filesystem;
namespace h5 = tensor::h5;
using tensor::Half;

/// The largest half of a column in the file is near 1, because h5py shows such numbers best.
constexpr int kUnscaledTop = 0;

/// Of a value, for Work: rounded, packed and written at some 100 MB/s.
constexpr std::int64_t kOperations = 64;

/// Groups of values that share an exponent: values ≈ halves · 2^exponent.
class HalfValues {
 public:
  explicit HalfValues(std::size_t size) { halves_.reserve(size); }

  void add(std::span<const float> group) {
    halves_.resize(halves_.size() + group.size());
    exponents_.push_back(
        tensor::to_halves(group, kUnscaledTop, halves_.data() + halves_.size() - group.size()));
  }
  std::span<const Half> halves() const { return halves_; }
  std::span<const std::int32_t> exponents() const { return exponents_; }

 private:
  std::vector<Half> halves_;
  std::vector<std::int32_t> exponents_;
};

std::span<const std::int32_t> one(const std::int32_t& value) {
  return {&value, 1};
}

bool write_root(hid_t file, const StoredScene& scene) {
  const TransportTensor& t = scene.tensor;
  const std::array<std::int32_t, 2> camera{t.camera_grid().rows, t.camera_grid().cols};
  const std::array<std::int32_t, 2> projector{t.projector_grid().rows, t.projector_grid().cols};
  return h5::write_attribute(file, "format", std::string("symrig-scene")) &&
         h5::write_attribute(file, "version_major", one(tensor::kVersionMajor)) &&
         h5::write_attribute(file, "version_minor", one(tensor::kVersionMinor)) &&
         h5::write_attribute(file, "symmetric", one(t.symmetric() ? 1 : 0)) &&
         h5::write_attribute(file, "channels", one(t.channels())) &&
         h5::write_attribute(file, "camera_grid", camera) &&
         h5::write_attribute(file, "projector_grid", projector) &&
         h5::write_attribute(file, "band_count", one(static_cast<std::int32_t>(t.bands().size()))) &&
         h5::write_attribute(file, "held_out_count", one(static_cast<std::int32_t>(scene.held_out.size()))) &&
         h5::write_attribute(file, "capture", scene.capture_json);
}

/// Writes the factors of all leaves, an exponent for each column, as they come. read: whether they could be
/// read.
bool write_factors(hid_t group, const TransportTensor& t, const Work& work, Result<void>& read) {
  std::size_t values = 0, columns = 0;
  for (const Leaf& leaf : t.leaves()) {
    values += leaf.values(t.channels());
    columns += leaf.columns(t.channels());
  }
  h5::NewRun<Half> factors(group, "factors", values);
  h5::NewRun<std::int32_t> exponents(group, "exponents", columns);
  bool ok = factors.ok() && exponents.ok();
  Tally tally(work);
  read = t.visit_leaves([&](const Leaf& leaf, std::span<const float> of_leaf) {
    HalfValues halves(of_leaf.size());
    tally.add(kOperations * std::ssize(of_leaf));
    for (int channel = 0; channel < t.channels(); ++channel) {
      for (const std::int32_t side : {leaf.rows(), leaf.cols()}) {
        for (std::int32_t k = 0; k < leaf.rank; ++k) {
          halves.add(of_leaf.first(static_cast<std::size_t>(side)));
          of_leaf = of_leaf.subspan(static_cast<std::size_t>(side));
        }
      }
    }
    ok = ok && factors.add(halves.halves()) && exponents.add(halves.exponents());
  });
  return ok && read.ok() && factors.close() && exponents.close();
}

bool write_leaves(hid_t group, const TransportTensor& t, const Work& work, Result<void>& read) {
  std::vector<std::int32_t> range, rank, level;
  for (const Leaf& leaf : t.leaves()) {
    range.insert(range.end(), {leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end});
    rank.push_back(leaf.rank);
    level.push_back(leaf.level);
  }
  const std::uint64_t n = rank.size();
  return h5::write_dataset<std::int32_t>(group, "range", {n, 4}, range) &&
         h5::write_dataset<std::int32_t>(group, "rank", {n}, rank) &&
         h5::write_dataset<std::int32_t>(group, "level", {n}, level) && write_factors(group, t, work, read);
}

bool write_empties(hid_t group, const TransportTensor& t) {
  std::vector<std::int32_t> rows;
  for (int l = 0; l < t.levels(); ++l)
    for (const EmptyLeaf& empty : t.empties(l))
      rows.insert(rows.end(), {l, empty.row_block, empty.col_block});
  return h5::write_dataset<std::int32_t>(group, "empty", {rows.size() / 3, 3}, rows);
}

/// The diagonal as floats, the other entries as halves with one exponent a channel.
bool write_scalars(hid_t diagonal, hid_t others, const TransportTensor& t) {
  const std::size_t channels = t.channels();
  const std::vector<float> values = t.scalar_values();
  std::vector<std::int32_t> pixels, at;
  std::vector<float> on_diagonal;
  std::vector<std::vector<float>> planes(channels);
  std::size_t k = 0;
  for (const ScalarLeaf& scalar : t.scalars()) {
    const bool on = t.symmetric() && scalar.row == scalar.col;
    on ? pixels.push_back(scalar.row) : static_cast<void>(at.insert(at.end(), {scalar.row, scalar.col}));
    for (std::size_t c = 0; c < channels; ++c, ++k) (on ? on_diagonal : planes[c]).push_back(values[k]);
  }
  HalfValues halves(at.size() / 2 * channels);
  for (const std::vector<float>& plane : planes) halves.add(plane);
  const std::uint64_t count = channels;
  return h5::write_dataset<std::int32_t>(diagonal, "at", {pixels.size()}, pixels) &&
         h5::write_dataset<float>(diagonal, "values", {pixels.size(), count}, on_diagonal) &&
         h5::write_dataset<std::int32_t>(others, "at", {at.size() / 2, 2}, at) &&
         h5::write_dataset<Half>(others, "values", {count, at.size() / 2}, halves.halves()) &&
         h5::write_dataset<std::int32_t>(others, "exponents", {count}, halves.exponents());
}

bool write_columns(hid_t group, const TransportTensor& t) {
  std::vector<std::int32_t> range;
  std::vector<std::int64_t> first{0};
  for (const SparseColumn& column : t.columns()) {
    range.insert(range.end(), {column.col_begin, column.col_end});
    first.push_back(column.last);
  }
  const std::uint64_t entries = t.column_rows().size();
  return h5::write_dataset<std::int32_t>(group, "range", {t.columns().size(), 2}, range) &&
         h5::write_dataset<std::int64_t>(group, "first", {first.size()}, first) &&
         h5::write_dataset<std::int32_t>(group, "rows", {entries}, t.column_rows()) &&
         h5::write_dataset<float>(group, "values", {entries, static_cast<std::uint64_t>(t.channels())},
                                  t.column_values());
}

bool write_bands(hid_t group, const TransportTensor& t) {
  const Grid grid = t.camera_grid();
  const std::size_t pixels = grid.size();
  const std::vector<BandLeaf> bands = t.bands();
  for (std::size_t k = 0; k < bands.size(); ++k) {
    const h5::Handle place = h5::new_group(group, std::to_string(k));
    HalfValues halves(bands[k].values.size());
    for (std::size_t at = 0; at < bands[k].values.size(); at += pixels)
      halves.add(std::span(bands[k].values).subspan(at, pixels));
    const std::uint64_t channels = std::uint64_t(t.channels()),
                        offsets = halves.exponents().size() / channels;
    const bool ok =
        place.ok() && h5::write_attribute(place.id(), "radius", one(bands[k].radius)) &&
        h5::write_dataset<Half>(place.id(), "values",
                                {channels, offsets, std::uint64_t(grid.rows), std::uint64_t(grid.cols)},
                                halves.halves()) &&
        h5::write_dataset<std::int32_t>(place.id(), "exponents", {channels, offsets}, halves.exponents());
    if (!ok) return false;
  }
  return true;
}

bool write_held_out(hid_t group, const std::vector<HeldOut>& all, const Work& work) {
  for (std::size_t k = 0; k < all.size(); ++k) {
    work.add(kOperations *
             (all[k].pattern.grid().size() + all[k].photograph.channels() * all[k].photograph.grid().size()));
    const HeldOut& one_of = all[k];
    const h5::Handle place = h5::new_group(group, std::to_string(k));
    const Grid p = one_of.pattern.grid();
    const Grid c = one_of.photograph.grid();
    const bool ok =
        place.ok() && h5::write_attribute(place.id(), "name", one_of.name) &&
        h5::write_dataset<float>(place.id(), "pattern", {std::uint64_t(p.rows), std::uint64_t(p.cols)},
                                 one_of.pattern.plane(0)) &&
        h5::write_dataset<float>(
            place.id(), "photograph",
            {std::uint64_t(one_of.photograph.channels()), std::uint64_t(c.rows), std::uint64_t(c.cols)},
            one_of.photograph.values());
    if (!ok) return false;
  }
  return true;
}

bool write_all(hid_t file, const StoredScene& scene, const Work& work, Result<void>& read) {
  const TransportTensor& t = scene.tensor;
  const h5::Handle leaves = h5::new_group(file, "leaves"), diagonal = h5::new_group(file, "diagonal"),
                   scalars = h5::new_group(file, "scalars"), columns = h5::new_group(file, "columns"),
                   bands = h5::new_group(file, "bands"), held_out = h5::new_group(file, "held_out");
  const bool made =
      leaves.ok() && diagonal.ok() && scalars.ok() && columns.ok() && bands.ok() && held_out.ok();
  return made && write_root(file, scene) && tensor::write_tree(file, "camera", t.camera_tree()) &&
         tensor::write_tree(file, "projector", t.projector_tree()) &&
         write_leaves(leaves.id(), t, work, read) && write_empties(leaves.id(), t) &&
         write_scalars(diagonal.id(), scalars.id(), t) && write_columns(columns.id(), t) &&
         write_bands(bands.id(), t) && write_held_out(held_out.id(), scene.held_out, work) &&
         (!scene.camera || tensor::write_camera(file, *scene.camera, work));
}

}  // namespace

Result<void> save_scene(const fs::path& path, const StoredScene& scene, const Work& work) {
  const TransportTensor& cells = scene.tensor;
  if (scene.camera && (scene.camera->channels() != cells.channels() ||
                       scene.camera->projector_grid() != cells.projector_grid()))
    return Error{ErrorCode::bad_argument,
                 "T on the camera's own pixels has other channels or cells than T on the cells",
                 "save it with the T that it was fitted to"};
  Result<void> read;
  const Result<void> written =
      h5::write_file(path, [&](hid_t file) { return write_all(file, scene, work, read); });
  return read ? written : read;
}

}  // namespace symrig
