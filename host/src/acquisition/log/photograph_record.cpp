// SPDX-License-Identifier: Apache-2.0
#include "acquisition/log/photograph_record.hpp"

#include "acquisition/log/packed_photograph.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

namespace symrig::acquisition {
namespace {

static_assert(std::endian::native == std::endian::little, "records are little-endian and copied as they are");
static_assert(sizeof(float) == 4 && sizeof(double) == 8);

constexpr std::uint32_t kBinary = 0;        ///< a bit a pixel
constexpr std::uint32_t kGrey = 1;          ///< a float a pixel
constexpr std::uint32_t kBudgeted = 0x100;  ///< beside the kind: a capture with a budget took it
constexpr std::uint32_t kNoteShift = 16;    ///< and Expectation::budget_note()
constexpr std::uint32_t kNote = 0xFFU << kNoteShift;

std::uint32_t budget_bits(std::int32_t budget_note) {
  return kBudgeted | ((static_cast<std::uint32_t>(budget_note) << kNoteShift) & kNote);
}

/// The fixed front of a record.
struct RecordFront {
  std::int64_t photographs, frames;
  double rig_seconds, simulate_seconds, merge_seconds;
  std::uint32_t pattern_kind;
  std::uint32_t left;  // photographs of the same run that follow
};
static_assert(sizeof(RecordFront) == 48);

/// Offsets of the parts, in bytes.
struct Layout {
  std::size_t pixels, values;  // of the pattern; of the photograph, all channels
  std::size_t mean, variance, valid, end;

  Layout(const PhotographShape& shape, std::uint32_t kind)
      : pixels(static_cast<std::size_t>(shape.grid.size())),
        values(static_cast<std::size_t>(shape.camera.size()) * static_cast<std::size_t>(shape.channels)),
        mean(sizeof(RecordFront) + padded(kind == kBinary ? (pixels + 7) / 8 : 4 * pixels)),
        variance(mean + padded(4 * values)),
        valid(variance + padded(4 * values)),
        end(shape.steps ? mean + packed_bytes(shape.camera, shape.channels)
                        : valid + padded((values + 7) / 8)) {}
};

bool is_binary(std::span<const float> values) {
  constexpr auto kZero = std::bit_cast<std::uint32_t>(0.F), kOne = std::bit_cast<std::uint32_t>(1.F);
  return std::all_of(values.begin(), values.end(), [](float v) {
    const auto bits = std::bit_cast<std::uint32_t>(v);
    return bits == kZero || bits == kOne;
  });
}

/// Puts parts one behind the other, each padded with zeros.
class Writer {
 public:
  explicit Writer(std::byte* out) : out_(out) {}

  void bytes(const void* from, std::size_t count) {
    std::memcpy(out_, from, count);
    pad(count);
  }
  /// Bit i of byte i / 8, from the lowest: whether value i is not 0.
  template <class T>
  void bits(std::span<const T> values) {
    const std::size_t whole = values.size() / 8;
    for (std::size_t i = 0; i < whole; ++i) out_[i] = byte_of(values.subspan(8 * i, 8));
    if (whole * 8 < values.size()) out_[whole] = byte_of(values.subspan(8 * whole));
    pad((values.size() + 7) / 8);
  }

 private:
  template <class T>
  static std::byte byte_of(std::span<const T> values) {
    unsigned bits = 0;
    for (std::size_t j = 0; j < values.size(); ++j) bits |= (values[j] != T{0} ? 1U : 0U) << j;
    return static_cast<std::byte>(bits);
  }
  void pad(std::size_t count) {
    std::memset(out_ + count, 0, padded(count) - count);
    out_ += padded(count);
  }

