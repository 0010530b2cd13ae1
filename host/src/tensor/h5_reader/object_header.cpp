// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/heap.hpp"
#include "tensor/h5_reader/object.hpp"
#include "tensor/h5_reader/trees.hpp"

#include <algorithm>
#include <utility>

namespace symrig::tensor::h5 {
namespace {

constexpr std::string_view kHeaderName = "object header";

/// Collects the messages of the blocks of a header.
class HeaderReader {
 public:
  HeaderReader(const FileBytes& file, Address at) : file_(file), at_(at) {}

  Result<Header> read() {
    SYMRIG_TRY(const auto start, file_.read(at_, 4));
    SYMRIG_CHECK(Bytes(start).signature("OHDR") ? first_new_block() : first_old_block());
    // A block names the next one. The blocks of one header are few, and none is there twice.
    std::size_t next = 0;
    while (next < blocks_.size()) SYMRIG_CHECK(next_block(blocks_[next++]));
    return std::move(header_);
  }

 private:
  struct Block {
    Address at;
    std::uint64_t size;
  };
  static constexpr std::uint64_t kMostBytes = std::uint64_t{64} << 20;
  static constexpr std::size_t kMostBlocks = 1 << 12;

  Result<void> first_old_block() {
    SYMRIG_TRY(const auto prefix, file_.read(at_, 16));
    Bytes bytes(prefix);
    if (bytes.byte() != 1) return damaged_at(kHeaderName, at_, "is none");
    bytes.skip(7);
    const std::uint64_t size = bytes.number(4);
    SYMRIG_CHECK(count(size));
    SYMRIG_TRY(const auto block, file_.read(at_ + 16, size));
    return take_messages(block);
  }

  Result<void> first_new_block() {
    SYMRIG_TRY(const auto prefix, file_.read(at_, std::min<std::uint64_t>(34, file_.size() - at_)));
    Bytes bytes(prefix);
    bytes.skip(4);
    new_ = true;
    const unsigned version = bytes.byte(), flags = bytes.byte();
    if (version != 2) return damaged_at(kHeaderName, at_, "has an unknown version");
    ordered_ = (flags & 4U) != 0;
    bytes.skip((flags & 0x20U) != 0 ? 16 : 0);  // times
    bytes.skip((flags & 0x10U) != 0 ? 4 : 0);   // when attributes move to a heap
    const std::uint64_t size = bytes.number(std::uint64_t{1} << (flags & 3U));
    const std::uint64_t head = prefix.size() - bytes.left().size();
    if (!bytes.ok()) return damaged_at(kHeaderName, at_, "is cut short");
    SYMRIG_CHECK(count(size));
    SYMRIG_TRY(const auto block, file_.read_checked(kHeaderName, at_, head + size + 4));
    return take_messages(std::span(block).subspan(static_cast<std::size_t>(head)));
  }

  Result<void> next_block(Block block) {
    SYMRIG_CHECK(count(block.size));
    if (!new_) {
      SYMRIG_TRY(const auto bytes, file_.read(block.at, block.size));
      return take_messages(bytes);
    }
    SYMRIG_TRY(const auto bytes, file_.read_checked(kHeaderName, block.at, block.size));
    if (bytes.size() < 4 || !Bytes(bytes).signature("OCHK"))
      return damaged_at(kHeaderName, block.at, "does not go on where it says");
    return take_messages(std::span(bytes).subspan(4));
  }

  Result<void> count(std::uint64_t size) {
    if (size > kMostBytes - bytes_) return damaged_at(kHeaderName, at_, "is too long");
    bytes_ += size;
    return {};
  }

  Result<void> take_messages(std::span<const std::uint8_t> block) {
    const std::size_t head = new_ ? (ordered_ ? 6 : 4) : 8;
    Bytes bytes(block);
    while (bytes.left().size() >= head) {
      const auto type = static_cast<MessageType>(bytes.number(new_ ? 1 : 2));
      const std::uint64_t size = bytes.number(2);
      const unsigned flags = bytes.byte();
      bytes.skip(head - (new_ ? 4 : 5));
      const auto content = bytes.take(size);
      if (!bytes.ok()) return damaged_at(kHeaderName, at_, "has a message that is cut short");
      if (type == MessageType::continuation) {
        SYMRIG_CHECK(follow(Bytes(content)));
      } else {
        header_.messages.push_back({type, (flags & 2U) != 0, {content.begin(), content.end()}});
      }
    }
    return {};
  }

  Result<void> follow(Bytes content) {
    const Block block{file_.address(content), file_.length(content)};
    const bool again =
        std::any_of(blocks_.begin(), blocks_.end(), [&](const Block& other) { return other.at == block.at; });
    if (!content.ok() || again || blocks_.size() == kMostBlocks)
      return damaged_at(kHeaderName, at_, "goes on without an end");
    blocks_.push_back(block);
    return {};
  }

  const FileBytes& file_;
  Address at_;
  bool new_ = false, ordered_ = false;
  std::uint64_t bytes_ = 0;
  std::vector<Block> blocks_;
  Header header_;
};

}  // namespace

const Message* Header::find(MessageType type) const {
  const auto found = std::find_if(messages.begin(), messages.end(),
                                  [&](const Message& message) { return message.type == type; });
  return found == messages.end() ? nullptr : &*found;
}

Result<Header> read_header(const FileBytes& file, Address at) {
  if (at >= file.size()) return damaged_at(kHeaderName, at, "is behind the end of the file");
  return HeaderReader(file, at).read();
}

Result<std::vector<std::uint8_t>> content_of(const FileBytes& file, const Message& message) {
  if (!message.shared) return message.bytes;
  Bytes bytes(message.bytes);
  const unsigned version = bytes.byte(), kind = bytes.byte();
  if (version == 1) bytes.skip(6);
  if (version == 0 || version > 3 || (version == 3 && kind != 2))
    return Error{ErrorCode::bad_format, "has messages in a heap that its objects share",
                 "h5repack FILE OTHER.h5 makes a file that symrig reads"};
  const Address at = file.address(bytes);
  if (!bytes.ok()) return damaged_at("shared message", at, "is cut short");
  SYMRIG_TRY(const Header header, read_header(file, at));
  const Message* const found = header.find(message.type);
  if (found == nullptr || found->shared) return damaged_at("shared message", at, "is missing");
  return found->bytes;
}

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
