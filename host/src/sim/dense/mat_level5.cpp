// SPDX-License-Identifier: Apache-2.0
#include "sim/dense/mat_level5.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <zlib.h>

namespace symrig::sim {
namespace {

constexpr std::size_t kFileHead = 128, kTag = 8;
/// More than the head of a variable: its flags, up to 32 sizes, and a name of 63 letters.
constexpr std::size_t kVariableHead = 512;
enum : std::uint32_t { kInt8 = 1, kInt32 = 5, kUint32 = 6, kMatrix = 14, kCompressed = 15 };
enum : std::uint32_t { kSparse = 5, kDouble = 6, kSingle = 7, kLastNumeric = 15 };  // classes of arrays

/// zlib's stream, which ends with its owner.
class Inflater {
 public:
  explicit Inflater(std::string_view in) {
    ready_ = inflateInit(&stream_) == Z_OK;
    // zlib does not change its input; its interface is older than const.
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in.data()));
    stream_.avail_in = static_cast<uInt>(in.size());
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  ~Inflater() {
    if (ready_) inflateEnd(&stream_);
  }
  /// Fills `out` as far as the stream reaches. Returns how many bytes there were, or nothing if it is
  /// damaged.
  std::optional<std::size_t> fill(std::byte* out, std::size_t size) {
    if (!ready_) return std::nullopt;
    stream_.next_out = reinterpret_cast<Bytef*>(out);
    stream_.avail_out = static_cast<uInt>(size);
    const int end = inflate(&stream_, Z_SYNC_FLUSH);
    if (end != Z_OK && end != Z_STREAM_END && end != Z_BUF_ERROR) return std::nullopt;
    return size - stream_.avail_out;
  }

 private:
  z_stream stream_{};
  bool ready_ = false;
};

/// The tag of a data element: type, and where its data lie. A short element has both in 8 bytes.
struct Tag {
  std::uint32_t type = 0;
  std::size_t data = 0, size = 0, next = 0;
};

/// Nothing if the bytes end before its tag does.
std::optional<Tag> tag_at(std::string_view bytes, std::size_t at) {
  if (at > bytes.size() || bytes.size() - at < kTag) return std::nullopt;
  const std::uint32_t first = mat_word(bytes, at);
  if (first >> 16 != 0) return Tag{first & 0xFFFFU, at + 4, std::min<std::size_t>(first >> 16, 4), at + kTag};
  const std::size_t size = mat_word(bytes, at + 4);
  return Tag{first, at + kTag, size, at + kTag + (size + 7) / 8 * 8};
}

std::optional<NumberType> stored_type(std::uint32_t type) {
  switch (type) {
    case kInt8:
      return NumberType::i8;
    case 2:
      return NumberType::u8;
    case 3:
      return NumberType::i16;
    case 4:
      return NumberType::u16;
    case kInt32:
      return NumberType::i32;
    case kUint32:
      return NumberType::u32;
    case 7:
      return NumberType::f32;
    case 9:
      return NumberType::f64;
    default:
      return std::nullopt;
  }
}

std::string class_fault(std::uint32_t flags) {
  const std::uint32_t array_class = flags & 0xFFU;
  if (array_class == kSparse) return "is sparse: give full(T)";
  if (array_class < kDouble || array_class > kLastNumeric) return "is no numeric array";
  return (flags & 0x0800U) != 0 ? "is complex" : "";
}

/// Reads the head of a variable from the inside of a matrix element, of which `bytes` may be only the
/// beginning. Nothing if it is damaged. An element without a name has no shape.
std::optional<MatVariable> variable_of(std::string_view bytes) {
  const auto flags = tag_at(bytes, 0);
  if (!flags || flags->type != kUint32 || flags->size != 8 || bytes.size() < 16) return std::nullopt;
  const auto sizes = tag_at(bytes, flags->next);
  if (!sizes || sizes->type != kInt32 || sizes->size > 128 || sizes->data + sizes->size > bytes.size())
    return std::nullopt;
  MatVariable variable;
  variable.fault = class_fault(mat_word(bytes, flags->data));
  for (std::size_t k = 0; k + 4 <= sizes->size; k += 4)
    variable.shape.push_back(static_cast<std::int32_t>(mat_word(bytes, sizes->data + k)));
  const auto name = tag_at(bytes, sizes->next);
  if (!name || name->type != kInt8 || name->size > 64 || name->data + name->size > bytes.size())
    return std::nullopt;
  variable.name = bytes.substr(name->data, name->size);
  if (!variable.fault.empty()) return variable;
  const auto numbers = tag_at(bytes, name->next);
  if (!numbers) return std::nullopt;
  const auto type = stored_type(numbers->type);
  if (!type || numbers->size != numbers_in(variable.shape) * size_of(*type)) {
    variable.fault = "is damaged";
    return variable;
  }
  variable.type = *type;
  variable.data = numbers->data;
  return variable;
}

/// A variable behind zlib: only its head is uncompressed.
std::optional<MatVariable> compressed_variable(std::string_view in) {
  std::array<std::byte, kVariableHead> head{};
  Inflater inflater(in);
  const auto size = inflater.fill(head.data(), head.size());
  if (!size) return std::nullopt;
  const std::string_view bytes(reinterpret_cast<const char*>(head.data()), *size);
  const auto tag = tag_at(bytes, 0);
  if (!tag || tag->type != kMatrix || tag->data != kTag) return std::nullopt;
  auto variable = variable_of(bytes.substr(kTag));
  if (!variable) return std::nullopt;
  variable->data += kTag;
  variable->compressed = in;
  variable->element_bytes = kTag + tag->size;
  return variable;
}

std::optional<MatVariable> plain_variable(std::string_view bytes, const Tag& tag) {
  auto variable = variable_of(bytes.substr(tag.data, tag.size));
  if (!variable) return std::nullopt;
  const std::size_t end = variable->data + numbers_in(variable->shape) * size_of(variable->type);
  if (variable->fault.empty() && end > tag.size) variable->fault = "is damaged";
  variable->data += tag.data;
  return variable;
}

}  // namespace

