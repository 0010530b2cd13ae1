// SPDX-License-Identifier: Apache-2.0
#include "acquisition/log/appended_file.hpp"
#include "acquisition/log/packed_photograph.hpp"
#include "acquisition/log/photograph_record.hpp"
#include "symrig/acquisition/internal/fast_crc32c.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <system_error>
#include <utility>

namespace symrig {
namespace {

namespace fs = std::filesystem;
using acquisition::AppendedFile;
using acquisition::HeadState;
using acquisition::PhotographShape;
using acquisition::Record;

constexpr std::uint32_t kRecordMagic = 0x544F4850;  // "PHOT"

/// Before every record.
struct RecordFrame {
  std::uint32_t magic;
  std::uint32_t crc;  ///< of the record
  std::uint64_t bytes;
};
static_assert(sizeof(RecordFrame) == 16);

/// When to wait for the disk: every five seconds, or less often where that would take more than a twentieth
/// of the time.
class SyncTimer {
 public:
  bool due() const { return next_.passed(); }
  void took(Nanoseconds time) { next_ = Deadline(std::max<Nanoseconds>(kPeriod, 20 * time)); }

 private:
  static constexpr std::chrono::seconds kPeriod{5};
  Deadline next_{kPeriod};
};

class FileLog final : public PhotographLog {
 public:
  FileLog(AppendedFile file, const LogIdentity& identity, HeadState head)
      : FileLog(std::move(file), identity, head, acquisition::log_head(identity).size()) {}
  /// first: where its photographs begin.
  FileLog(AppendedFile file, const LogIdentity& identity, HeadState head, std::uint64_t first)
      : file_(std::move(file)),
        identity_(identity),
        shape_{identity.grid, identity.channels, identity.camera(), identity.steps},
        head_(head),
        end_(first) {}

  /// Finds the photographs behind the head. Changes nothing.
  Result<void> find_photographs();

  Grid grid() const override { return shape_.grid; }
  Grid camera_grid() const override { return shape_.camera; }
  int channels() const override { return shape_.channels; }
  std::int64_t size() const override { return std::ssize(records_); }
  Result<void> append_run(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
                          const ProbeCost& spent) override;
  Result<Pattern> pattern(std::int64_t k) const override;
  Result<Radiance> photograph(std::int64_t k) const override;
  Result<void> read(std::int64_t k, LoggedPhotograph& to) const override;
  Result<void> rows(std::int64_t k, int strip, Radiance& to) const override;
  Radiance kept(Radiance photograph) const override;
  Result<ProbeCost> spent(std::int64_t k) const override;
  bool budgeted(std::int64_t k) const override { return place(k).budgeted; }
  void note_budget(std::int32_t note) override { budget_note_ = note; }
  std::int32_t budget_note(std::int64_t k) const override { return place(k).budget_note; }
  Result<void> forget(std::int64_t first, std::int64_t differs) override;

 private:
  struct Place {
    std::uint64_t offset;  // of the record, behind its front
    std::uint64_t bytes;
    std::uint32_t crc;
    bool budgeted;
    std::int32_t budget_note;
  };
  static Place place_of(std::uint64_t offset, std::uint32_t crc, const Record& record) {
    return {offset, record.size(), crc, acquisition::record_budgeted(record),
            acquisition::record_budget_note(record)};
  }
  const Place& place(std::int64_t k) const { return records_[k]; }
  Result<void> check_forgetting(std::int64_t differs);
  Result<void> make_sound();
  Result<std::optional<Place>> sound_record(std::uint64_t offset, Record& buffer) const;
  Result<void> append_record(const Record& record);
  Result<void> sync();
  Result<Record> record(std::int64_t k, bool pattern_only) const;
  std::uint32_t crc_of(std::span<const std::byte> record) const {
    return acquisition::fast_crc32c(record.first(acquisition::checked_bytes(shape_, record.size())));
  }
  Error changed(std::int64_t k) const {
    return {ErrorCode::bad_format,
            file_.path().string() + ": photograph " + std::to_string(k) + " has changed since it was written",
            "check the disk"};
  }

