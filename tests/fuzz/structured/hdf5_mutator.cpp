// SPDX-License-Identifier: Apache-2.0
#include "hdf5_mutator.hpp"

#include "tensor/h5_reader/checksum.hpp"
#include "values.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <utility>

namespace symrig::structured {
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
