// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/dataset.hpp"
#include "tensor/h5_reader/file_bytes.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <zlib.h>

namespace symrig::tensor::h5 {
namespace {

Error damaged_layout() {
  return {ErrorCode::bad_format, "has a damaged layout"};
}

/// Version 4: the chunks' sizes, and the structure that lists them.
Result<Layout> parse_new_chunks(const FileBytes& file, Bytes bytes, Layout layout, std::size_t rank) {
  const unsigned flags = bytes.byte(), sizes = bytes.byte();
  const std::uint64_t width = bytes.byte();
  if (sizes != rank + 1) return damaged_layout();
  for (std::size_t k = 0; k < rank; ++k) layout.chunk.push_back(bytes.number(width));
  bytes.skip(width);  // bytes of a value
  const unsigned index = bytes.byte();
  if (index < 1 || index > 5 || !bytes.ok()) return damaged_layout();
  layout.index = static_cast<Layout::Index>(index);
  layout.plain_edges = (flags & 1U) != 0;
  if (layout.index == Layout::Index::single && (flags & 2U) != 0) {
    layout.single_bytes = file.length(bytes);
    layout.single_skipped = static_cast<std::uint32_t>(bytes.number(4));
  }
  constexpr std::array<std::uint64_t, 6> kParameters{0, 0, 0, 1, 5, 6};
  bytes.skip(kParameters[index]);
  layout.at = file.address(bytes);
  if (!bytes.ok()) return damaged_layout();
  return layout;
}

Result<Layout> parse_old_chunks(const FileBytes& file, Bytes bytes, Layout layout, std::size_t rank) {
  const unsigned sizes = bytes.byte();
  layout.at = file.address(bytes);
  if (sizes != rank + 1) return damaged_layout();
  for (std::size_t k = 0; k < rank; ++k) layout.chunk.push_back(bytes.number(4));
  if (!bytes.ok()) return damaged_layout();
  return layout;
}

}  // namespace

Result<Layout> parse_layout(const FileBytes& file, std::span<const std::uint8_t> message,
                            const Space& space) {
  Bytes bytes(message);
  const unsigned version = bytes.byte(), kind = bytes.byte();
  if (version < 3 || version > 4)
    return Error{ErrorCode::bad_format, "has a layout of a version that symrig does not read",
                 "h5repack FILE OTHER.h5 makes a file that it reads"};
  if (kind == 3)
    return Error{ErrorCode::bad_format, "has its data in another file", "copy them into this file"};
  if (kind > 2) return damaged_layout();
  Layout layout;
  layout.kind = static_cast<Layout::Kind>(kind);
  if (layout.kind == Layout::Kind::compact) {
    const auto values = bytes.take(bytes.number(2));
    layout.values.assign(values.begin(), values.end());
  } else if (layout.kind == Layout::Kind::contiguous) {
    layout.at = file.address(bytes);
    layout.bytes = file.length(bytes);
  } else {
    auto chunked = version == 3 ? parse_old_chunks(file, bytes, layout, space.size.size())
                                : parse_new_chunks(file, bytes, layout, space.size.size());
    if (!chunked) return chunked;
    const bool sane =
        std::all_of(chunked->chunk.begin(), chunked->chunk.end(), [](std::uint64_t n) { return n > 0; });
    return sane && !space.size.empty() ? chunked : Result<Layout>(damaged_layout());
  }
  if (!bytes.ok()) return damaged_layout();
  return layout;
}

ChunkGrid::ChunkGrid(const Shape& size, const Shape& chunk) {
  for (std::size_t k = 0; k < size.size(); ++k)
    counts_.push_back(size[k] / chunk[k] + (size[k] % chunk[k] != 0 ? 1 : 0));
  of_a_row_ = count(Shape(counts_.begin() + 1, counts_.end()));
}

Shape ChunkGrid::place(std::uint64_t number) const {
  Shape place(counts_.size());
  for (std::size_t k = counts_.size(); k-- > 0; number /= counts_[k]) place[k] = number % counts_[k];
  return place;
}

std::uint64_t ChunkGrid::number(const Shape& place) const {
  std::uint64_t number = 0;
  for (std::size_t k = 0; k < counts_.size(); ++k) {
    if (place[k] >= counts_[k]) return ~std::uint64_t{0};
    number = number * counts_[k] + place[k];
  }
  return number;
}

namespace {

constexpr std::size_t kChecksum = 4;

/// Filters of HDF5 and h5py, for messages.
std::string_view name_of(std::uint64_t filter) {
  switch (filter) {
    case 4:
      return "szip";
    case 5:
      return "n-bit";
    case 6:
      return "scale-offset";
    case 32000:
      return "LZF";
    case 32001:
      return "Blosc";
    case 32015:
      return "Zstandard";
    default:
      return "a filter of other software";
  }
}

Error damaged_chunk() {
  return {ErrorCode::bad_format, "is damaged: a chunk cannot be uncompressed"};
}

/// Some writers swapped the bytes of both sums (HDF5 1.6.2 and before).
std::uint32_t swapped(std::uint32_t sum) {
  return (sum & 0x00FF00FFU) << 8U | (sum >> 8U & 0x00FF00FFU);
}

Result<void> check_sum(std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < kChecksum) return damaged_chunk();
  const auto all = std::span<const std::uint8_t>(bytes);
  const auto stored = static_cast<std::uint32_t>(Bytes(all.last(kChecksum)).number(kChecksum));
  const std::uint32_t sum = fletcher32(all.first(all.size() - kChecksum));
  if (stored != sum && stored != swapped(sum))
    return Error{ErrorCode::bad_format, "is damaged: a chunk fails its checksum"};
  bytes.resize(bytes.size() - kChecksum);
  return {};
}

/// Deflate makes at most 1032 bytes of one, so `size` is refused before it is allocated.
Result<void> inflate_all(std::vector<std::uint8_t>& bytes, std::uint64_t size) {
  if (size / 1032 > bytes.size()) return damaged_chunk();
  std::vector<std::uint8_t> whole(static_cast<std::size_t>(size));
  uLongf made = whole.size();
  const int outcome = ::uncompress(whole.data(), &made, bytes.data(), bytes.size());
  if (outcome != Z_OK || made != size) return damaged_chunk();
  bytes = std::move(whole);
  return {};
}

/// Bytes were sorted by their place in a value.
void unshuffle(std::vector<std::uint8_t>& bytes, std::size_t element) {
  if (element < 2 || bytes.size() < element) return;
  const std::size_t values = bytes.size() / element;
  const std::vector<std::uint8_t> from = bytes;
  for (std::size_t k = 0; k < element; ++k)
    for (std::size_t v = 0; v < values; ++v) bytes[v * element + k] = from[k * values + v];
}

}  // namespace

