// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/h5_reader/datatype.hpp"
#include "tensor/h5_reader/file_bytes.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::tensor::h5 {

/// Messages of object headers that are read here.
enum class MessageType : std::uint16_t {
  space = 0x01,
  link_info = 0x02,
  type = 0x03,
  old_fill = 0x04,
  fill = 0x05,
  link = 0x06,
  external_files = 0x07,
  layout = 0x08,
  filters = 0x0B,
  attribute = 0x0C,
  continuation = 0x10,
  symbol_table = 0x11,
  attribute_info = 0x15,
};

struct Message {
  MessageType type;
  bool shared = false;  ///< the bytes say where it is
  std::vector<std::uint8_t> bytes;
};

/// The messages of an object: all that the file says of a group or dataset.
struct Header {
  std::vector<Message> messages;

  /// nullptr: none.
  const Message* find(MessageType type) const;
};

/// fails: bad_format.
Result<Header> read_header(const FileBytes& file, Address at);

/// The bytes of a message; of one that several objects share, those of the object that it names.
/// fails: bad_format.
Result<std::vector<std::uint8_t>> content_of(const FileBytes& file, const Message& message);

struct Attribute {
  Datatype type;
  Space space;
  std::vector<std::uint8_t> data;  ///< all values of its space, as stored
};

/// Nothing: the object has none of this name.  fails: bad_format.
Result<std::optional<Attribute>> find_attribute(const FileBytes& file, const Header& header,
                                                std::string_view name);

struct Link {
  enum class Kind : std::uint8_t { hard, soft, other };  ///< other: to another file

  std::string name;
  Kind kind = Kind::other;
  Address object = kUndefined;  ///< hard links
  std::string path = {};        ///< soft links
};

/// The links of a group, in no order. An object that is no group has none.  fails: bad_format.
Result<std::vector<Link>> links_in(const FileBytes& file, const Header& header);

// Reads HDF5 files without the HDF5 library, which does not survive all damaged ones. What is not read here
// is refused by name.

/// A group or dataset of an open file. The file stays open as long as one of its objects lives. Several
/// threads may use it.
class Object {
 public:
  /// The root of a file.  fails: bad_format.
  static Result<Object> root(std::shared_ptr<const FileBytes> file);

  /// Follows hard and soft links; nothing: there is none of this name.  path: "group/dataset".
  /// fails: bad_format (damaged, or a link to another file).
  Result<std::optional<Object>> find(std::string_view path) const;
  /// Names of all links, sorted.  fails: bad_format.
  Result<std::vector<std::string>> names() const;
  Result<std::optional<Attribute>> attribute(std::string_view name) const;
  bool is_dataset() const { return header_.find(MessageType::layout) != nullptr; }

  const FileBytes& file() const { return *file_; }
  const Header& header() const { return header_; }

 private:
  Object(std::shared_ptr<const FileBytes> file, Header header)
      : file_(std::move(file)), header_(std::move(header)) {}
  Result<std::optional<Object>> follow(std::string_view path, int& links) const;

  std::shared_ptr<const FileBytes> file_;
  Header header_;
};

/// The text of an attribute.  fails: bad_format.
Result<std::string> text_of(const FileBytes& file, const Attribute& attribute);

}  // namespace symrig::tensor::h5
