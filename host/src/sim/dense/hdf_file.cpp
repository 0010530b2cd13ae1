// SPDX-License-Identifier: Apache-2.0
#include "sim/dense/raw_matrix.hpp"
#include "tensor/h5_file.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {
namespace {

namespace h5 = tensor::h5;

/// A data set of the file's root that may be T.
struct DataSet {
  std::string name;
  std::vector<std::int64_t> shape;     ///< as stored
  bool numeric = false, wide = false;  ///< wide: 64-bit floats, or integers
};

/// Nothing: no data set, or one behind a link to another file.
std::optional<DataSet> data_set(hid_t file, const char* name) {
  H5L_info_t link{};
  if (H5Lget_info(file, name, &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) return std::nullopt;
  const h5::Handle object(H5Oopen(file, name, H5P_DEFAULT), H5Oclose);
  if (!object.ok() || H5Iget_type(object.id()) != H5I_DATASET) return std::nullopt;
  const h5::Handle space(H5Dget_space(object.id()), H5Sclose), type(H5Dget_type(object.id()), H5Tclose);
  const int rank = space.ok() ? H5Sget_simple_extent_ndims(space.id()) : -1;
  if (!type.ok() || (rank != 2 && rank != 4)) return std::nullopt;
  std::vector<hsize_t> sizes(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space.id(), sizes.data(), nullptr);
  DataSet found{.name = name, .shape = {}};
  for (const hsize_t size : sizes)
    found.shape.push_back(static_cast<std::int64_t>(std::min<hsize_t>(size, hsize_t{1} << 40)));
  const H5T_class_t kind = H5Tget_class(type.id());
  found.numeric = kind == H5T_FLOAT || kind == H5T_INTEGER;
  found.wide = kind == H5T_INTEGER || H5Tget_size(type.id()) > sizeof(float);
  return found;
}

/// What a group of MATLAB is: sparse matrices, cells and structures are no data sets.
std::string kind_of_group(hid_t file, const char* name) {
  H5L_info_t link{};
  if (H5Lget_info(file, name, &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) return {};
  const h5::Handle object(H5Oopen(file, name, H5P_DEFAULT), H5Oclose);
  if (!object.ok() || H5Iget_type(object.id()) != H5I_GROUP) return {};
  return H5Aexists(object.id(), "MATLAB_sparse") > 0 ? "is sparse: give full(T)" : "is a group, no matrix";
}

herr_t note_name(hid_t /*group*/, const char* name, const H5L_info_t* /*link*/, void* names) {
  static_cast<std::vector<std::string>*>(names)->emplace_back(name);
  return 0;
}

/// The data set T, or the only one with the shape of a matrix. Errors get the file's name from h5::read_file.
Result<DataSet> matrix_in(hid_t file) {
  if (auto named = data_set(file, "T")) return *std::move(named);
  std::vector<std::string> names;
  H5Literate(file, H5_INDEX_NAME, H5_ITER_INC, nullptr, note_name, &names);
  std::vector<DataSet> found;
  std::string group;
  for (const std::string& name : names)
    if (const std::string kind = kind_of_group(file, name.c_str());
        !kind.empty() && name != "#refs#" && (group.empty() || name == "T"))
      group = fmt::format("{} {}", name, kind);
  for (const std::string& name : names)
    if (auto one = data_set(file, name.c_str()); one && one->numeric && is_matrix_shape(one->shape))
      found.push_back(*std::move(one));
  if (found.size() == 1) return found.front();
  return Error{ErrorCode::bad_format,
               found.empty() ? (group.empty() ? "it holds no matrix" : group)
                             : "it holds several matrices, none of the name T",
               "give a file whose data set T is a matrix of floats"};
}

/// Filters make at most about a thousand bytes of one.
Result<void> check_bytes(const DataSet& found, std::uint64_t numbers, std::uint64_t file_bytes) {
  constexpr std::uint64_t kMostRatio = 1100, kSlack = 1 << 16;
  if (numbers <= kMostRatio * (file_bytes + kSlack)) return {};
  return Error{ErrorCode::bad_format, found.name + " claims more numbers than the file can hold"};
}

template <class T>
Result<std::vector<std::byte>> read_numbers(hid_t file, const DataSet& found, std::size_t count) {
  std::vector<std::byte> bytes(count * sizeof(T));
  SYMRIG_CHECK(h5::read_into(file, found.name.c_str(), h5::native<T>(), bytes.data()));
  return bytes;
}

/// The picture's size that a MAT file states; 0x0: none.
Result<Grid> stated_in(hid_t file) {
  for (const char* name : {"light_size", "photo_size"}) {
    const auto found = data_set(file, name);
    if (!found || !found->numeric || found->shape.size() != 2 || found->shape[0] * found->shape[1] != 2)
      continue;
    std::array<double, 2> size{};
    SYMRIG_CHECK(h5::read_into(file, name, h5::native<double>(), size.data()));
    return stated_size(size[0], size[1], name);
  }
  return Grid{};
}

Result<RawMatrix> read_source(const h5::Source& source, bool matlab) {
  const hid_t file = source.file.id();
  SYMRIG_TRY(const DataSet found, matrix_in(file));
  if (!found.numeric) return Error{ErrorCode::bad_format, found.name + " holds no real numbers"};
  if (!is_matrix_shape(found.shape))
    return RawMatrix{.shape = found.shape};  // the caller says what is wrong with it
  std::uint64_t count = 1;
  for (const std::int64_t size : found.shape) count *= static_cast<std::uint64_t>(size);
  SYMRIG_CHECK(check_bytes(found, count, source.bytes));
  RawMatrix raw{.type = found.wide ? NumberType::f64 : NumberType::f32,
                .shape = found.shape,
                .columns_first = matlab,
                .matlab_pixels = matlab};
  if (matlab) {
    std::reverse(raw.shape.begin(), raw.shape.end());
    SYMRIG_TRY(raw.grid, stated_in(file));
  }
  SYMRIG_TRY(raw.bytes,
             found.wide ? read_numbers<double>(file, found, count) : read_numbers<float>(file, found, count));
  return raw;
}

}  // namespace

Result<RawMatrix> read_hdf(const std::filesystem::path& file, bool matlab) {
  static constexpr h5::FileWords kWords{.content = "a matrix",
                                        .name_one = "give an HDF5 file with a data set T",
                                        .make_one = "give an HDF5 file with a data set T",
                                        .make_again = "write it again"};
  return h5::read_file(file, kWords,
                       [matlab](const h5::Source& source) { return read_source(source, matlab); });
}

}  // namespace symrig::sim
