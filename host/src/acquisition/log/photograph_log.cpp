// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/photograph_log.hpp"

#include "acquisition/log/photograph_record.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace symrig {
namespace {

using acquisition::PhotographShape;
using acquisition::Record;

class MemoryLog final : public PhotographLog {
 public:
  explicit MemoryLog(PhotographShape shape) : shape_(shape) {}

  Grid grid() const override { return shape_.grid; }
  int channels() const override { return shape_.channels; }
  std::int64_t size() const override { return std::ssize(records_); }

  Result<void> append_run(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
                          const ProbeCost& spent) override {
    SYMRIG_CHECK(acquisition::check_run(shape_, patterns, photographs));
    for (std::size_t k = 0; k < patterns.size(); ++k)
      acquisition::encode_record(patterns[k], photographs[k],
                                 {spent, static_cast<std::uint32_t>(patterns.size() - k - 1), false},
                                 records_.emplace_back());
    return {};
  }

  Result<Pattern> pattern(std::int64_t k) const override {
    SYMRIG_TRY(const Record* record, at(k));
    return acquisition::record_pattern(shape_, *record);
  }
  Result<Radiance> photograph(std::int64_t k) const override {
    SYMRIG_TRY(const Record* record, at(k));
    return acquisition::record_photograph(shape_, *record);
  }
  Result<void> read(std::int64_t k, LoggedPhotograph& to) const override {
    SYMRIG_TRY(const Record* record, at(k));
    acquisition::read_record(shape_, *record, to);
    return {};
  }
  Result<ProbeCost> spent(std::int64_t k) const override {
    SYMRIG_TRY(const Record* record, at(k));
    return acquisition::record_spent(*record);
  }

 private:
  Result<const Record*> at(std::int64_t k) const {
    if (k < 0 || k >= size()) return acquisition::no_such_photograph(k, size());
    return &records_[k];
  }

  PhotographShape shape_;
  std::vector<Record> records_;
};

}  // namespace

std::unique_ptr<PhotographLog> make_memory_log(Grid grid, int channels) {
  return std::make_unique<MemoryLog>(PhotographShape{grid, channels});
}

namespace {

ProbeCost operator+(const ProbeCost& a, const ProbeCost& b) {
  return {a.photographs + b.photographs, a.frames + b.frames, a.rig_seconds + b.rig_seconds,
          a.simulate_seconds + b.simulate_seconds, a.merge_seconds + b.merge_seconds};
}

ProbeCost operator-(const ProbeCost& a, const ProbeCost& b) {
  return {a.photographs - b.photographs, a.frames - b.frames, a.rig_seconds - b.rig_seconds,
          a.simulate_seconds - b.simulate_seconds, a.merge_seconds - b.merge_seconds};
}

/// A log keeps whatever it is given, and its checksums only say that it kept it. What is used must be
/// numbers.
bool photograph_ok(const Radiance& photograph) {
  constexpr float kLargest = 0x1p60F, kLargestVariance = 0x1p120F;
  return std::ranges::all_of(photograph.mean.values(), [](float v) { return std::abs(v) < kLargest; }) &&
         std::ranges::all_of(photograph.variance.values(),
                             [](float v) { return v >= 0 && v < kLargestVariance; });
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

Result<void> PhotographLog::forget(std::int64_t /*first*/, std::int64_t differs) {
  return Error{ErrorCode::bad_format,
               "photograph " + std::to_string(differs) +
                   " of the log was taken with another pattern than this capture asks for",
               "give the budget and the version of symrig that the log was begun with, or delete the log to "
               "begin anew"};
}

/// Nothing if the log holds another photograph here.
Result<std::optional<Radiance>> LoggedProbe::replay(const Pattern& pattern, const Expectation* expected) {
  SYMRIG_TRY(const Pattern logged, log_.pattern(replayed_));
  const bool as_long = expected == nullptr || expected->coarser_steps == log_.coarser(replayed_);
  if (logged != pattern || !as_long) return std::optional<Radiance>();
  SYMRIG_TRY(Radiance photograph, log_.photograph(replayed_));
  SYMRIG_TRY(replayed_cost_, log_.spent(replayed_));
  if (!photograph_ok(photograph) || !cost_ok(replayed_cost_))
    return Error{ErrorCode::bad_format,
                 "photograph " + std::to_string(replayed_) +
                     " of the log has numbers that no camera gives (not finite, negative or too large)",
                 "the log is damaged: delete it to begin anew"};
  ++replayed_;
  return std::optional(std::move(photograph));
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
               expected.empty() ? inner_.measure(few)
                                : inner_.measure_expected(few, expected.subspan(first, few.size())));
    log_.note_coarser(expected.empty() ? 0 : expected[first].coarser_steps);
    SYMRIG_CHECK(log_.append_run(few, answers, cost()));
    std::move(answers.begin(), answers.end(), std::back_inserter(photographs));
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
  if (!measuring_) return replayed_ > 0 ? replayed_cost_ : inner_.cost();
  return replayed_ > 0 ? replayed_cost_ + (inner_.cost() - before_) : inner_.cost();
}

}  // namespace symrig