bool is_level5(std::string_view bytes) {
  return bytes.size() >= kFileHead && bytes.starts_with("MATLAB 5.0") && bytes.substr(126, 2) == "IM";
}

Result<std::vector<MatVariable>> level5_variables(std::string_view bytes, const std::string& file) {
  std::vector<MatVariable> all;
  for (std::size_t at = kFileHead; at < bytes.size();) {
    const auto tag = tag_at(bytes, at);
    if (!tag || tag->size > bytes.size() - tag->data) return no_matrix(file, "a variable is cut off");
    std::optional<MatVariable> variable;
    if (tag->type == kCompressed)
      variable = compressed_variable(bytes.substr(tag->data, tag->size));
    else if (tag->type == kMatrix)
      variable = plain_variable(bytes, *tag);
    if (!variable) return no_matrix(file, "a variable is damaged");
    all.push_back(*std::move(variable));
    // Compressed elements are not padded.
    at = tag->type == kCompressed ? tag->data + tag->size : tag->next;
  }
  return all;
}

Result<std::vector<std::byte>> uncompressed(const MatVariable& variable, const std::string& file) {
  // zlib makes at most 1,032 bytes of one.
  constexpr std::size_t kMostRatio = 1032, kSlack = 4096, kMostElement = std::size_t{1} << 31;
  if (variable.element_bytes > kMostElement ||
      variable.element_bytes / kMostRatio > variable.compressed.size() + kSlack)
    return no_matrix(file,
                     fmt::format("{} claims more bytes than its compressed ones can hold", variable.name));
  std::vector<std::byte> bytes(variable.element_bytes + 1);
  Inflater inflater(variable.compressed);
  const auto size = inflater.fill(bytes.data(), bytes.size());
  if (!size || *size != variable.element_bytes)
    return no_matrix(file, fmt::format("{} is damaged", variable.name));
  bytes.pop_back();
  return bytes;
}

}  // namespace symrig::sim
