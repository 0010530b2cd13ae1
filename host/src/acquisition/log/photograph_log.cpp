// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/photograph_log.hpp"

#include "acquisition/log/packed_photograph.hpp"
#include "acquisition/log/photograph_record.hpp"
#include "symrig/base/paged_vector.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace symrig {
namespace {

using acquisition::PhotographShape;
using acquisition::Record;

class MemoryLog final : public PhotographLog {
 public:
  explicit MemoryLog(PhotographShape shape) : shape_(std::move(shape)) {}

  Grid grid() const override { return shape_.grid; }
  Grid camera_grid() const override { return shape_.camera; }
  int channels() const override { return shape_.channels; }
  std::int64_t size() const override { return std::ssize(ends_); }

  Result<void> append_run(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
                          const ProbeCost& spent) override {
    SYMRIG_CHECK(acquisition::check_run(shape_, patterns, photographs));
    for (std::size_t k = 0; k < patterns.size(); ++k) {
      acquisition::encode_record(shape_, patterns[k], photographs[k],
                                 {spent, static_cast<std::uint32_t>(patterns.size() - k - 1), false},
                                 encoded_);
      bytes_.append(encoded_.begin(), encoded_.end());
      ends_.push_back(bytes_.size());
    }
    return {};
  }

  Result<Pattern> pattern(std::int64_t k) const override {
    SYMRIG_TRY(const auto record, at(k));
    return acquisition::record_pattern(shape_, record);
  }
  Result<Radiance> photograph(std::int64_t k) const override {
    SYMRIG_TRY(const auto record, at(k));
    return acquisition::record_photograph(shape_, record);
  }
  Result<void> read(std::int64_t k, LoggedPhotograph& to) const override {
    SYMRIG_TRY(const auto record, at(k));
    acquisition::read_record(shape_, record, to);
    return {};
  }
  Result<ProbeCost> spent(std::int64_t k) const override {
    SYMRIG_TRY(const auto record, at(k));
    return acquisition::record_spent(record);
  }
  Result<void> cut(std::int64_t first) override {
    ends_.resize(first);
    bytes_.resize(first > 0 ? ends_.back() : 0);
    return {};
  }

 private:
  Result<std::span<const std::byte>> at(std::int64_t k) const {
    if (k < 0 || k >= size()) return acquisition::no_such_photograph(k, size());
    const std::size_t begin = k > 0 ? ends_[k - 1] : 0;
    return std::span(bytes_.data() + begin, ends_[k] - begin);
  }

  PhotographShape shape_;
  PagedVector<std::byte> bytes_;  ///< of all records
  std::vector<std::size_t> ends_;
  Record encoded_;
};

}  // namespace

std::unique_ptr<PhotographLog> make_memory_log(Grid grid, int channels, std::optional<Grid> camera) {
  return std::make_unique<MemoryLog>(PhotographShape{grid, channels, camera.value_or(grid)});
}

namespace {

constexpr float kLargest = 0x1p60F;

/// A log keeps whatever it is given, and its checksums only say that it kept it. What is used must be
/// numbers.
bool photograph_ok(const Radiance& photograph) {
  constexpr float kLargestVariance = 0x1p120F;
  return std::ranges::all_of(photograph.mean.values(), [](float v) { return std::abs(v) < kLargest; }) &&
         std::ranges::all_of(photograph.variance.values(),
                             [](float v) { return v >= 0 && v < kLargestVariance; });
}

/// A scene file holds no number as large, so nobody could read the capture again. first: number of the first
/// photograph. Numbers that are none are found where they are used.
Result<void> check_photographs(std::span<const Radiance> photographs, std::int64_t first) {
  for (std::size_t k = 0; k < photographs.size(); ++k)
    if (std::ranges::any_of(photographs[k].mean.values(), [](float v) { return std::abs(v) >= kLargest; }))
      return Error{ErrorCode::bad_value,
                   "photograph " + std::to_string(first + static_cast<std::int64_t>(k)) +
                       " has light of 2^60 or more, which a scene file cannot hold",
                   "let the rig give light in a larger unit"};
  return {};
}

bool cost_ok(const ProbeCost& spent) {
  constexpr std::int64_t kMost = std::int64_t{1} << 50U;
  constexpr double kLongest = 9e9;  // 285 years: nanoseconds still fit
  const auto count = [](std::int64_t n) { return n >= 0 && n < kMost; };
  const auto time = [](double seconds) { return seconds >= 0 && seconds < kLongest; };
  return count(spent.photographs) && count(spent.frames) && time(spent.rig_seconds) &&
         time(spent.simulate_seconds) && time(spent.merge_seconds);
}

}  // namespace