Result<Filters> Filters::parse(std::span<const std::uint8_t> message) {
  constexpr std::uint64_t kFirstOther = 256;
  Bytes bytes(message);
  const unsigned version = bytes.byte(), count = bytes.byte();
  if (version == 1) bytes.skip(6);
  if (version < 1 || version > 2) return Error{ErrorCode::bad_format, "has damaged filters"};
  Filters filters;
  for (unsigned k = 0; k < count; ++k) {
    const std::uint64_t id = bytes.number(2);
    const std::uint64_t name = version == 1 || id >= kFirstOther ? bytes.number(2) : 0;
    bytes.skip(2);  // flags
    const std::uint64_t values = bytes.number(2);
    bytes.skip(version == 1 ? (name + 7) / 8 * 8 : name);
    Bytes parameters(bytes.take(4 * values));
    bytes.skip(version == 1 ? values % 2 * 4 : 0);
    if (!bytes.ok()) return Error{ErrorCode::bad_format, "has damaged filters"};
    if (id < 1 || id > 3)
      return Error{ErrorCode::bad_format,
                   fmt::format("is stored with {} (filter {}), which symrig does not read", name_of(id), id),
                   "store it with gzip or without a filter (h5repack -f GZIP=4 FILE OTHER.h5)"};
    filters.filters_.push_back({static_cast<Kind>(id), static_cast<std::uint32_t>(parameters.number(4))});
  }
  return filters;
}

bool Filters::compress() const {
  return std::any_of(filters_.begin(), filters_.end(),
                     [](const Filter& filter) { return filter.kind == Kind::deflate; });
}

Result<void> Filters::undo(std::vector<std::uint8_t>& bytes, std::uint64_t size,
                           std::uint32_t skipped) const {
  const auto used = [&](std::size_t k) { return k >= 32 || (skipped >> k & 1U) == 0; };
  std::uint64_t expected = size;  // before filter k was undone
  for (std::size_t k = 0; k < filters_.size(); ++k)
    if (used(k) && filters_[k].kind == Kind::fletcher32) expected += kChecksum;
  for (std::size_t k = filters_.size(); k-- > 0;) {
    if (!used(k)) continue;
    switch (filters_[k].kind) {
      case Kind::fletcher32:
        SYMRIG_CHECK(check_sum(bytes));
        expected -= kChecksum;
        break;
      case Kind::deflate:
        SYMRIG_CHECK(inflate_all(bytes, expected));
        break;
      case Kind::shuffle:
        unshuffle(bytes, filters_[k].element);
        break;
    }
  }
  if (bytes.size() != size) return Error{ErrorCode::bad_format, "is damaged: a chunk has another size"};
  return {};
}

}  // namespace symrig::tensor::h5