  std::byte* out_;
};

template <class T>
void unpack(const std::byte* bits, std::span<T> values) {
  for (std::size_t first = 0; first < values.size(); first += 8) {
    const auto byte = std::to_integer<unsigned>(bits[first / 8]);
    const auto few = values.subspan(first, std::min<std::size_t>(8, values.size() - first));
    for (std::size_t j = 0; j < few.size(); ++j) few[j] = static_cast<T>((byte >> j) & 1U);
  }
}

void get(const std::byte* bytes, std::span<float> values) {
  std::memcpy(values.data(), bytes, values.size_bytes());
}

RecordFront front_of(std::span<const std::byte> record) {
  RecordFront front;
  std::memcpy(&front, record.data(), sizeof front);
  return front;
}

std::uint32_t kind_of(std::span<const std::byte> record) {
  return front_of(record).pattern_kind & ~(kBudgeted | kNote);
}

template <class T>
bool has_shape(const Image<T>& image, Grid grid, int channels) {
  return image.grid() == grid && image.channels() == channels;
}

Error misfit(const char* what, Grid grid, int channels, Grid logged) {
  return {ErrorCode::size_mismatch,
          std::string(what) + " is " + to_string(grid) + " with " + std::to_string(channels) +
              " channels, the log's are " + to_string(logged),
          "log the photographs of one rig only"};
}

Result<void> check_one(const PhotographShape& shape, const Pattern& pattern, const Radiance& photograph) {
  if (!has_shape(pattern, shape.grid, 1))
    return misfit("a pattern", pattern.grid(), pattern.channels(), shape.grid);
  const auto fits = [&](const auto& image) { return has_shape(image, shape.camera, shape.channels); };
  if (!fits(photograph.mean) || !fits(photograph.variance) || !fits(photograph.valid))
    return misfit("a photograph", photograph.mean.grid(), photograph.mean.channels(), shape.camera);
  return {};
}

}  // namespace

Result<void> check_run(const PhotographShape& shape, std::span<const Pattern> patterns,
                       std::span<const Radiance> photographs) {
  if (patterns.size() != photographs.size())
    return Error{ErrorCode::size_mismatch,
                 std::to_string(patterns.size()) + " patterns came with " +
                     std::to_string(photographs.size()) + " photographs",
                 "log one for each"};
  for (std::size_t k = 0; k < patterns.size(); ++k)
    SYMRIG_CHECK(check_one(shape, patterns[k], photographs[k]));
  return {};
}

void encode_record(const PhotographShape& shape, const Pattern& pattern, const Radiance& photograph,
                   const RecordNote& note, Record& record) {
  const std::uint32_t kind = is_binary(pattern.values()) ? kBinary : kGrey;
  const Layout at(shape, kind);
  record.resize(at.end);
  const RecordFront front{note.spent.photographs,
                          note.spent.frames,
                          note.spent.rig_seconds,
                          note.spent.simulate_seconds,
                          note.spent.merge_seconds,
                          kind | (note.budgeted ? budget_bits(note.budget_note) : 0),
                          note.left};
  Writer writer(record.data());
  writer.bytes(&front, sizeof front);
  if (kind == kBinary)
    writer.bits(pattern.values());
  else
    writer.bytes(pattern.values().data(), pattern.values().size_bytes());
  if (shape.steps) return pack(photograph, *shape.steps, record.data() + at.mean);
  writer.bytes(photograph.mean.values().data(), photograph.mean.values().size_bytes());
  writer.bytes(photograph.variance.values().data(), photograph.variance.values().size_bytes());
  writer.bits(photograph.valid.values());
}

RecordSizes record_sizes(const PhotographShape& shape) {
  return {Layout(shape, kBinary).end, Layout(shape, kGrey).end};
}

bool record_fits(const PhotographShape& shape, std::span<const std::byte> record) {
  if (record.size() < sizeof(RecordFront)) return false;
  const std::uint32_t kind = kind_of(record);
  return (kind == kBinary || kind == kGrey) && record.size() == Layout(shape, kind).end;
}

std::size_t pattern_end(const PhotographShape& shape, std::size_t record_bytes) {
  const Layout binary(shape, kBinary);  // on tiny grids both kinds have one size, and then one layout
  return record_bytes == binary.end ? binary.mean : Layout(shape, kGrey).mean;
}

std::size_t packed_begin(const PhotographShape& shape, std::size_t record_bytes) {
  return pattern_end(shape, record_bytes);
}

std::size_t checked_bytes(const PhotographShape& shape, std::size_t record_bytes) {
  if (!shape.steps) return record_bytes;
  return packed_begin(shape, record_bytes) + packed_front_bytes(shape.camera);
}

bool strips_sound(const PhotographShape& shape, std::span<const std::byte> record) {
  if (!shape.steps) return true;
  const auto packed = record.subspan(packed_begin(shape, record.size()));
  for (int strip = 0; strip < strips_of(shape.camera); ++strip)
    if (!strip_sound(packed, shape.camera, shape.channels, strip)) return false;
  return true;
}

std::uint32_t record_left(std::span<const std::byte> record) {
  return front_of(record).left;
}

bool record_budgeted(std::span<const std::byte> record) {
  return (front_of(record).pattern_kind & kBudgeted) != 0;
}

std::int32_t record_budget_note(std::span<const std::byte> record) {
  return static_cast<std::int32_t>((front_of(record).pattern_kind & kNote) >> kNoteShift);
}

ProbeCost record_spent(std::span<const std::byte> record) {
  const RecordFront front = front_of(record);
  return {front.photographs, front.frames, front.rig_seconds, front.simulate_seconds, front.merge_seconds};
}

namespace {

void get_pattern(const PhotographShape& shape, std::span<const std::byte> record, Pattern& to) {
  if (!has_shape(to, shape.grid, 1)) to = Pattern(shape.grid);
  const std::byte* bytes = record.data() + sizeof(RecordFront);
  if (kind_of(record) == kBinary)
    unpack(bytes, to.values());
  else
    get(bytes, to.values());
}

void get_photograph(const PhotographShape& shape, std::span<const std::byte> record, Radiance& to) {
  if (!has_shape(to.mean, shape.camera, shape.channels)) to.mean = Image<float>(shape.camera, shape.channels);
  if (!has_shape(to.variance, shape.camera, shape.channels))
    to.variance = Image<float>(shape.camera, shape.channels);
  if (!has_shape(to.valid, shape.camera, shape.channels))
    to.valid = Image<std::uint8_t>(shape.camera, shape.channels);
  const Layout at(shape, kind_of(record));
  if (shape.steps) {
    for (int strip = 0; strip < strips_of(shape.camera); ++strip)
      unpack_strip(record.subspan(at.mean), *shape.steps, strip, to);
    return;
  }
  get(record.data() + at.mean, to.mean.values());
  get(record.data() + at.variance, to.variance.values());
  unpack(record.data() + at.valid, to.valid.values());
}

}  // namespace

Pattern record_pattern(const PhotographShape& shape, std::span<const std::byte> record) {
  Pattern pattern;
  get_pattern(shape, record, pattern);
  return pattern;
}

Radiance record_photograph(const PhotographShape& shape, std::span<const std::byte> record) {
  Radiance photograph;
  get_photograph(shape, record, photograph);
  return photograph;
}

void read_record(const PhotographShape& shape, std::span<const std::byte> record, LoggedPhotograph& to) {
  get_pattern(shape, record, to.pattern);
  get_photograph(shape, record, to.photograph);
}

Error no_such_photograph(std::int64_t k, std::int64_t size) {
  return {ErrorCode::bad_argument,
          "the log has no photograph " + std::to_string(k) + ", it has " + std::to_string(size),
          "numbers count from 0"};
}

}  // namespace symrig::acquisition
