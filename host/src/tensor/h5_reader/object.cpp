// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/object.hpp"

#include "tensor/h5_reader/heap.hpp"
#include "tensor/h5_reader/trees.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

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
Result<void> links_of_node(const FileBytes& file, Address at, const LocalHeap& names, NodeBudget& budget,
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
  NodeBudget budget(file);
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

Result<Object> Object::root(std::shared_ptr<const FileBytes> file) {
  SYMRIG_TRY(Header header, read_header(*file, file->superblock().root));
  return Object(std::move(file), std::move(header));
}

Result<std::optional<Object>> Object::find(std::string_view path) const {
  int links = 16;  // more soft links are a loop
  return follow(path, links);
}

Result<std::optional<Object>> Object::follow(std::string_view path, int& links) const {
  Object at = *this;
  while (!path.empty()) {
    const std::string_view name = path.substr(0, path.find('/'));
    path.remove_prefix(std::min(path.size(), name.size() + 1));
    if (name.empty() || name == ".") continue;
    SYMRIG_TRY(const auto all, links_in(at.file(), at.header_));
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Link& link) { return link.name == name; });
    if (found == all.end()) return std::optional<Object>();
    if (found->kind == Link::Kind::other || --links < 0)
      return Error{ErrorCode::bad_format, fmt::format("'{}' is a link to another file, or to itself", name),
                   "copy the data into this file"};
    if (found->kind == Link::Kind::hard) {
      SYMRIG_TRY(Header header, read_header(at.file(), found->object));
      at = Object(at.file_, std::move(header));
      continue;
    }
    SYMRIG_TRY(const Object from, found->path.starts_with('/') ? root(at.file_) : Result<Object>(at));
    SYMRIG_TRY(auto target, from.follow(found->path, links));
    if (!target) return std::optional<Object>();
    at = *std::move(target);
  }
  return std::optional<Object>(std::move(at));
}

Result<std::vector<std::string>> Object::names() const {
  SYMRIG_TRY(const auto all, links_in(*file_, header_));
  std::vector<std::string> names;
  names.reserve(all.size());
  for (const Link& link : all) names.push_back(link.name);
  std::sort(names.begin(), names.end());
  return names;
}

Result<std::optional<Attribute>> Object::attribute(std::string_view name) const {
  return find_attribute(*file_, header_, name);
}

Result<std::string> text_of(const FileBytes& file, const Attribute& attribute) {
  std::vector<std::uint8_t> bytes = attribute.data;
  if (attribute.type.kind == TypeKind::variable_text) {
    Bytes place(attribute.data);
    const std::uint64_t size = place.number(4);
    const Address heap = file.address(place);
    const std::uint64_t index = place.number(4);
    if (!place.ok()) return Error{ErrorCode::bad_format, "is damaged"};
    if (size == 0 || heap == 0 || heap == kUndefined) return std::string();
    SYMRIG_TRY(bytes, global_object(file, heap, index));
    if (size < bytes.size()) bytes.resize(static_cast<std::size_t>(size));
  }
  std::string text(bytes.begin(), bytes.end());
  const bool ends =
      attribute.type.kind == TypeKind::variable_text || attribute.type.pad == Datatype::Pad::ended_by_zero;
  if (ends) text.resize(std::min(text.find('\0'), text.size()));
  const char pad = attribute.type.pad == Datatype::Pad::spaces && !ends ? ' ' : '\0';
  text.resize(text.find_last_not_of(pad) + 1);
  return text;
}

}  // namespace symrig::tensor::h5
