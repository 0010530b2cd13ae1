// SPDX-License-Identifier: Apache-2.0
#include "mutators.hpp"
#include "tensor/h5_reader/file_bytes.hpp"
#include "tensor/h5_write.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <hdf5.h>

namespace symrig::structured {
namespace {

namespace h5 = tensor::h5;
using h5::Handle;

constexpr hsize_t kSide = 16;

Handle new_file(const std::filesystem::path& path, H5F_libver_t layout, hsize_t block) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose), create(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  H5Pset_libver_bounds(access.id(), layout, H5F_LIBVER_LATEST);
  H5Pset_userblock(create.id(), block);
  return {H5Fcreate(path.c_str(), H5F_ACC_TRUNC, create.id(), access.id()), H5Fclose};
}

/// A dataset of 16 x 16 floats in chunks, with or without filters, that may grow to `most`.
void add_chunked(hid_t file, const char* name, std::array<hsize_t, 2> most, bool filtered) {
  constexpr std::array<hsize_t, 2> kSize{kSide, kSide}, kChunk{5, 7};
  const Handle space(H5Screate_simple(2, kSize.data(), most.data()), H5Sclose);
  const Handle create(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_chunk(create.id(), 2, kChunk.data());
  if (filtered) {
    H5Pset_shuffle(create.id());
    H5Pset_deflate(create.id(), 6);
    H5Pset_fletcher32(create.id());
  }
  const Handle set(H5Dcreate2(file, name, H5T_IEEE_F32LE, space.id(), H5P_DEFAULT, create.id(), H5P_DEFAULT),
                   H5Dclose);
  std::vector<float> values(kSide * kSide);
  for (std::size_t k = 0; k < values.size(); ++k)
    values[k] = static_cast<float>((1 + k / kSide % 3) * (1 + k % kSide % 3));  // symmetric, of rank 1
  H5Dwrite(set.id(), H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
}

void add_variable_text(hid_t object, const char* name) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
  H5Tset_size(type.id(), H5T_VARIABLE);
  const Handle attribute(H5Acreate2(object, name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const char* const text = "a text";
  H5Awrite(attribute.id(), type.id(), static_cast<const void*>(&text));
}

Hdf5File matrix_file(const std::filesystem::path& path, H5F_libver_t layout, hsize_t block) {
  constexpr hsize_t kAny = H5S_UNLIMITED;
  {
    const Handle file = new_file(path, layout, block);
    add_chunked(file.id(), "T", {kSide, kSide}, true);
    add_chunked(file.id(), "fixed", {kSide, kSide}, false);
    add_chunked(file.id(), "rows", {kAny, kSide}, true);
    add_chunked(file.id(), "both", {kAny, kAny}, false);
    const std::vector<double> place{4, 4};
    h5::write_dataset<double>(file.id(), "light_size", {2, 1}, place);
    const Handle many = h5::new_group(file.id(), "many");
    for (std::int32_t k = 0; k < 12; ++k) {
      const std::string name = "name " + std::to_string(k);
      h5::write_attribute(many.id(), name.c_str(), std::span(&k, 1));
      const Handle member = h5::new_group(many.id(), name);
    }
    add_variable_text(many.id(), "text");
    H5Lcreate_soft("/T", file.id(), "soft", H5P_DEFAULT, H5P_DEFAULT);
  }
  return whole_file(path);
}

herr_t copy_attribute(hid_t from, const char* name, const H5A_info_t* /*facts*/, void* file) {
  const Handle old(H5Aopen(from, name, H5P_DEFAULT), H5Aclose);
  const Handle type(H5Aget_type(old.id()), H5Tclose), space(H5Aget_space(old.id()), H5Sclose);
  std::vector<std::uint8_t> values(H5Tget_size(type.id()) *
                                   static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.id())));
  H5Aread(old.id(), type.id(), values.data());
  const Handle copy(
      H5Acreate2(*static_cast<hid_t*>(file), name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  return H5Awrite(copy.id(), type.id(), values.data());
}

herr_t copy_object(hid_t from, const char* name, const H5L_info_t* /*facts*/, void* file) {
  return H5Ocopy(from, name, *static_cast<hid_t*>(file), name, H5P_DEFAULT, H5P_DEFAULT);
}

}  // namespace

Hdf5File whole_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return Hdf5File(std::string(std::istreambuf_iterator<char>(in), {}));
}

Hdf5File in_older_layout(const std::filesystem::path& file, const std::filesystem::path& folder) {
  const std::filesystem::path copy = folder / "older.h5";
  {
    const Handle from(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    const Handle to = new_file(copy, H5F_LIBVER_EARLIEST, 0);
    hid_t target = to.id();
    H5Aiterate2(from.id(), H5_INDEX_NAME, H5_ITER_INC, nullptr, copy_attribute, &target);
    H5Literate(from.id(), H5_INDEX_NAME, H5_ITER_INC, nullptr, copy_object, &target);
  }
  return whole_file(copy);
}

std::vector<Hdf5File> matrix_files(const std::filesystem::path& folder) {
  std::vector<Hdf5File> files{matrix_file(folder / "new.h5", H5F_LIBVER_LATEST, 0),
                              matrix_file(folder / "old.h5", H5F_LIBVER_EARLIEST, 0)};
  std::string matlab = matrix_file(folder / "matlab.h5", H5F_LIBVER_EARLIEST, 512).bytes();
  matlab.replace(0, 10, "MATLAB 7.3");
  files.emplace_back(std::move(matlab));
  return files;
}

namespace {

constexpr std::array<std::string_view, 18> kSignatures{"OHDR", "OCHK", "BTHD", "BTIN", "BTLF", "FRHP",
                                                       "FHDB", "FHIB", "FAHD", "FADB", "EAHD", "EAIB",
                                                       "EASB", "EADB", "TREE", "SNOD", "HEAP", "GCOL"};
constexpr std::size_t kLongest = 2048;

std::span<const std::uint8_t> span_of(const std::string& bytes, std::size_t begin, std::size_t end) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()) + begin, end - begin};
}

std::uint32_t word_at(const std::string& bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

}  // namespace

Hdf5File::Hdf5File(std::string bytes) : bytes_(std::move(bytes)) {
  const std::size_t head = bytes_.find("\x89HDF\r\n\x1a\n");
  structures_.push_back(head);
  find_sum(head);
  for (std::size_t at = 0; at + 8 < bytes_.size(); ++at) {
    const auto letters = std::string_view(bytes_).substr(at, 4);
    if (std::find(kSignatures.begin(), kSignatures.end(), letters) == kSignatures.end()) continue;
    structures_.push_back(at);
    letters == "FHDB" ? find_sum_of_heap_block(at) : find_sum(at);
  }
}

/// The checksum is the word that fits what is before it. A structure without one has none that fits.
void Hdf5File::find_sum(std::size_t begin) {
  for (std::size_t end = begin + 8; end + 4 <= std::min(bytes_.size(), begin + kLongest); ++end)
    if (tensor::h5::lookup3(span_of(bytes_, begin, end)) == word_at(bytes_, end))
      return sums_.push_back({begin, end, end});
}

/// It is in the head of the block, behind an offset of some bytes.
void Hdf5File::find_sum_of_heap_block(std::size_t begin) {
  for (std::size_t size = 64; begin + size <= bytes_.size(); size *= 2)
    for (std::size_t at = begin + 14; at <= begin + 21; ++at)
      if (const Sum sum{begin, begin + size, at}; sum_of(bytes_, sum) == word_at(bytes_, at))
        return sums_.push_back(sum);
}

std::uint32_t Hdf5File::sum_of(const std::string& bytes, const Sum& sum) {
  std::string part = bytes.substr(sum.begin, sum.end - sum.begin);
  if (sum.at < sum.end) part.replace(sum.at - sum.begin, 4, 4, '\0');
  return tensor::h5::lookup3(span_of(part, 0, part.size()));
}

std::string Hdf5File::changed(std::span<const Hdf5Change> changes) const {
  std::string bytes = bytes_;
  for (const Hdf5Change& change : changes) {
    const std::size_t at = std::min(change.at, bytes.size());
    std::memcpy(bytes.data() + at, &change.number, std::min<std::size_t>(change.bytes, bytes.size() - at));
  }
  for (const Sum& sum : sums_) {
    const std::uint32_t right = sum_of(bytes, sum);
    std::memcpy(bytes.data() + sum.at, &right, sizeof right);
  }
  return bytes;
}

/// A number near a limit, an address, or a neighbour, mostly in the head of a structure.
Hdf5Change Hdf5File::any_change(Random& random) const {
  const std::uint64_t size = bytes_.size();
  const std::size_t structure = any_of(random, structures_);
  const std::size_t reach = below(random, 3) == 0 ? 512 : 64;
  Hdf5Change change{below(random, 8) == 0 ? below(random, size) : structure + 4 + below(random, reach), 1, 0};
  change.at = std::min<std::size_t>(change.at, size - 1);
  change.bytes = any_of(random, std::vector<unsigned>{1, 1, 2, 4, 8});
  std::uint64_t old = 0;
  std::memcpy(&old, bytes_.data() + change.at, std::min<std::size_t>(change.bytes, size - change.at));
  switch (below(random, 4)) {
    case 0:  // an address: of itself, of another structure, of the end
      change.number = any_of(random, std::vector<std::uint64_t>{structure, any_of(random, structures_), size,
                                                                size - 1, size + 1, ~std::uint64_t{0}});
      break;
    case 1:
      change.number = old ^ std::uint64_t{1} << below(random, std::uint64_t{8} * change.bytes);
      break;
    default:
      change.number = static_cast<std::uint64_t>(other_integer(random, static_cast<std::int64_t>(old)));
  }
  return change;
}

std::string Hdf5File::mutated(Random& random) const {
  if (below(random, 16) == 0) return bytes_.substr(0, below(random, bytes_.size()));
  std::vector<Hdf5Change> changes;
  if (below(random, 10) == 0) {  // a structure in the place of another
    const std::size_t from = any_of(random, structures_), to = any_of(random, structures_);
    for (std::size_t k = 0; k < 64 && std::max(from, to) + k < bytes_.size(); ++k)
      changes.push_back({to + k, 1, static_cast<std::uint8_t>(bytes_[from + k])});
  }
  for (std::uint64_t k = 1 + below(random, 3); k > 0; --k) changes.push_back(any_change(random));
  return changed(changes);
}

}  // namespace symrig::structured
