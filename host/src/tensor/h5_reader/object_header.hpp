// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/h5_reader/file_bytes.hpp"

#include <cstdint>
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

}  // namespace symrig::tensor::h5
