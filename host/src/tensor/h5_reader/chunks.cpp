// SPDX-License-Identifier: Apache-2.0
// The structures that list the chunks of a dataset.
#include "tensor/h5_reader/dataset.hpp"
#include "tensor/h5_reader/trees.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <utility>

namespace symrig::tensor::h5 {
namespace {

/// More chunks than a file of any size lists.
constexpr std::uint64_t kMostChunks = std::uint64_t{1} << 48;

/// Collects the chunks that are wanted.
class ChunkList {
 public:
  ChunkList(const FileBytes& file, const Layout& layout, const Space& space, std::uint64_t chunk_bytes,
            bool filtered)
      : file_(file),
        layout_(layout),
        space_(space),
        grid_(space.size, layout.chunk),
        chunk_bytes_(chunk_bytes),
        filtered_(filtered) {}

  Result<std::vector<StoredChunk>> list(std::uint64_t first, std::uint64_t last) {
    first_ = first, last_ = last;
    if (layout_.at == kUndefined || first == last) return std::vector<StoredChunk>{};
    if (grid_.all() > kMostChunks) return Error{ErrorCode::bad_format, "has too many chunks"};
    SYMRIG_CHECK(collect());
    const auto by_number = [](const StoredChunk& a, const StoredChunk& b) { return a.number < b.number; };
    std::sort(chunks_.begin(), chunks_.end(), by_number);
    const auto same = [](const StoredChunk& a, const StoredChunk& b) { return a.number == b.number; };
    if (std::adjacent_find(chunks_.begin(), chunks_.end(), same) != chunks_.end())
      return Error{ErrorCode::bad_format, "is damaged: a chunk is there twice"};
    return std::move(chunks_);
  }

 private:
  Result<void> collect() {
    switch (layout_.index) {
      case Layout::Index::old_tree:
        return old_tree();
      case Layout::Index::single:
        add(0, {0, layout_.at, filtered_ ? layout_.single_bytes : chunk_bytes_, layout_.single_skipped});
        return {};
      case Layout::Index::implicit:
        return implicit();
      case Layout::Index::fixed_array:
        return fixed_array();
      case Layout::Index::extensible_array:
        return extensible_array();
      case Layout::Index::new_tree:
        return new_tree();
    }
    return {};
  }

  void add(std::uint64_t number, StoredChunk chunk) {
    chunk.number = number;
    if (number >= first_ && number < last_ && chunk.at != kUndefined) chunks_.push_back(chunk);
  }

  Result<void> old_tree() {
    const std::size_t rank = layout_.chunk.size();
    return walk_old_tree(file_, layout_.at, 1, 8 + 8 * (rank + 1),
                         [&](Bytes key, Address at) -> Result<void> {
                           StoredChunk chunk{0, at, key.number(4), 0};
                           chunk.skipped = static_cast<std::uint32_t>(key.number(4));
                           Shape place;
                           for (const std::uint64_t size : layout_.chunk) {
                             const std::uint64_t begin = key.number(8);
                             if (begin % size != 0)
                               return Error{ErrorCode::bad_format, "is damaged: a chunk is at an odd place"};
                             place.push_back(begin / size);
                           }
                           add(grid_.number(place), chunk);
                           return {};
                         });
  }

  Result<void> new_tree() {
    const std::size_t rank = layout_.chunk.size();
    return walk_new_tree(file_, layout_.at, filtered_ ? 11 : 10, [&](Bytes record) -> Result<void> {
      const std::uint64_t places = 8 * rank, stored = record.left().size();
      if (stored < places) return Error{ErrorCode::bad_format, "has a damaged list of chunks"};
      const StoredChunk chunk = entry(Bytes(record.take(stored - places)));
      Shape place;
      for (std::size_t k = 0; k < rank; ++k) place.push_back(record.number(8));
      add(grid_.number(place), chunk);
      return {};
    });
  }