Result<void> PhotographLog::rows(std::int64_t k, int strip, Radiance& to) const {
  SYMRIG_TRY(const Radiance all, photograph(k));
  acquisition::shape_of_strip(camera_grid(), channels(), strip, to);
  const std::size_t first = std::size_t{1} * strip * kLogStripRows * camera_grid().cols;
  const auto copy = [&](const auto& from, auto& part) {
    for (int c = 0; c < channels(); ++c)
      std::ranges::copy(from.plane(c).subspan(first, part.plane(c).size()), part.plane(c).begin());
  };
  copy(all.mean, to.mean);
  copy(all.variance, to.variance);
  copy(all.valid, to.valid);
  return {};
}

Result<void> PhotographLog::forget(std::int64_t /*first*/, std::int64_t differs) {
  return Error{ErrorCode::bad_format,
               "photograph " + std::to_string(differs) +
                   " of the log was taken with another pattern than this capture asks for",
               "give the budget and the version of symrig that the log was begun with, or delete the log to "
               "begin anew"};
}

Result<void> PhotographLog::cut(std::int64_t /*first*/) {
  return Error{ErrorCode::bad_argument, "this log keeps what it holds", "use a log in memory"};
}

/// Nothing if the log holds another photograph here.
Result<std::optional<Radiance>> LoggedProbe::replay(const Pattern& pattern, const Expectation* expected) {
  SYMRIG_TRY(const Pattern logged, log_.pattern(replayed_));
  const std::int32_t note = log_.budget_note(replayed_);
  const bool as_long = expected == nullptr || note == expected->budget_note(note >= Expectation::kHeldShort);
  if (logged != pattern || !as_long) return std::optional<Radiance>();
  SYMRIG_TRY(Radiance photograph, log_.photograph(replayed_));
  SYMRIG_TRY(replayed_cost_, log_.spent(replayed_));
  if (!photograph_ok(photograph) || !cost_ok(replayed_cost_))
    return Error{ErrorCode::bad_format,
                 "photograph " + std::to_string(replayed_) +
                     " of the log has numbers that no camera gives (not finite, negative or too large)",
                 "the log is damaged: delete it to begin anew"};
  SYMRIG_TRY(photograph, developed(pattern, std::move(photograph), replayed_cost_));
  ++replayed_;
  return std::optional(std::move(photograph));
}

/// The photograph as the capture sees it.
Result<Radiance> LoggedProbe::developed(const Pattern& pattern, Radiance photograph,
                                        const ProbeCost& spent) const {
  if (!development_) return photograph;
  SYMRIG_TRY(Radiance cells, development_->to_cells(photograph));
  SYMRIG_CHECK(development_->cells.append(pattern, cells, spent));
  return cells;
}

Result<std::vector<Radiance>> LoggedProbe::take(std::span<const Pattern> patterns,
                                                std::span<const Expectation> expected) {
  Probe& camera = development_ ? development_->camera : inner_;
  return expected.empty() ? camera.measure(patterns) : camera.measure_expected(patterns, expected);
}

