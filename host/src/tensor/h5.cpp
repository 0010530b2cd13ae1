// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5.hpp"

#include <algorithm>
#include <functional>
#include <numeric>

namespace symrig::tensor::h5 {
namespace {

/// Without a hint: read_file() knows what kind of file it is.
Error broken(const char* name, const std::string& why) {
  return {ErrorCode::bad_format, std::string("dataset or attribute '") + name + "' " + why, ""};
}

}  // namespace

hid_t half_type() {
  static const hid_t type = [] {  // lives as long as the program, like HDF5's own types
    const hid_t half = H5Tcopy(H5T_IEEE_F32LE);
    H5Tset_fields(half, 15, 10, 5, 0, 10);
    H5Tset_size(half, 2);
    H5Tset_ebias(half, 15);
    return half;
  }();
  return type;
}

hsize_t count(const Shape& shape) {
  return std::accumulate(shape.begin(), shape.end(), hsize_t{1}, std::multiplies<>());
}

void be_quiet() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

bool write_attribute(hid_t object, const char* name, const std::string& text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), std::max<std::size_t>(text.size(), 1));
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  Handle attribute(H5Acreate2(object, name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const std::string padded = text.empty() ? std::string(1, '\0') : text;
  return attribute.ok() && H5Awrite(attribute.id(), type.id(), padded.data()) >= 0 && attribute.close();
}

bool write_attribute(hid_t object, const char* name, std::span<const std::int32_t> values) {
  const hsize_t size = values.size();
  const Handle space(size == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &size, nullptr), H5Sclose);
  Handle attribute(H5Acreate2(object, name, H5T_STD_I32LE, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.ok() && H5Awrite(attribute.id(), H5T_NATIVE_INT32, values.data()) >= 0 &&
         attribute.close();
}

bool write_attribute(hid_t object, const char* name, double value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  Handle attribute(H5Acreate2(object, name, H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.ok() && H5Awrite(attribute.id(), H5T_NATIVE_DOUBLE, &value) >= 0 && attribute.close();
}

namespace {

Handle new_dataset(hid_t place, const char* name, hid_t type, const Shape& shape) {
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  const Handle create(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  if (count(shape) > 0) {
    // A checksum for each chunk, so that a flipped bit on the disk gives an error and not a wrong picture.
    Shape chunk = shape;
    const hsize_t row = std::max<hsize_t>(count(shape) / shape[0], 1);
    chunk[0] = std::clamp<hsize_t>(hsize_t{kRunChunk} / row, 1, shape[0]);
    H5Pset_chunk(create.id(), static_cast<int>(chunk.size()), chunk.data());
    H5Pset_fletcher32(create.id());
  }
  return {H5Dcreate2(place, name, type, space.id(), H5P_DEFAULT, create.id(), H5P_DEFAULT), H5Dclose};
}

}  // namespace

bool write_dataset(hid_t place, const char* name, hid_t type, const Shape& shape, const void* data) {
  Handle dataset = new_dataset(place, name, type, shape);
  if (!dataset.ok()) return false;
  if (count(shape) > 0 && H5Dwrite(dataset.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0) return false;
  return dataset.close();
}

template <class T>
NewRun<T>::NewRun(hid_t place, const char* name, std::size_t size)
    : dataset_(new_dataset(place, name, native<T>(), {size})) {}

template <class T>
bool NewRun<T>::write(std::size_t count) {
  if (count == 0) return true;
  const hsize_t first = written_, size = count;
  const Handle to(H5Dget_space(dataset_.id()), H5Sclose);
  const Handle from(H5Screate_simple(1, &size, nullptr), H5Sclose);
  if (H5Sselect_hyperslab(to.id(), H5S_SELECT_SET, &first, nullptr, &size, nullptr) < 0 ||
      H5Dwrite(dataset_.id(), native<T>(), from.id(), to.id(), H5P_DEFAULT, waiting_.data()) < 0)
    return false;
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
  written_ += count;
  return true;
}

template class NewRun<std::uint16_t>;
template class NewRun<std::int32_t>;

namespace {

/// A text of variable length, as h5py writes it. The library allocates its memory and frees it.
Result<std::string> read_variable_text(hid_t attribute, hid_t type, hid_t space, const char* name) {
  char* text = nullptr;
  if (H5Aread(attribute, type, static_cast<void*>(&text)) < 0) return broken(name, "cannot be read");
  std::string copy = text == nullptr ? std::string() : std::string(text);
  H5Dvlen_reclaim(type, space, H5P_DEFAULT, static_cast<void*>(&text));
  return copy;
}

/// A text of fixed length: padded with zeros, ended by a zero, or padded with spaces (Fortran).
Result<std::string> read_fixed_text(hid_t attribute, hid_t type, const char* name) {
  std::string text(H5Tget_size(type), '\0');
  if (H5Aread(attribute, type, text.data()) < 0) return broken(name, "cannot be read");
  if (H5Tget_strpad(type) == H5T_STR_NULLTERM) text.resize(std::min(text.find('\0'), text.size()));
  const char pad = H5Tget_strpad(type) == H5T_STR_SPACEPAD ? ' ' : '\0';
  text.resize(text.find_last_not_of(pad) + 1);
  return text;
}

/// True if the data are in this file. Data in other files are refused: a foreign file could make us read a
/// device.
bool holds_its_data(hid_t dataset, std::uint64_t file_bytes) {
  constexpr std::uint64_t kUsualChunk = std::uint64_t{16} << 20;
  const Handle create(H5Dget_create_plist(dataset), H5Pclose);
  const H5D_layout_t layout = H5Pget_layout(create.id());
  if (H5Pget_external_count(create.id()) != 0 || layout == H5D_VIRTUAL) return false;
  if (layout != H5D_CHUNKED) return true;
  std::array<hsize_t, H5S_MAX_RANK> chunk{};
  const int rank = H5Pget_chunk(create.id(), H5S_MAX_RANK, chunk.data());
  double bytes = 8;
  for (int k = 0; k < rank; ++k) bytes *= static_cast<double>(chunk[k]);
  return bytes <= static_cast<double>(std::max(8 * file_bytes, kUsualChunk));
}

herr_t refuse_link(const char*, const char*, const char*, const char*, unsigned*, hid_t, void*) {
  return -1;
}

/// Access properties of datasets: links to other files are not followed.
hid_t dataset_access() {
  static const hid_t access = [] {  // lives as long as the program
    const hid_t made = H5Pcreate(H5P_DATASET_ACCESS);
    H5Pset_elink_cb(made, refuse_link, nullptr);
    return made;
  }();
  return access;
}

}  // namespace

Result<std::string> read_text(hid_t object, const char* name) {
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.ok()) return broken(name, "is missing");
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  if (H5Tget_class(type.id()) != H5T_STRING || H5Sget_simple_extent_npoints(space.id()) != 1)
    return broken(name, "is not a text");
  return H5Tis_variable_str(type.id()) > 0 ? read_variable_text(attribute.id(), type.id(), space.id(), name)
                                           : read_fixed_text(attribute.id(), type.id(), name);
}

Result<std::vector<std::int32_t>> read_integers(hid_t object, const char* name, std::size_t expected) {
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.ok()) return broken(name, "is missing");
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  if (H5Sget_simple_extent_npoints(space.id()) != static_cast<hssize_t>(expected) ||
      H5Tget_class(type.id()) != H5T_INTEGER)
    return broken(name, "does not have " + std::to_string(expected) + " integers");
  std::vector<std::int32_t> values(expected);
  if (H5Aread(attribute.id(), H5T_NATIVE_INT32, values.data()) < 0) return broken(name, "cannot be read");
  return values;
}

Result<double> read_number(hid_t object, const char* name) {
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.ok()) return broken(name, "is missing");
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  double value = 0;
  if (H5Sget_simple_extent_npoints(space.id()) != 1 || H5Tget_class(type.id()) != H5T_FLOAT ||
      H5Aread(attribute.id(), H5T_NATIVE_DOUBLE, &value) < 0)
    return broken(name, "is not a number");
  return value;
}

Result<Grid> read_grid(hid_t object, const char* name) {
  SYMRIG_TRY(const std::vector<std::int32_t> size, read_integers(object, name, 2));
  const Grid grid{size[0], size[1]};
  if (!grid.valid()) return broken(name, "is not a grid of 1 to 2^30 pixels");
  return grid;
}

Result<Shape> shape_of(hid_t place, const char* name, std::size_t rank, std::size_t element_bytes,
                       std::uint64_t file_bytes) {
  if (H5Lexists(place, name, dataset_access()) <= 0) return broken(name, "is missing");
  const Handle dataset(H5Dopen2(place, name, dataset_access()), H5Dclose);
  if (!dataset.ok()) return broken(name, "cannot be opened");
  if (!holds_its_data(dataset.id(), file_bytes)) return broken(name, "has its data in another file");
  const Handle space(H5Dget_space(dataset.id()), H5Sclose);
  if (H5Sget_simple_extent_ndims(space.id()) != static_cast<int>(rank))
    return broken(name, "does not have " + std::to_string(rank) + " dimensions");
  Shape shape(rank);
  H5Sget_simple_extent_dims(space.id(), shape.data(), nullptr);
  auto bytes = static_cast<double>(element_bytes);
  for (const hsize_t n : shape) bytes *= static_cast<double>(n);
  if (bytes > static_cast<double>(file_bytes)) return broken(name, "claims more bytes than the file has");
  return shape;
}

Handle new_group(hid_t place, const std::string& name) {
  return {H5Gcreate2(place, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose};
}

Handle open_group(hid_t file, const std::string& path) {
  const Handle access(H5Pcreate(H5P_GROUP_ACCESS), H5Pclose);
  H5Pset_elink_cb(access.id(), refuse_link, nullptr);
  return {H5Gopen2(file, path.c_str(), access.id()), H5Gclose};
}

Result<void> read_run(hid_t place, const char* name, hid_t type, hsize_t first, const Shape& run,
                      void* data) {
  const Handle dataset(H5Dopen2(place, name, dataset_access()), H5Dclose);
  const Handle stored(dataset.ok() ? H5Dget_type(dataset.id()) : H5I_INVALID_HID, H5Tclose);
  if (!stored.ok() || H5Tget_class(stored.id()) != H5Tget_class(type))
    return broken(name, "has the wrong type");
  if (count(run) == 0) return {};
  Shape begin(run.size());
  begin[0] = first;
  const Handle from(H5Dget_space(dataset.id()), H5Sclose);
  const Handle to(H5Screate_simple(static_cast<int>(run.size()), run.data(), nullptr), H5Sclose);
  if (H5Sselect_hyperslab(from.id(), H5S_SELECT_SET, begin.data(), nullptr, run.data(), nullptr) < 0 ||
      H5Dread(dataset.id(), type, to.id(), from.id(), H5P_DEFAULT, data) < 0)
    return broken(name, "fails its checksum or cannot be read");
  return {};
}

Result<void> read_into(hid_t place, const char* name, hid_t type, void* data) {
  const Handle dataset(H5Dopen2(place, name, dataset_access()), H5Dclose);
  const Handle stored(dataset.ok() ? H5Dget_type(dataset.id()) : H5I_INVALID_HID, H5Tclose);
  if (!stored.ok() || H5Tget_class(stored.id()) != H5Tget_class(type))
    return broken(name, "has the wrong type");
  if (H5Dread(dataset.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)
    return broken(name, "fails its checksum or cannot be read");
  return {};
}

}  // namespace symrig::tensor::h5