  AppendedFile file_;
  LogIdentity identity_;
  PhotographShape shape_;
  HeadState head_;
  std::uint64_t end_;  ///< of the last photograph that counts; behind it the file may hold damaged bytes
  std::vector<Place> records_;
  std::int32_t budget_note_ = 0;
  Record written_;  // the last one; kept for its memory
  SyncTimer sync_timer_;
};

/// The record that begins at `offset`, if it is there and sound; buffer holds its bytes then.
Result<std::optional<FileLog::Place>> FileLog::sound_record(std::uint64_t offset, Record& buffer) const {
  RecordFrame front{};
  if (file_.size() - offset < sizeof front) return std::optional<Place>();
  SYMRIG_CHECK(file_.read(offset, std::as_writable_bytes(std::span(&front, 1))));
  const auto [binary, grey] = acquisition::record_sizes(shape_);
  const bool possible = front.magic == kRecordMagic && (front.bytes == binary || front.bytes == grey) &&
                        front.bytes <= file_.size() - offset - sizeof front;
  if (!possible) return std::optional<Place>();
  buffer.resize(front.bytes);
  SYMRIG_CHECK(file_.read(offset + sizeof front, buffer));
  const bool sound = crc_of(buffer) == front.crc && acquisition::record_fits(shape_, buffer) &&
                     acquisition::strips_sound(shape_, buffer);
  if (!sound) return std::optional<Place>();
  return std::optional(place_of(offset + sizeof front, front.crc, buffer));
}

Result<void> FileLog::find_photographs() {
  if (head_ == HeadState::torn) return {};
  std::uint64_t next = end_;
  std::vector<Place> run;
  Record buffer;
  for (;;) {
    SYMRIG_TRY(const std::optional<Place> record, sound_record(next, buffer));
    if (!record) break;
    run.push_back(*record);
    next = record->offset + record->bytes;
    if (acquisition::record_left(buffer) > 0) continue;
    records_.insert(records_.end(), run.begin(), run.end());
    run.clear();
    end_ = next;
  }
  return {};
}

/// Before the first photograph is added: nobody refuses this log any more.
Result<void> FileLog::make_sound() {
  if (head_ == HeadState::torn) {
    SYMRIG_CHECK(file_.cut(0));
    SYMRIG_CHECK(file_.append(acquisition::log_head(identity_)));
    head_ = HeadState::whole;
  }
  return end_ < file_.size() ? file_.cut(end_) : Result<void>();
}

Result<void> FileLog::check_forgetting(std::int64_t differs) {
  if (!budgeted(differs)) return PhotographLog::forget(differs, differs);
  SYMRIG_TRY(const ProbeCost all, spent(size() - 1));
  const LogBudget& budget = identity_.budget;
  const bool fewer = budget.photographs > 0 && budget.photographs < size();
  const bool sooner = budget.rig_seconds > 0 && budget.rig_seconds < all.rig_seconds;
  if (!fewer && !sooner) return {};
  return Error{ErrorCode::bad_format,
               file_.path().string() + " holds more than this budget allows: " + std::to_string(size()) +
                   " photographs of " + std::to_string(std::llround(std::ceil(all.rig_seconds))) +
                   " s on the rig's clock",
               "give a larger budget or none, or delete the log to begin anew"};
}

Result<void> FileLog::forget(std::int64_t first, std::int64_t differs) {
  SYMRIG_CHECK(check_forgetting(differs));
  records_.resize(first);
  end_ =
      first > 0 ? place(first - 1).offset + place(first - 1).bytes : acquisition::log_head(identity_).size();
  return {};
}

Result<void> FileLog::sync() {
  if (!sync_timer_.due()) return {};
  const Stopwatch watch;
  SYMRIG_CHECK(file_.sync());
  sync_timer_.took(watch.elapsed());
  return {};
}

Result<void> FileLog::append_run(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
                                 const ProbeCost& spent) {
  SYMRIG_CHECK(sync());
  SYMRIG_CHECK(acquisition::check_run(shape_, patterns, photographs));
  SYMRIG_CHECK(make_sound());
  const bool noted = identity_.budget.any && head_ == HeadState::whole;
  const std::size_t before = records_.size();
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    acquisition::encode_record(
        shape_, patterns[k], photographs[k],
        {spent, static_cast<std::uint32_t>(patterns.size() - k - 1), noted, budget_note_}, written_);
    auto written = append_record(written_);
    if (written) continue;
    records_.resize(before);
    SYMRIG_CHECK(file_.cut(end_));
    return written;
  }
  end_ = file_.size();
  return {};
}

Result<void> FileLog::append_record(const Record& record) {
  const RecordFrame front{kRecordMagic, crc_of(record), record.size()};
  const std::uint64_t begin = file_.size();
  SYMRIG_CHECK(file_.append(std::as_bytes(std::span(&front, 1)), record));
  records_.push_back(place_of(begin + sizeof front, front.crc, record));
  return {};
}

Result<Record> FileLog::record(std::int64_t k, bool pattern_only) const {
  if (k < 0 || k >= size()) return acquisition::no_such_photograph(k, size());
  const Place& place = this->place(k);
  const std::size_t bytes = place.bytes;
  Record record(pattern_only ? acquisition::pattern_end(shape_, bytes) : bytes);
  SYMRIG_CHECK(file_.read(place.offset, record));
  if (!pattern_only && (crc_of(record) != place.crc || !acquisition::strips_sound(shape_, record)))
    return changed(k);
  return record;
}

Result<Pattern> FileLog::pattern(std::int64_t k) const {
  SYMRIG_TRY(const Record bytes, record(k, true));
  return acquisition::record_pattern(shape_, bytes);
}

Result<Radiance> FileLog::photograph(std::int64_t k) const {
  SYMRIG_TRY(const Record bytes, record(k, false));
  return acquisition::record_photograph(shape_, bytes);
}

Result<void> FileLog::read(std::int64_t k, LoggedPhotograph& to) const {
  SYMRIG_TRY(const Record bytes, record(k, false));
  acquisition::read_record(shape_, bytes, to);
  return {};
}

Result<void> FileLog::rows(std::int64_t k, int strip, Radiance& to) const {
  if (!shape_.steps) return PhotographLog::rows(k, strip, to);
  if (k < 0 || k >= size()) return acquisition::no_such_photograph(k, size());
  const std::uint64_t packed = place(k).offset + acquisition::packed_begin(shape_, place(k).bytes);
  const auto at = acquisition::place_of_strip(shape_.camera, shape_.channels, strip);
  Record front(acquisition::packed_front_bytes(shape_.camera)), bytes(at.bytes);
  SYMRIG_CHECK(file_.read(packed, front));
  SYMRIG_CHECK(file_.read(packed + at.begin, bytes));
  acquisition::shape_of_strip(shape_.camera, shape_.channels, strip, to);
  if (!acquisition::unpack_strip_alone(front, bytes, *shape_.steps, strip, to)) return changed(k);
  return {};
}

Radiance FileLog::kept(Radiance photograph) const {
  if (!shape_.steps) return photograph;
  Record packed(acquisition::packed_bytes(shape_.camera, shape_.channels));
  acquisition::pack(photograph, *shape_.steps, packed.data());
  for (int strip = 0; strip < acquisition::strips_of(shape_.camera); ++strip)
    acquisition::unpack_strip(packed, *shape_.steps, strip, photograph);
  return photograph;
}

Result<ProbeCost> FileLog::spent(std::int64_t k) const {
  SYMRIG_TRY(const Record bytes, record(k, true));
  return acquisition::record_spent(bytes);
}

}  // namespace

