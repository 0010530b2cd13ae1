// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/object.hpp"

#include "tensor/h5_reader/heap.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig::tensor::h5 {

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
