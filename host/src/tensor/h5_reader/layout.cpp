// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/layout.hpp"

#include <algorithm>

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

}  // namespace symrig::tensor::h5
