// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/dataset.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace symrig::tensor::h5 {
namespace {

/// The value of places that were never written. Messages differ in what comes before its size.
std::vector<std::uint8_t> fill_of(const Header& header, std::uint32_t size) {
  if (const Message* const message = header.find(MessageType::fill); message != nullptr) {
    Bytes bytes(message->bytes);
    const unsigned version = bytes.byte(), flags = bytes.byte();
    bool stated = (flags & 0x20U) != 0;
    if (version < 3) {
      bytes.skip(1);  // when it is written
      stated = bytes.byte() != 0;
    }
    const auto value = stated ? bytes.take(bytes.number(4)) : std::span<const std::uint8_t>();
    if (value.size() == size) return {value.begin(), value.end()};
  } else if (const Message* const old = header.find(MessageType::old_fill); old != nullptr) {
    Bytes bytes(old->bytes);
    const auto value = bytes.take(bytes.number(4));
    if (value.size() == size) return {value.begin(), value.end()};
  }
  return {};
}

constexpr std::uint64_t kMostChunkBytes = std::uint64_t{1} << 32;  // of the format

/// Copies what a chunk has of some rows into the caller's values.
class ChunkCopy {
 public:
  ChunkCopy(const Datatype& type, const Shape& size, const Shape& chunk, const Conversion& conversion,
            std::uint64_t first, std::uint64_t rows, void* to)
      : type_(type),
        size_(size),
        chunk_(chunk),
        conversion_(conversion),
        first_(first),
        last_(first + rows),
        to_(static_cast<std::uint8_t*>(to)) {}

  void copy(const Shape& place, const std::uint8_t* from) const { copy_from(0, place, from, 0); }

 private:
  /// at: the values before it in the caller's memory.
  void copy_from(std::size_t dimension, const Shape& place, const std::uint8_t* from,
                 std::uint64_t at) const {
    const std::uint64_t begin = place[dimension] * chunk_[dimension];
    const std::uint64_t low = dimension == 0 ? std::max(begin, first_) : begin;
    const std::uint64_t high = std::min(begin + chunk_[dimension], dimension == 0 ? last_ : size_[dimension]);
    const std::uint64_t origin = dimension == 0 ? first_ : 0;
    std::uint64_t stride = type_.size;  // of this dimension in the chunk
    for (std::size_t k = dimension + 1; k < chunk_.size(); ++k) stride *= chunk_[k];
    if (low >= high) return;
    const std::uint64_t row = at * (dimension == 0 ? 1 : size_[dimension]);
    if (dimension + 1 == chunk_.size()) {
      conversion_.run(type_, from + (low - begin) * stride, high - low,
                      to_ + (row + low - origin) * conversion_.size);
      return;
    }
    for (std::uint64_t k = low; k < high; ++k)
      copy_from(dimension + 1, place, from + (k - begin) * stride, row + k - origin);
  }

  const Datatype& type_;
  const Shape& size_;
  const Shape& chunk_;
  const Conversion& conversion_;
  std::uint64_t first_, last_;
  std::uint8_t* to_;
};

/// A message that every dataset has.
Result<std::vector<std::uint8_t>> needed(const Object& object, MessageType type) {
  const Message* const message = object.header().find(type);
  if (message == nullptr) return Error{ErrorCode::bad_format, "is no dataset"};
  return content_of(object.file(), *message);
}

}  // namespace

Result<Dataset> Dataset::open(const Object& object) {
  Dataset all(object);
  SYMRIG_TRY(const auto space, needed(object, MessageType::space));
  SYMRIG_TRY(all.space_, parse_space(object.file(), space));
  SYMRIG_TRY(const auto type, needed(object, MessageType::type));
  SYMRIG_TRY(all.type_, parse_type(type));
  SYMRIG_TRY(const auto layout, needed(object, MessageType::layout));
  if (object.header().find(MessageType::external_files) != nullptr)
    return Error{ErrorCode::bad_format, "has its data in another file", "copy them into this file"};
  SYMRIG_TRY(all.layout_, parse_layout(object.file(), layout, all.space_));
  if (const Message* const filters = object.header().find(MessageType::filters); filters != nullptr) {
    SYMRIG_TRY(const auto message, content_of(object.file(), *filters));
    SYMRIG_TRY(all.filters_, Filters::parse(message));
  }
  all.fill_ = fill_of(object.header(), all.type_.size);
  return all;
}

std::uint64_t Dataset::most_bytes() const {
  constexpr std::uint64_t kMostRatio = 1100, kSlack = 1 << 16;  // of deflate: 1032
  const std::uint64_t file = object_.file().size();
  return filters_.compress() ? kMostRatio * (file + kSlack) : file;
}

