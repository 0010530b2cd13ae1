// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_write.hpp"

#include <algorithm>

namespace symrig::tensor::h5 {

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

Handle new_dataset(hid_t place, const char* name, hid_t type, const Shape& shape,
                   Storing storing = Storing::plain) {
  const std::vector<hsize_t> sizes(shape.begin(), shape.end());
  const Handle space(H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), nullptr), H5Sclose);
  const Handle create(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  if (count(shape) > 0) {
    // A checksum for each chunk, so that a flipped bit on the disk gives an error and not a wrong picture.
    std::vector<hsize_t> chunk = sizes;
    const hsize_t row = std::max<hsize_t>(count(shape) / sizes[0], 1);
    chunk[0] = std::clamp<hsize_t>(hsize_t{kRunChunk} / row, 1, sizes[0]);
    H5Pset_chunk(create.id(), static_cast<int>(chunk.size()), chunk.data());
    if (storing == Storing::packed) {
      constexpr unsigned kFast = 1;
      H5Pset_shuffle(create.id());
      H5Pset_deflate(create.id(), kFast);
    }
    H5Pset_fletcher32(create.id());
  }
  return {H5Dcreate2(place, name, type, space.id(), H5P_DEFAULT, create.id(), H5P_DEFAULT), H5Dclose};
}

}  // namespace

bool write_dataset(hid_t place, const char* name, hid_t type, const Shape& shape, const void* data,
                   Storing storing) {
  Handle dataset = new_dataset(place, name, type, shape, storing);
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

Handle new_group(hid_t place, const std::string& name) {
  return {H5Gcreate2(place, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose};
}

}  // namespace symrig::tensor::h5