  /// An entry of an array, or the beginning of a record of a tree.
  StoredChunk entry(Bytes bytes) const {
    StoredChunk chunk{0, file_.address(bytes), chunk_bytes_, 0};
    if (!filtered_) return chunk;
    const std::size_t left = bytes.left().size();
    chunk.bytes = bytes.number(left < 4 ? 0 : left - 4);
    chunk.skipped = static_cast<std::uint32_t>(bytes.number(4));
    return chunk;
  }

  /// Arrays number the chunks of the largest dataset that may come.
  Result<void> implicit() {
    const ChunkGrid most(space_.most, layout_.chunk);
    if (most.all() > kMostChunks) return Error{ErrorCode::bad_format, "has too many chunks"};
    for (std::uint64_t k = first_; k < last_; ++k) {
      const std::uint64_t at = most.number(grid_.place(k));
      if (at > file_.size() / std::max<std::uint64_t>(chunk_bytes_, 1))
        return Error{ErrorCode::bad_format, "is damaged: a chunk is behind the end of the file"};
      add(k, {0, layout_.at + at * chunk_bytes_, chunk_bytes_, 0});
    }
    return {};
  }

  Result<void> fixed_array() {
    constexpr std::string_view kName = "array of chunks";
    const std::uint64_t a = file_.superblock().address_bytes;
    SYMRIG_TRY(const auto head,
               file_.read_checked(kName, layout_.at, 12 + file_.superblock().length_bytes + a));
    Bytes bytes(head);
    if (!bytes.signature("FAHD")) return damaged_at(kName, layout_.at, "is none");
    bytes.skip(2);
    entry_bytes_ = bytes.byte();
    const unsigned page_bits = bytes.byte();
    const std::uint64_t entries = file_.length(bytes);
    const Address block = file_.address(bytes);
    const ChunkGrid most(space_.most, layout_.chunk);
    if (block == kUndefined) return {};
    if (entry_bytes_ < a || page_bits > 32 || most.all() > kMostChunks || entries != most.all())
      return damaged_at(kName, layout_.at, "has impossible sizes");
    const auto take = [&](std::uint64_t number, Bytes bytes_of_entry) {
      add(grid_.number(most.place(number)), entry(bytes_of_entry));
    };
    return data_block({"FADB", block, 6 + a, 0, entries, std::uint64_t{1} << page_bits, {}}, take);
  }

  /// Entries behind a head. Many are in pages, and only pages with entries were ever written.
  struct DataBlock {
    std::string_view signature;
    Address at;
    std::uint64_t head;
    std::uint64_t first, entries;  ///< numbers of its entries
    std::uint64_t of_a_page;
    std::vector<std::uint8_t> pages;  ///< which were written, if the block does not say it itself
  };
  using TakeEntry = std::function<void(std::uint64_t number, Bytes entry)>;

  Result<void> data_block(const DataBlock& block, const TakeEntry& take) {
    constexpr std::string_view kName = "block of chunks";
    const bool paged = block.entries > block.of_a_page, lists_pages = paged && block.signature == "FADB";
    const std::uint64_t pages = (block.entries - 1) / block.of_a_page + 1;
    const std::uint64_t list = lists_pages ? (pages + 7) / 8 : 0;
    const std::uint64_t content = paged ? list : block.entries * entry_bytes_;
    SYMRIG_CHECK(budget_.take(kName, block.at, content));
    SYMRIG_TRY(const auto head, file_.read_checked(kName, block.at, block.head + content + 4));
    Bytes bytes(head);
    if (!bytes.signature(block.signature)) return damaged_at(kName, block.at, "is none");
    bytes.skip(block.head - 4);
    if (!paged) {
      for (std::uint64_t k = 0; k < block.entries; ++k)
        take(block.first + k, Bytes(bytes.take(entry_bytes_)));
      return {};
    }
    const auto written = lists_pages ? bytes.left() : std::span<const std::uint8_t>(block.pages);
    for (std::uint64_t page = 0; page < pages; ++page) {
      if (page / 8 < written.size() && (written[page / 8] & 0x80U >> page % 8) == 0) continue;
      SYMRIG_CHECK(read_page(block, page, block.head + content + 4, take));
    }
    return {};
  }

