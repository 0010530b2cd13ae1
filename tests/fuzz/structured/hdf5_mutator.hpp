// SPDX-License-Identifier: Apache-2.0
// HDF5 files whose structure is damaged, while their checksums are right: sizes, addresses, counts, versions,
// loops. scene_mutator.hpp changes values in files that stay whole.
#pragma once

#include "symrig/base/random.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace symrig::structured {

/// A number in the place of another one.
struct Hdf5Change {
  std::size_t at;
  unsigned bytes;  ///< 1 to 8
  std::uint64_t number;
};

/// A whole file, and where its structures and checksums are.
class Hdf5File {
 public:
  explicit Hdf5File(std::string bytes);

  const std::string& bytes() const { return bytes_; }
  /// Where structures begin.
  const std::vector<std::size_t>& structures() const { return structures_; }
  /// The file with these changes, and with the checksums of what they changed.
  std::string changed(std::span<const Hdf5Change> changes) const;
  /// One to three changes; sometimes a structure is in the place of another, or the file is cut.
  std::string mutated(Random& random) const;

 private:
  /// A checksum over [begin, end), which counts itself as zeros if it is inside.
  struct Sum {
    std::size_t begin, end, at;
  };
  void find_sum(std::size_t begin);
  void find_sum_of_heap_block(std::size_t begin);
  static std::uint32_t sum_of(const std::string& bytes, const Sum& sum);
  Hdf5Change any_change(Random& random) const;

  std::string bytes_;
  std::vector<std::size_t> structures_;
  std::vector<Sum> sums_;
};

/// Small files of each kind, written by the HDF5 library: matrices T in the library's older and newer layouts
/// with every index of chunks, heaps, and a file as MATLAB writes it. folder: for temporary files.
std::vector<Hdf5File> matrix_files(const std::filesystem::path& folder);
/// The same file in the older layout, as h5py writes files.
Hdf5File in_older_layout(const std::filesystem::path& file, const std::filesystem::path& folder);
Hdf5File whole_file(const std::filesystem::path& file);

}  // namespace symrig::structured
