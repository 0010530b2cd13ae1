// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/heap.hpp"

#include "tensor/h5_reader/file_bytes.hpp"
#include "tensor/h5_reader/trees.hpp"

#include <algorithm>
#include <bit>

namespace symrig::tensor::h5 {
namespace {

constexpr std::string_view kFractal = "fractal heap", kLocal = "local heap", kGlobal = "global heap";

std::uint64_t bytes_for_bits(std::uint64_t bits) {
  return (bits + 7) / 8;
}

std::uint64_t log2_of(std::uint64_t power) {
  return static_cast<std::uint64_t>(std::bit_width(power)) - 1;
}

}  // namespace

Result<FractalHeap> FractalHeap::open(const FileBytes& file, Address header) {
  FractalHeap heap(file);
  SYMRIG_CHECK(heap.read_head(header));
  return heap;
}

Result<void> FractalHeap::read_head(Address header) {
  const std::uint64_t a = file_->superblock().address_bytes, l = file_->superblock().length_bytes;
  SYMRIG_TRY(const auto head, file_->read_checked(kFractal, header, 26 + 3 * a + 12 * l));
  Bytes bytes(head);
  if (!bytes.signature("FRHP") || bytes.byte() != 0) return damaged_at(kFractal, header, "is none");
  id_bytes_ = bytes.number(2);
  const std::uint64_t filters = bytes.number(2);
  checked_ = (bytes.byte() & 2U) != 0;
  const std::uint64_t most_managed = bytes.number(4);
  bytes.skip(l);  // the next ID of a huge object
  huge_tree_ = file_->address(bytes);
  bytes.skip(l + a + 8 * l);  // free space; sums over its objects
  width_ = bytes.number(2);
  start_ = file_->length(bytes);
  largest_ = file_->length(bytes);
  const std::uint64_t bits = bytes.number(2);
  bytes.skip(2);
  root_ = file_->address(bytes);
  root_rows_ = bytes.number(2);
  if (filters != 0) return damaged_at(kFractal, header, "is compressed, which symrig does not read");
  if (!std::has_single_bit(width_) || !std::has_single_bit(start_) || !std::has_single_bit(largest_) ||
      largest_ < start_ || log2_of(largest_) > 32 || bits > 64 || root_rows_ > 64 || width_ > 1024)
    return damaged_at(kFractal, header, "has impossible sizes");
  offset_bytes_ = bytes_for_bits(bits);
  size_bytes_ = std::min(bytes_for_bits(log2_of(largest_)), bytes_for_bits(std::bit_width(most_managed)));
  direct_rows_ = log2_of(largest_) - log2_of(start_) + 2;
  return {};
}

Result<std::vector<std::uint8_t>> FractalHeap::object(std::span<const std::uint8_t> id) {
  constexpr std::uint64_t kShortTiny = 16;
  Bytes bytes(id);
  const unsigned head = bytes.byte(), kind = head >> 4U & 3U;
  if (kind == 1) return huge(bytes);
  if (kind == 2) {
    std::uint64_t size = head & 0xFU;
    if (id.size() > kShortTiny + 1) size = size << 8U | bytes.byte();
    const auto content = bytes.take(size + 1);
    if (bytes.ok()) return std::vector<std::uint8_t>(content.begin(), content.end());
  } else if (kind == 0) {
    const std::uint64_t offset = bytes.number(offset_bytes_), size = bytes.number(size_bytes_);
    if (bytes.ok()) return managed(offset, size);
  }
  return Error{ErrorCode::bad_format, "has a fractal heap with an impossible ID"};
}

Result<std::vector<std::uint8_t>> FractalHeap::managed(std::uint64_t offset, std::uint64_t size) {
  SYMRIG_TRY(const Place block, direct_block(offset));
  SYMRIG_CHECK(load(block));
  if (offset > block_.size() || size > block_.size() - offset)
    return damaged_at(kFractal, block.at, "has an object that leaves its block");
  const auto begin = block_.begin() + static_cast<std::ptrdiff_t>(offset);
  return std::vector<std::uint8_t>(begin, begin + static_cast<std::ptrdiff_t>(size));
}

/// The block with this place of the heap; afterwards, offset is that in the block. Rows of blocks double in
/// size, and so do the indirect blocks behind the direct ones.
Result<FractalHeap::Place> FractalHeap::direct_block(std::uint64_t& offset) const {
  if (root_rows_ == 0) return Place{root_, start_};
  Address block = root_;
  std::uint64_t rows = root_rows_;
  for (;;) {
    const std::uint64_t first = width_ * start_;
    const std::uint64_t row = offset < first ? 0 : log2_of(offset / first) + 1;
    if (row >= rows) return damaged_at(kFractal, block, "has an object that leaves the heap");
    if (row > 0) offset -= first << (row - 1);
    const std::uint64_t size = row_size(row);
    SYMRIG_TRY(block, child_of(block, rows, row, offset / size));
    offset %= size;
    if (row < direct_rows_) return Place{block, size};
    if (size < first) return damaged_at(kFractal, block, "has impossible sizes");
    // An indirect block has the size of its rows together, so its objects are in fewer rows than these.
    rows = log2_of(size) - log2_of(first) + 1;
  }
}

Result<Address> FractalHeap::child_of(Address block, std::uint64_t rows, std::uint64_t row,
                                      std::uint64_t col) const {
  const std::uint64_t a = file_->superblock().address_bytes, head = 5 + a + offset_bytes_;
  SYMRIG_TRY(const auto content, file_->read_checked(kFractal, block, head + rows * width_ * a + 4));
  Bytes bytes(content);
  if (!bytes.signature("FHIB")) return damaged_at(kFractal, block, "has no block where it says");
  bytes.skip(head - 4 + (row * width_ + col) * a);
  const Address child = file_->address(bytes);
  if (!bytes.ok()) return damaged_at(kFractal, block, "has no block where it says");
  return child;
}

/// The checksum of a direct block is in its head, and was computed with zeros there.
Result<void> FractalHeap::load(Place block) {
  if (loaded_ == block.at && block_.size() == block.size) return {};
  loaded_ = kUndefined;
  SYMRIG_TRY(block_, file_->read(block.at, block.size));
  Bytes bytes(block_);
  if (!bytes.signature("FHDB")) return damaged_at(kFractal, block.at, "has no block where it says");
  if (checked_) {
    bytes.skip(1 + file_->superblock().address_bytes + offset_bytes_);
    const std::size_t at = block_.size() - bytes.left().size();
    const std::uint64_t checksum = bytes.number(4);
    if (!bytes.ok()) return damaged_at(kFractal, block.at, "has a block that is too short");
    std::fill_n(block_.begin() + static_cast<std::ptrdiff_t>(at), 4, std::uint8_t{0});
    if (lookup3(block_) != checksum) return damaged_at(kFractal, block.at, "fails its checksum");
  }
  loaded_ = block.at;
  return {};
}

/// The ID of a huge object is its place, or its number in a tree.
Result<std::vector<std::uint8_t>> FractalHeap::huge(Bytes id) {
  const std::uint64_t place_bytes = file_->superblock().address_bytes + file_->superblock().length_bytes;
  Place place{};
  if (id.left().size() >= place_bytes) {
    place.at = file_->address(id);
    place.size = file_->length(id);
  } else {
    SYMRIG_CHECK(list_huge());
    const auto found = huge_.find(id.number(std::min<std::uint64_t>(id.left().size(), 8)));
    if (found == huge_.end()) return damaged_at(kFractal, huge_tree_, "lacks a huge object");
    place = found->second;
  }
  return file_->read(place.at, place.size);
}

Result<void> FractalHeap::list_huge() {
  if (huge_listed_) return {};
  huge_listed_ = true;
  constexpr unsigned kHugeByNumber = 1;
  return walk_new_tree(*file_, huge_tree_, kHugeByNumber, [this](Bytes record) -> Result<void> {
    Place place{file_->address(record), 0};
    place.size = file_->length(record);
    huge_[file_->length(record)] = place;
    return {};
  });
}

Result<LocalHeap> LocalHeap::open(const FileBytes& file, Address header) {
  const std::uint64_t size = 8 + 2 * file.superblock().length_bytes + file.superblock().address_bytes;
  SYMRIG_TRY(const auto head, file.read(header, size));
  Bytes bytes(head);
  if (!bytes.signature("HEAP")) return damaged_at(kLocal, header, "is none");
  bytes.skip(4);
  const std::uint64_t texts = file.length(bytes);
  bytes.skip(file.superblock().length_bytes);  // its free space
  LocalHeap heap;
  SYMRIG_TRY(heap.texts_, file.read(file.address(bytes), texts));
  return heap;
}

Result<std::string> LocalHeap::text(std::uint64_t offset) const {
  const auto begin =
      texts_.begin() + static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(offset, texts_.size()));
  const auto end = std::find(begin, texts_.end(), std::uint8_t{0});
  if (end == texts_.end())
    return Error{ErrorCode::bad_format, "has a local heap with a name that does not end"};
  return std::string(begin, end);
}

Result<std::vector<std::uint8_t>> global_object(const FileBytes& file, Address collection,
                                                std::uint64_t index) {
  const std::uint64_t l = file.superblock().length_bytes;
  SYMRIG_TRY(const auto head, file.read(collection, 8 + l));
  Bytes start(head);
  if (!start.signature("GCOL")) return damaged_at(kGlobal, collection, "is none");
  start.skip(4);
  SYMRIG_TRY(const auto all, file.read(collection, file.length(start)));
  Bytes bytes(all);
  bytes.skip(8 + l);
  while (bytes.left().size() >= 8 + l) {
    const std::uint64_t number = bytes.number(2);
    bytes.skip(6);
    const std::uint64_t size = file.length(bytes);
    if (number == 0) break;  // free space until the end
    const auto content = bytes.take(size);
    bytes.skip((8 - size % 8) % 8);
    if (!bytes.ok()) return damaged_at(kGlobal, collection, "has an object that leaves it");
    if (number == index) return std::vector<std::uint8_t>(content.begin(), content.end());
  }
  return damaged_at(kGlobal, collection, "lacks an object");
}

}  // namespace symrig::tensor::h5