  Result<void> read_page(const DataBlock& block, std::uint64_t page, std::uint64_t head,
                         const TakeEntry& take) {
    constexpr std::string_view kName = "page of chunks";
    const std::uint64_t begin = page * block.of_a_page;
    const std::uint64_t entries = std::min(block.of_a_page, block.entries - begin);
    const std::uint64_t at = block.at + head + page * (block.of_a_page * entry_bytes_ + 4);
    SYMRIG_CHECK(budget_.take(kName, at, entries * entry_bytes_ + 4));
    SYMRIG_TRY(const auto content, file_.read_checked(kName, at, entries * entry_bytes_ + 4));
    Bytes bytes(content);
    for (std::uint64_t k = 0; k < entries; ++k)
      take(block.first + begin + k, Bytes(bytes.take(entry_bytes_)));
    return {};
  }

  /// What the head of an extensible array says. Blocks of entries are in groups: two groups of the same
  /// number, then twice as many; entries in a block double in the other groups.
  struct Extensible {
    unsigned bits = 0, page_bits = 0;
    std::uint64_t in_index = 0, least = 0, groups_in_index = 0, blocks_in_index = 0;

    static std::uint64_t blocks(unsigned group) { return std::uint64_t{1} << group / 2; }
    std::uint64_t entries(unsigned group) const { return least << (group + 1) / 2; }
    std::uint64_t offset_bytes() const { return (bits + 7) / 8; }
  };

  Result<void> extensible_array() {
    constexpr std::string_view kName = "array of chunks";
    const std::uint64_t a = file_.superblock().address_bytes, l = file_.superblock().length_bytes;
    SYMRIG_TRY(const auto head, file_.read_checked(kName, layout_.at, 16 + 6 * l + a));
    Bytes bytes(head);
    if (!bytes.signature("EAHD")) return damaged_at(kName, layout_.at, "is none");
    bytes.skip(2);
    entry_bytes_ = bytes.byte();
    Extensible array;
    array.bits = bytes.byte();
    array.in_index = bytes.byte();
    array.least = bytes.byte();
    const unsigned pointers = bytes.byte();
    array.page_bits = bytes.byte();
    bytes.skip(6 * l);
    const Address index = file_.address(bytes);
    if (entry_bytes_ < a || array.bits > 64 || array.page_bits > 32 || !std::has_single_bit(array.least) ||
        !std::has_single_bit(pointers) || pointers < 2)
      return damaged_at(kName, layout_.at, "has impossible sizes");
    array.blocks_in_index = 2 * (std::uint64_t{pointers} - 1);
    array.groups_in_index = 2 * (static_cast<std::uint64_t>(std::bit_width(pointers)) - 1);
    return index == kUndefined ? Result<void>() : index_block(array, index);
  }

  /// The number of an entry in the grid: the dimension that may grow comes first in the array.
  std::uint64_t grown_number(std::uint64_t entry) const {
    const auto growing = std::find(space_.most.begin(), space_.most.end(), ~std::uint64_t{0});
    const auto first = static_cast<std::size_t>(growing - space_.most.begin());
    if (growing == space_.most.end()) return ~std::uint64_t{0};
    Shape place(layout_.chunk.size());
    for (std::size_t k = place.size(); k-- > 0;) {
      if (k == first) continue;
      const std::uint64_t chunks = (space_.most[k] + layout_.chunk[k] - 1) / layout_.chunk[k];
      if (chunks == 0) return ~std::uint64_t{0};
      place[k] = entry % chunks;
      entry /= chunks;
    }
    place[first] = entry;
    return grid_.number(place);
  }

