// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/groups.hpp"

#include "tensor/h5_reader/heap.hpp"
#include "tensor/h5_reader/new_trees.hpp"
#include "tensor/h5_reader/old_trees.hpp"

#include <utility>

namespace symrig::tensor::h5 {
namespace {

constexpr unsigned kSoftLink = 1, kHardLink = 0;

std::string text_of(std::span<const std::uint8_t> bytes) {
  return {bytes.begin(), bytes.end()};
}

Result<Link> parse_link(const FileBytes& file, std::span<const std::uint8_t> message) {
  Bytes bytes(message);
  const unsigned version = bytes.byte(), flags = bytes.byte();
  const unsigned kind = (flags & 8U) != 0 ? bytes.byte() : kHardLink;
  bytes.skip((flags & 4U) != 0 ? 8 : 0);     // its number in the order of creation
  bytes.skip((flags & 0x10U) != 0 ? 1 : 0);  // letters
  Link link;
  link.name = text_of(bytes.take(bytes.number(std::uint64_t{1} << (flags & 3U))));
  if (kind == kHardLink) {
    link.kind = Link::Kind::hard;
    link.object = file.address(bytes);
  } else if (kind == kSoftLink) {
    link.kind = Link::Kind::soft;
    link.path = text_of(bytes.take(bytes.number(2)));
  }
  if (version != 1 || !bytes.ok()) return Error{ErrorCode::bad_format, "has a damaged link"};
  return link;
}

/// Links of a group that has many are in a heap, with a tree of their names.
Result<void> links_of_heap(const FileBytes& file, std::span<const std::uint8_t> info,
                           std::vector<Link>& links) {
  Bytes bytes(info);
  bytes.skip(1);
  bytes.skip((bytes.byte() & 1U) != 0 ? 8 : 0);
  const Address at = file.address(bytes), names = file.address(bytes);
  if (!bytes.ok()) return Error{ErrorCode::bad_format, "has a group whose links are damaged"};
  if (at == kUndefined) return {};
  SYMRIG_TRY(FractalHeap heap, FractalHeap::open(file, at));
  constexpr unsigned kLinksByName = 5;
  return walk_new_tree(file, names, kLinksByName, [&](Bytes record) -> Result<void> {
    record.skip(4);  // of the name
    SYMRIG_TRY(const auto message, heap.object(record.take(heap.id_bytes())));
    SYMRIG_TRY(Link link, parse_link(file, message));
    links.push_back(std::move(link));
    return {};
  });
}

/// A node of an old group.
Result<void> links_of_node(const FileBytes& file, Address at, const LocalHeap& names, Budget& budget,
                           std::vector<Link>& links) {
  constexpr std::string_view kName = "symbol table node";
  const std::uint64_t a = file.superblock().address_bytes;
  SYMRIG_TRY(const auto head, file.read(at, 8));
  Bytes start(head);
  if (!start.signature("SNOD")) return damaged_at(kName, at, "is none");
  start.skip(2);
  const std::uint64_t count = start.number(2), entry_bytes = 2 * a + 24;
  SYMRIG_CHECK(budget.take(kName, at, 8 + count * entry_bytes));
  SYMRIG_TRY(const auto entries, file.read(at + 8, count * entry_bytes));
  Bytes bytes(entries);
  for (std::uint64_t k = 0; k < count; ++k) {
    Link link;
    SYMRIG_TRY(link.name, names.text(bytes.number(a)));
    link.object = file.address(bytes);
    const bool is_soft = bytes.number(4) == 2;
    bytes.skip(4);
    Bytes scratch(bytes.take(16));
    link.kind = is_soft ? Link::Kind::soft : Link::Kind::hard;
    if (is_soft) {
      SYMRIG_TRY(link.path, names.text(scratch.number(4)));
    }
    links.push_back(std::move(link));
  }
  return {};
}

Result<void> links_of_table(const FileBytes& file, std::span<const std::uint8_t> table,
                            std::vector<Link>& links) {
  Bytes bytes(table);
  const Address tree = file.address(bytes), heap = file.address(bytes);
  SYMRIG_TRY(const LocalHeap names, LocalHeap::open(file, heap));
  Budget budget(file);
  return walk_old_tree(file, tree, 0, file.superblock().length_bytes,
                       [&](Bytes, Address node) { return links_of_node(file, node, names, budget, links); });
}

}  // namespace

Result<std::vector<Link>> links_in(const FileBytes& file, const Header& header) {
  std::vector<Link> links;
  for (const Message& message : header.messages) {
    if (message.type == MessageType::link) {
      SYMRIG_TRY(Link link, parse_link(file, message.bytes));
      links.push_back(std::move(link));
    }
    if (message.type == MessageType::link_info) SYMRIG_CHECK(links_of_heap(file, message.bytes, links));
    if (message.type == MessageType::symbol_table) SYMRIG_CHECK(links_of_table(file, message.bytes, links));
  }
  return links;
}

}  // namespace symrig::tensor::h5