/// Goes back to the beginning of the run that the next photograph would be in. Then runs, noise and costs are
/// those of a capture that was never broken off. photographs: of this call; a call begins a run.
/// planned: exposures are. Another budget chose other patterns in this call, so it also foresaw other light
/// for those that are the same by chance. They are taken again, with the exposures of this capture.
Result<void> LoggedProbe::leave_log(std::vector<Radiance>& photographs, bool planned) {
  const std::size_t back = planned ? photographs.size() : photographs.size() % together_;
  const std::int64_t first = replayed_ - static_cast<std::int64_t>(back);
  SYMRIG_CHECK(log_.forget(first, replayed_));
  photographs.resize(photographs.size() - back);
  if (development_) {
    development_->forget(replayed_ - first);
    SYMRIG_CHECK(development_->cells.cut(first));
  }
  replayed_ = first;
  if (first > 0) {
    SYMRIG_TRY(replayed_cost_, log_.spent(first - 1));
  }
  return {};
}

Result<void> LoggedProbe::go_on() {
  if (measuring_) return {};
  if (replayed_ > 0) SYMRIG_CHECK(inner_.continue_after(replayed_cost_));
  before_ = inner_.cost();
  measuring_ = true;
  return {};
}

Result<void> LoggedProbe::told(std::size_t photographs) const {
  if (!taken_ || taken_(photographs)) return {};
  return Error{ErrorCode::interrupted, "stopped between photographs", "run it again"};
}

Result<void> LoggedProbe::measure_on(std::span<const Pattern> patterns, std::span<const Expectation> expected,
                                     std::vector<Radiance>& photographs) {
  for (std::size_t first = 0; first < patterns.size(); first += together_) {
    const auto few = patterns.subspan(first, std::min(together_, patterns.size() - first));
    SYMRIG_TRY(std::vector<Radiance> answers,
               take(few, expected.empty() ? expected : expected.subspan(first, few.size())));
    SYMRIG_CHECK(check_photographs(answers, log_.size()));
    log_.note_budget(expected.empty() ? 0 : expected[first].budget_note(inner_.held_short()));
    SYMRIG_CHECK(log_.append_run(few, answers, cost()));
    // A capture that is continued sees what the log holds, so this one must see it too. Not what the log
    // would make of that: to round twice is another rounding.
    for (Radiance& answer : answers) answer = log_.kept(std::move(answer));
    for (std::size_t k = 0; k < few.size(); ++k) {
      SYMRIG_TRY(answers[k], developed(few[k], std::move(answers[k]), cost()));
      photographs.push_back(std::move(answers[k]));
    }
    SYMRIG_CHECK(told(few.size()));
  }
  return {};
}

bool LoggedProbe::plans_exposures(std::size_t photographs) const {
  const std::int64_t end = replayed_ + static_cast<std::int64_t>(photographs);
  bool logged = !measuring_ && end <= log_.size();
  for (std::int64_t k = replayed_; logged && k < end; ++k) logged = !log_.budgeted(k);
  return !logged && inner_.plans_exposures(photographs);
}

Result<std::vector<Radiance>> LoggedProbe::measure_expected(std::span<const Pattern> patterns,
                                                            std::span<const Expectation> expected) {
  std::vector<Radiance> photographs;
  photographs.reserve(patterns.size());
  while (!measuring_ && replayed_ < log_.size() && photographs.size() < patterns.size()) {
    const std::size_t next = photographs.size();
    SYMRIG_TRY(std::optional<Radiance> photograph,
               replay(patterns[next], expected.empty() ? nullptr : &expected[next]));
    if (!photograph) {
      SYMRIG_CHECK(leave_log(photographs, !expected.empty()));
      continue;
    }
    photographs.push_back(*std::move(photograph));
    SYMRIG_CHECK(told(1));
  }
  const auto rest = patterns.subspan(photographs.size());
  if (rest.empty()) return photographs;
  SYMRIG_CHECK(go_on());
  const auto expected_rest = expected.empty() ? expected : expected.subspan(photographs.size());
  SYMRIG_CHECK(measure_on(rest, expected_rest, photographs));
  return photographs;
}

ProbeCost LoggedProbe::cost() const {
  if (replayed_ == 0) return inner_.cost() - begun_;
  return measuring_ ? replayed_cost_ + (inner_.cost() - before_) : replayed_cost_;
}

}  // namespace symrig