  Result<void> index_block(const Extensible& array, Address at) {
    constexpr std::string_view kName = "index of chunks";
    const std::uint64_t a = file_.superblock().address_bytes;
    const std::uint64_t groups = 1 + array.bits - (std::bit_width(array.least) - 1);
    const std::uint64_t supers = groups > array.groups_in_index ? groups - array.groups_in_index : 0;
    const std::uint64_t size =
        6 + a + array.in_index * entry_bytes_ + (array.blocks_in_index + supers) * a + 4;
    SYMRIG_TRY(const auto content, file_.read_checked(kName, at, size));
    Bytes bytes(content);
    if (!bytes.signature("EAIB")) return damaged_at(kName, at, "is none");
    bytes.skip(2 + a);
    std::uint64_t number = 0;
    const auto take = [&](std::uint64_t k, Bytes one) { add(grown_number(k), entry(one)); };
    for (; number < array.in_index; ++number) take(number, Bytes(bytes.take(entry_bytes_)));
    for (unsigned group = 0; group < groups && group / 2 < 24; ++group) {
      if (group < array.groups_in_index) {
        SYMRIG_CHECK(blocks_of(array, group, bytes, {}, number, take));
      } else if (const Address super = file_.address(bytes); super != kUndefined) {
        SYMRIG_CHECK(super_block(array, group, super, number, take));
      } else {
        number += Extensible::blocks(group) * array.entries(group);
      }
    }
    return {};
  }

  Result<void> super_block(const Extensible& array, unsigned group, Address at, std::uint64_t& number,
                           const TakeEntry& take) {
    constexpr std::string_view kName = "super block of chunks";
    const std::uint64_t a = file_.superblock().address_bytes, page = std::uint64_t{1} << array.page_bits;
    const std::uint64_t pages = array.entries(group) > page ? array.entries(group) / page : 0;
    const std::uint64_t lists = Extensible::blocks(group) * ((pages + 7) / 8);
    const std::uint64_t head = 6 + a + array.offset_bytes();
    const std::uint64_t size = head + lists + Extensible::blocks(group) * a + 4;
    SYMRIG_CHECK(budget_.take(kName, at, size));
    SYMRIG_TRY(const auto content, file_.read_checked(kName, at, size));
    Bytes bytes(content);
    if (!bytes.signature("EASB")) return damaged_at(kName, at, "is none");
    bytes.skip(head - 4);
    const auto written = bytes.take(lists);
    return blocks_of(array, group, bytes, written, number, take);
  }

  /// The blocks whose addresses come next. written: the pages of each block that were written.
  Result<void> blocks_of(const Extensible& array, unsigned group, Bytes& bytes,
                         std::span<const std::uint8_t> written, std::uint64_t& number,
                         const TakeEntry& take) {
    const std::uint64_t head = 6 + file_.superblock().address_bytes + array.offset_bytes();
    const std::uint64_t blocks = Extensible::blocks(group), list = written.size() / blocks;
    for (std::uint64_t k = 0; k < blocks; ++k, number += array.entries(group)) {
      const Address at = file_.address(bytes);
      if (!bytes.ok()) return Error{ErrorCode::bad_format, "has a damaged list of chunks"};
      if (at == kUndefined) continue;
      const auto pages = written.subspan(k * list, list);
      SYMRIG_CHECK(data_block({"EADB",
                               at,
                               head,
                               number,
                               array.entries(group),
                               std::uint64_t{1} << array.page_bits,
                               {pages.begin(), pages.end()}},
                              take));
    }
    return {};
  }

  const FileBytes& file_;
  const Layout& layout_;
  const Space& space_;
  ChunkGrid grid_;
  std::uint64_t chunk_bytes_, entry_bytes_ = 0;
  bool filtered_;
  NodeBudget budget_{file_};
  std::uint64_t first_ = 0, last_ = 0;
  std::vector<StoredChunk> chunks_;
};

}  // namespace

Result<std::vector<StoredChunk>> chunks_of(const FileBytes& file, const Layout& layout, const Space& space,
                                           std::uint64_t chunk_bytes, bool filtered, std::uint64_t first,
                                           std::uint64_t last) {
  return ChunkList(file, layout, space, chunk_bytes, filtered).list(first, last);
}

}  // namespace symrig::tensor::h5
