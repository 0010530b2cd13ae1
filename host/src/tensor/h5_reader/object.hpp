// SPDX-License-Identifier: Apache-2.0
// Reads HDF5 files without the HDF5 library, which does not survive all damaged ones. What is not read here
// is refused by name.
#pragma once

#include "tensor/h5_reader/attributes.hpp"
#include "tensor/h5_reader/datatype.hpp"
#include "tensor/h5_reader/groups.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::tensor::h5 {

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