std::int64_t bytes_of_photograph(const LogIdentity& identity) {
  const PhotographShape shape{identity.grid, identity.channels, identity.camera(), identity.steps};
  return static_cast<std::int64_t>(sizeof(RecordFrame) + acquisition::record_sizes(shape).binary);
}

Result<std::unique_ptr<PhotographLog>> create_photograph_log(const fs::path& path,
                                                             const LogIdentity& identity) {
  SYMRIG_TRY(AppendedFile file, AppendedFile::create(path));
  if (auto head = file.append(acquisition::log_head(identity)); !head) {
    std::error_code ignored;
    fs::remove(path, ignored);
    return head.error();
  }
  return std::unique_ptr<PhotographLog>(new FileLog(std::move(file), identity, HeadState::whole));
}

Result<std::unique_ptr<PhotographLog>> open_photograph_log(const fs::path& path,
                                                           const LogIdentity& identity) {
  SYMRIG_TRY(AppendedFile file, AppendedFile::open(path));
  SYMRIG_TRY(const HeadState head, acquisition::check_log_head(file, identity));
  auto log = std::make_unique<FileLog>(std::move(file), identity, head);
  SYMRIG_CHECK(log->find_photographs());
  return std::unique_ptr<PhotographLog>(std::move(log));
}

Result<bool> keeps_camera_photographs(const fs::path& path) {
  SYMRIG_TRY(AppendedFile file, AppendedFile::open_to_read(path));
  SYMRIG_TRY(const acquisition::FoundHead head, acquisition::read_log_head(file));
  return head.steps != nullptr;
}

Result<std::unique_ptr<const PhotographLog>> read_photograph_log(const fs::path& path) {
  SYMRIG_TRY(AppendedFile file, AppendedFile::open_to_read(path));
  SYMRIG_TRY(const acquisition::FoundHead head, acquisition::read_log_head(file));
  LogIdentity shape{head.grid, head.channels, {}, {}};
  shape.steps = head.steps;
  auto log = std::make_unique<FileLog>(std::move(file), shape, HeadState::whole, head.bytes);
  SYMRIG_CHECK(log->find_photographs());
  return std::unique_ptr<const PhotographLog>(std::move(log));
}

}  // namespace symrig
