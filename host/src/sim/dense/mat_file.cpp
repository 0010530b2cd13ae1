// SPDX-License-Identifier: Apache-2.0

#include "sim/dense/raw_matrix.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <zlib.h>

namespace symrig::sim {

namespace {

/// A variable of a MAT file. Its numbers lie in the file, or are compressed there.
struct MatVariable {
  std::string name;
  std::vector<std::int64_t> shape;
  std::string fault = {};             ///< why its numbers cannot be a T: "is complex"; empty: they can
  NumberType type = NumberType::f64;  ///< of the numbers, if they are not compressed
  std::size_t data = 0;               ///< where they begin in the file, or in the uncompressed element
  std::string_view compressed = {};   ///< its element; empty: it is not compressed
  std::size_t element_bytes = 0;      ///< of the uncompressed element
};

/// The little-endian number at a place that is inside the bytes.
std::uint32_t mat_word(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

/// Of sizes that are no matrix: more than any file holds.
std::uint64_t numbers_in(const std::vector<std::int64_t>& shape) {
  std::uint64_t count = 1;
  for (const std::int64_t size : shape) {
    if (size < 0 || size > (std::int64_t{1} << 31) || count > (std::uint64_t{1} << 40))
      return ~std::uint64_t{0} / 16;
    count *= static_cast<std::uint64_t>(size);
  }
  return count;
}

constexpr std::size_t kHeadBytes = 20;  // type, rows, columns, imaginary part, length of the name
constexpr std::uint32_t kLongestName = 256;

/// P of the type MOPT (M: byte order, O: 0, P: numbers, T: full, text or sparse).
std::optional<NumberType> level4_type(std::uint32_t type) {
  constexpr std::array kTypes{NumberType::f64, NumberType::f32, NumberType::i32,
                              NumberType::i16, NumberType::u16, NumberType::u8};
  const std::uint32_t p = type / 10 % 10;
  if (type >= 60 || p >= kTypes.size()) return std::nullopt;
  return kTypes[p];
}

bool is_level4(std::string_view bytes) {
  return bytes.size() > kHeadBytes && level4_type(mat_word(bytes, 0)) && mat_word(bytes, 0) % 10 <= 2 &&
         mat_word(bytes, 12) <= 1 && mat_word(bytes, 16) >= 1 && mat_word(bytes, 16) <= kLongestName;
}

/// All variables of a MAT file of level 4.  fails: bad_format.
Result<std::vector<MatVariable>> level4_variables(std::string_view bytes, const std::string& file) {
  std::vector<MatVariable> all;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::string_view rest = bytes.substr(at);
    if (!is_level4(rest)) return no_matrix(file, "the head of a variable is damaged");
    const std::uint64_t rows = mat_word(rest, 4), cols = mat_word(rest, 8), name = mat_word(rest, 16);
    const NumberType type = *level4_type(mat_word(rest, 0));
    const std::uint64_t parts = 1 + mat_word(rest, 12), left = rest.size() - kHeadBytes;
    if (name > left || (rows > 0 && cols > (left - name) / rows / parts / size_of(type)))
      return no_matrix(file, "a variable is cut off");
    MatVariable variable{.name = std::string(rest.substr(kHeadBytes, name - 1)),
                         .shape = {static_cast<std::int64_t>(rows), static_cast<std::int64_t>(cols)},
                         .type = type,
                         .data = at + kHeadBytes + name};
    if (parts > 1) variable.fault = "is complex";
    if (mat_word(rest, 0) % 10 != 0) variable.fault = "is text or sparse";
    at = variable.data + rows * cols * parts * size_of(type);
    all.push_back(std::move(variable));
  }
  return all;
}

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

bool is_level5(std::string_view bytes) {
  return bytes.size() >= kFileHead && bytes.starts_with("MATLAB 5.0") && bytes.substr(126, 2) == "IM";
}

/// All variables of a MAT file of level 5. Compressed ones are uncompressed as far as their heads reach.
/// fails: bad_format.
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

/// The uncompressed element of a variable.  fails: bad_format (damaged; longer or shorter than it states).
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

/// The variable T, or the only one with the shape of a matrix.
Result<MatVariable> matrix_among(const std::vector<MatVariable>& all, const std::string& file) {
  const auto named = std::find_if(all.begin(), all.end(), [](const auto& one) { return one.name == "T"; });
  if (named != all.end()) return *named;
  std::vector<MatVariable> found;
  std::copy_if(all.begin(), all.end(), std::back_inserter(found),
               [](const auto& one) { return is_matrix_shape(one.shape) && numbers_in(one.shape) > 1; });
  if (found.size() == 1) return found.front();
  return no_matrix(file,
                   found.empty() ? "it holds no matrix" : "it holds several matrices, none of the name T");
}

/// The variable with its numbers.
Result<RawMatrix> numbers_of(const MatVariable& variable, std::vector<std::byte> bytes,
                             const std::string& file) {
  if (!variable.fault.empty()) return no_matrix(file, fmt::format("{} {}", variable.name, variable.fault));
  if (!variable.compressed.empty()) {
    SYMRIG_TRY(bytes, uncompressed(variable, file));
  }
  return RawMatrix{.bytes = std::move(bytes),
                   .data = variable.data,
                   .type = variable.type,
                   .shape = variable.shape,
                   .columns_first = true,
                   .matlab_pixels = true};
}

/// A variable of a few numbers; the file itself is not copied.
Result<RawMatrix> small_variable(MatVariable variable, const std::vector<std::byte>& bytes,
                                 const std::string& file) {
  if (!variable.compressed.empty() || !variable.fault.empty()) return numbers_of(variable, {}, file);
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(std::exchange(variable.data, 0));
  const std::uint64_t size = numbers_in(variable.shape) * size_of(variable.type);
  return numbers_of(variable, {begin, begin + static_cast<std::ptrdiff_t>(size)}, file);
}

/// The size that light_size or photo_size states; 0x0: the file has no such variable.
Result<Grid> stated_grid(const std::vector<MatVariable>& all, const std::vector<std::byte>& bytes,
                         const std::string& file) {
  for (const MatVariable& one : all) {
    if ((one.name != "light_size" && one.name != "photo_size") || numbers_in(one.shape) != 2) continue;
    SYMRIG_TRY(const RawMatrix size, small_variable(one, bytes, file));
    auto stated = stated_size(size.at(0), size.at(1), one.name);
    if (!stated) return no_matrix(file, stated.error().what);
    return stated;
  }
  return Grid{};
}

}  // namespace

bool is_mat(std::string_view bytes) {
  return is_level5(bytes) || is_level4(bytes);
}

Result<RawMatrix> read_mat(std::vector<std::byte> bytes, const std::string& file) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  SYMRIG_TRY(const std::vector<MatVariable> all,
             is_level5(text) ? level5_variables(text, file) : level4_variables(text, file));
  SYMRIG_TRY(const MatVariable matrix, matrix_among(all, file));
  SYMRIG_TRY(const Grid grid, stated_grid(all, bytes, file));
  SYMRIG_TRY(RawMatrix raw, numbers_of(matrix, std::move(bytes), file));
  raw.grid = grid;
  return raw;
}

}  // namespace symrig::sim
