// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/statistics.hpp"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

// Numbers to try in the place of a good one.

namespace symrig::structured {

inline std::uint64_t below(Random& random, std::uint64_t n) {
  return n == 0 ? 0 : random.bits() % n;
}

template <class T>
const T& any_of(Random& random, const std::vector<T>& choices) {
  return choices[below(random, choices.size())];
}

/// An extreme, a neighbour of the old value, or anything.
inline std::int64_t other_integer(Random& random, std::int64_t old) {
  constexpr std::int64_t kInt = std::numeric_limits<std::int32_t>::max();
  constexpr std::int64_t kLong = std::numeric_limits<std::int64_t>::max();
  static const std::vector<std::int64_t> extremes{0,
                                                  1,
                                                  -1,
                                                  2,
                                                  3,
                                                  7,
                                                  63,
                                                  64,
                                                  255,
                                                  256,
                                                  1024,
                                                  1 << 15,
                                                  1 << 16,
                                                  1 << 24,
                                                  1 << 30,
                                                  kInt,
                                                  -kInt - 1,
                                                  kInt + 1,
                                                  std::int64_t{1} << 32,
                                                  std::int64_t{1} << 62,
                                                  kLong,
                                                  -kLong - 1};
  switch (below(random, 4)) {
    case 0:
      return any_of(random, extremes);
    case 1:
      return static_cast<std::int64_t>(static_cast<std::uint64_t>(old) + below(random, 5) - 2);
    case 2:
      return static_cast<std::int64_t>(below(random, 64)) - 4;
    default:
      return static_cast<std::int64_t>(random.bits()) >> below(random, 64);
  }
}

inline double other_real(Random& random, double old) {
  static const std::vector<double> extremes{0.0,
                                            -0.0,
                                            1.0,
                                            -1.0,
                                            std::numeric_limits<double>::quiet_NaN(),
                                            std::numeric_limits<double>::infinity(),
                                            -std::numeric_limits<double>::infinity(),
                                            std::numeric_limits<double>::max(),
                                            static_cast<double>(std::numeric_limits<float>::max()),
                                            -static_cast<double>(std::numeric_limits<float>::max()),
                                            static_cast<double>(std::numeric_limits<float>::denorm_min()),
                                            65504.0,
                                            0x1p60,
                                            0x1p59,
                                            1e-30};
  switch (below(random, 4)) {
    case 0:
      return any_of(random, extremes);
    case 1:
      return -old;
    case 2:
      return old * (1 + random.uniform());
    default:
      return std::bit_cast<double>(random.bits());
  }
}

/// The JSON text with one to three of its values changed: another number, another kind of value, an entry
/// gone, doubled, or nested deeply. The result is JSON.
std::string mutate_json(const std::string& text, Random& random);

/// Any text: JSON as above; else cut, lengthened, or replaced. May not be JSON any more.
std::string mutate_text(const std::string& text, Random& random);

/// Changes one to three things in a scene file by way of the HDF5 library, which makes all checksums right
/// again: values, shapes, types, texts; things are deleted, doubled, or linked to elsewhere. What was done.
std::string mutate_scene(const std::filesystem::path& file, Random& random);

// HDF5 files whose structure is damaged, while their checksums are right: sizes, addresses, counts, versions,
// loops.

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
