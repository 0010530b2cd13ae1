// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/attributes.hpp"

#include "tensor/h5_reader/heap.hpp"
#include "tensor/h5_reader/new_trees.hpp"

#include <utility>

namespace symrig::tensor::h5 {
namespace {

Error damaged_attribute() {
  return {ErrorCode::bad_format, "is damaged"};
}

/// The parts of an attribute's message. Those of version 1 are padded to 8 bytes.
struct Parts {
  bool shared_type = false, shared_space = false;
  std::span<const std::uint8_t> name, type, space, data;
};

Result<Parts> parts_of_attribute(std::span<const std::uint8_t> message) {
  Bytes bytes(message);
  const unsigned version = bytes.byte(), flags = bytes.byte();
  const std::uint64_t name = bytes.number(2), type = bytes.number(2), space = bytes.number(2);
  if (version < 1 || version > 3) return damaged_attribute();
  bytes.skip(version == 3 ? 1 : 0);  // letters
  const auto take = [&](std::uint64_t size) {
    const auto part = bytes.take(size);
    bytes.skip(version == 1 ? (8 - size % 8) % 8 : 0);
    return part;
  };
  Parts parts{version > 1 && (flags & 1U) != 0, version > 1 && (flags & 2U) != 0, {}, {}, {}, {}};
  parts.name = take(name);
  parts.type = take(type);
  parts.space = take(space);
  parts.data = bytes.left();
  if (!bytes.ok() || name == 0) return damaged_attribute();
  parts.name = parts.name.first(name - 1);  // its end is a zero
  return parts;
}

Result<Attribute> attribute_of(const FileBytes& file, const Parts& parts) {
  const auto content = [&](MessageType type, bool shared, std::span<const std::uint8_t> bytes) {
    return content_of(file, {type, shared, {bytes.begin(), bytes.end()}});
  };
  SYMRIG_TRY(const auto type, content(MessageType::type, parts.shared_type, parts.type));
  SYMRIG_TRY(const auto space, content(MessageType::space, parts.shared_space, parts.space));
  Attribute attribute;
  SYMRIG_TRY(attribute.type, parse_type(type));
  SYMRIG_TRY(attribute.space, parse_space(file, space));
  const std::uint64_t values = attribute.space.empty ? 0 : count(attribute.space.size);
  if (values > parts.data.size() / attribute.type.size) return damaged_attribute();
  const auto data = parts.data.first(values * attribute.type.size);
  attribute.data.assign(data.begin(), data.end());
  return attribute;
}

/// Looks at one message.
Result<void> look_at(const FileBytes& file, std::span<const std::uint8_t> message, std::string_view name,
                     std::optional<Attribute>& found) {
  SYMRIG_TRY(const Parts parts, parts_of_attribute(message));
  if (found || std::string_view(reinterpret_cast<const char*>(parts.name.data()), parts.name.size()) != name)
    return {};
  SYMRIG_TRY(found, attribute_of(file, parts));
  return {};
}

/// Attributes of an object that has many are in a heap, with a tree of their names.
Result<void> look_in_heap(const FileBytes& file, std::span<const std::uint8_t> info, std::string_view name,
                          std::optional<Attribute>& found) {
  Bytes bytes(info);
  bytes.skip(1);
  bytes.skip((bytes.byte() & 1U) != 0 ? 2 : 0);
  const Address at = file.address(bytes), names = file.address(bytes);
  if (!bytes.ok()) return damaged_attribute();
  if (at == kUndefined) return {};
  SYMRIG_TRY(FractalHeap heap, FractalHeap::open(file, at));
  constexpr unsigned kAttributesByName = 8;
  return walk_new_tree(file, names, kAttributesByName, [&](Bytes record) -> Result<void> {
    if (found) return {};
    SYMRIG_TRY(const auto message, heap.object(record.take(heap.id_bytes())));
    return look_at(file, message, name, found);
  });
}

}  // namespace

Result<std::optional<Attribute>> find_attribute(const FileBytes& file, const Header& header,
                                                std::string_view name) {
  std::optional<Attribute> found;
  for (const Message& message : header.messages) {
    if (message.type == MessageType::attribute) {
      SYMRIG_TRY(const auto bytes, content_of(file, message));
      SYMRIG_CHECK(look_at(file, bytes, name, found));
    }
    if (message.type == MessageType::attribute_info)
      SYMRIG_CHECK(look_in_heap(file, message.bytes, name, found));
    if (found) break;
  }
  return found;
}

}  // namespace symrig::tensor::h5
