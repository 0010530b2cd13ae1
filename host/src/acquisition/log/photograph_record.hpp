// SPDX-License-Identifier: Apache-2.0
// One photograph of a log as bytes (docs/photograph-log.md). Little-endian, every part padded to 8 bytes.
#pragma once

#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// What the patterns and photographs of a log look like.
struct PhotographShape {
  Grid grid;  ///< of patterns
  int channels = 1;
  Grid camera;  ///< of photographs
  /// The steps of packed photographs (packed_photograph.hpp); none: photographs are floats.
  std::shared_ptr<const Image<float>> steps = {};
};

using Record = std::vector<std::byte>;

/// Whether a run can be logged.  fails: size_mismatch.
Result<void> check_run(const PhotographShape& shape, std::span<const Pattern> patterns,
                       std::span<const Radiance> photographs);

/// What a record says besides the photograph.
struct RecordNote {
  ProbeCost spent;
  std::uint32_t left = 0;        ///< photographs of the same run that follow
  bool budgeted = false;         ///< PhotographLog::budgeted
  std::int32_t budget_note = 0;  ///< PhotographLog::budget_note; 0 to 255, and 0 without a budget
};

/// The photograph as bytes; both must have passed check_run with this shape.
/// record is overwritten: a caller who keeps it spares the system from handing out the memory each time.
void encode_record(const PhotographShape& shape, const Pattern& pattern, const Radiance& photograph,
                   const RecordNote& note, Record& record);

/// Bytes of a record whose pattern is binary, and of one whose pattern is grey: there are no others.
struct RecordSizes {
  std::size_t binary = 0;
  std::size_t grey = 0;
};
RecordSizes record_sizes(const PhotographShape& shape);

/// How many bytes at the front of a record its checksum covers: all, but for the strips of a packed
/// photograph, which have their own.
std::size_t checked_bytes(const PhotographShape& shape, std::size_t record_bytes);
/// True if all strips are as they were written; always true of floats.
bool strips_sound(const PhotographShape& shape, std::span<const std::byte> record);
/// Where a packed photograph begins in a record.
std::size_t packed_begin(const PhotographShape& shape, std::size_t record_bytes);

/// True if the record has a size and a pattern kind that the shape allows: the parts below may then be read.
bool record_fits(const PhotographShape& shape, std::span<const std::byte> record);

/// How many bytes of a record of that size hold all that record_spent and record_pattern look at.
std::size_t pattern_end(const PhotographShape& shape, std::size_t record_bytes);

/// How many photographs of the same run follow.
std::uint32_t record_left(std::span<const std::byte> record);
bool record_budgeted(std::span<const std::byte> record);
std::int32_t record_budget_note(std::span<const std::byte> record);
ProbeCost record_spent(std::span<const std::byte> record);
Pattern record_pattern(const PhotographShape& shape, std::span<const std::byte> record);
Radiance record_photograph(const PhotographShape& shape, std::span<const std::byte> record);
/// The same into memory that is used again.
void read_record(const PhotographShape& shape, std::span<const std::byte> record, LoggedPhotograph& to);

/// The error of every log for a number that it does not have.
Error no_such_photograph(std::int64_t k, std::int64_t size);

}  // namespace symrig::acquisition