Result<void> Dataset::read(std::uint64_t first, std::uint64_t rows, const Conversion& conversion, void* to,
                           std::uint64_t values) const {
  if (const std::string_view problem = problem_of(type_, conversion); !problem.empty())
    return Error{ErrorCode::bad_format, std::string(problem)};
  const std::uint64_t all_rows = space_.size.empty() ? 1 : space_.size.front();
  const std::uint64_t all = space_.empty ? 0 : count(space_.size), row = all_rows == 0 ? 0 : all / all_rows;
  if (first > all_rows || rows > all_rows - first || all == ~std::uint64_t{0} || rows * row != values)
    return Error{ErrorCode::bad_format, "has another shape than it should have"};
  if (values == 0) return {};
  const Part part{first, rows, row, conversion, static_cast<std::uint8_t*>(to)};
  switch (layout_.kind) {
    case Layout::Kind::compact:
      return read_compact(part);
    case Layout::Kind::contiguous:
      return read_contiguous(part);
    case Layout::Kind::chunked:
      return read_chunks(part);
  }
  return {};
}

void Dataset::fill(const Part& part) const {
  const std::size_t size = part.conversion.size;
  std::array<std::uint8_t, sizeof(double)> value{};
  if (!fill_.empty()) part.conversion.run(type_, fill_.data(), 1, value.data());
  std::uint8_t* to = part.to;
  for (std::uint64_t k = 0; k < part.rows * part.row; ++k, to += size) std::memcpy(to, value.data(), size);
}

Result<void> Dataset::read_compact(const Part& part) const {
  const std::uint64_t row_bytes = part.row * type_.size;
  if ((part.first + part.rows) * row_bytes > layout_.values.size())
    return Error{ErrorCode::bad_format, "is damaged: it has too few values"};
  part.conversion.run(type_, layout_.values.data() + part.first * row_bytes, part.rows * part.row, part.to);
  return {};
}

Result<void> Dataset::read_contiguous(const Part& part) const {
  constexpr std::uint64_t kTogether = 1 << 16;  // values; memory of the processor's cache
  if (layout_.at == kUndefined) {
    fill(part);
    return {};
  }
  std::uint64_t end = 0;
  if (__builtin_mul_overflow((part.first + part.rows) * part.row, type_.size, &end) || end > layout_.bytes)
    return Error{ErrorCode::bad_format, "is damaged: it has too few values"};
  const std::uint64_t begin = part.first * part.row, count = part.rows * part.row;
  std::vector<std::uint8_t> bytes;
  for (std::uint64_t done = 0; done < count; done += kTogether) {
    const std::uint64_t now = std::min(count - done, kTogether);
    bytes.resize(now * type_.size);
    SYMRIG_CHECK(object_.file().read(layout_.at + (begin + done) * type_.size, bytes));
    part.conversion.run(type_, bytes.data(), now, part.to + done * part.conversion.size);
  }
  return {};
}

Result<void> Dataset::read_chunks(const Part& part) const {
  std::uint64_t chunk_bytes = count(layout_.chunk), all_bytes = 0;
  if (__builtin_mul_overflow(chunk_bytes, type_.size, &chunk_bytes) || chunk_bytes > kMostChunkBytes)
    return Error{ErrorCode::bad_format, "has chunks of an impossible size"};
  const ChunkGrid grid(space_.size, layout_.chunk);
  const std::uint64_t height = layout_.chunk.front();
  const std::uint64_t first = part.first / height * grid.of_a_row();
  const std::uint64_t last = ((part.first + part.rows - 1) / height + 1) * grid.of_a_row();
  SYMRIG_TRY(const auto chunks,
             chunks_of(object_.file(), layout_, space_, chunk_bytes, filters_.any(), first, last));
  // Chunks that reach over the edge are larger than what they hold, but not many times.
  const std::uint64_t most = 64 * part.rows * part.row * type_.size + (std::uint64_t{1} << 28);
  if (__builtin_mul_overflow(chunks.size(), chunk_bytes, &all_bytes) || all_bytes > most)
    return Error{ErrorCode::bad_format, "has chunks that are many times larger than what they hold"};
  if (chunks.size() < last - first) fill(part);
  const ChunkCopy copy(type_, space_.size, layout_.chunk, part.conversion, part.first, part.rows, part.to);
  std::vector<std::uint8_t> bytes;
  for (const StoredChunk& chunk : chunks) {
    const Shape place = grid.place(chunk.number);
    SYMRIG_CHECK(read_chunk(chunk, place, chunk_bytes, bytes));
    copy.copy(place, bytes.data());
  }
  return {};
}

Result<void> Dataset::read_chunk(const StoredChunk& chunk, const Shape& place, std::uint64_t size,
                                 std::vector<std::uint8_t>& bytes) const {
  bool edge = false;
  for (std::size_t k = 0; k < place.size(); ++k)
    edge = edge || (place[k] + 1) * layout_.chunk[k] > space_.size[k];
  if (chunk.bytes > object_.file().size())
    return Error{ErrorCode::bad_format, "is damaged: a chunk is too large"};
  bytes.resize(static_cast<std::size_t>(chunk.bytes));
  SYMRIG_CHECK(object_.file().read(chunk.at, bytes));
  return filters_.undo(bytes, size, edge && layout_.plain_edges ? ~std::uint32_t{0} : chunk.skipped);
}

}  // namespace symrig::tensor::h5
