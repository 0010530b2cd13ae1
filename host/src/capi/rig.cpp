// SPDX-License-Identifier: Apache-2.0

#include "capi/guard.hpp"
#include "capi/handles.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/base/text.hpp"
#include "symrig/rig/exec_probe.hpp"
#include "symrig/rig/internal/received_photograph.hpp"
#include "symrig/symrig.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace symrig::capi {

namespace {

/// A rig that is a function of a C program.
class CallbackProbe final : public Probe {
 public:
  /// Reads as many members of `own` as its `size` states.
  /// fails: bad_argument (a member out of its range; a size that no version has), limit (a batch too large).
  static Result<std::unique_ptr<CallbackProbe>> make(const symrig_own_rig& own);

  Grid grid() const override { return grid_; }
  ViewLayout views() const override { return views_; }
  int channels() const override { return channels_; }
  std::size_t together() const override { return together_; }
  ProbeCost cost() const override { return cost_; }
  std::string describe() const override { return name_; }
  /// The callback gets batches of at most together() patterns.
  /// fails: also what the callback returns; bad_value (NaN, infinity, a negative variance, a valid that is
  /// not 0 or 1, negative seconds); fault (it threw an exception).
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override;

 private:
  CallbackProbe(const symrig_own_rig& own, Grid grid);
  Result<double> ask(std::span<const Pattern> patterns, std::vector<Radiance>& photographs) const;

  symrig_measure measure_;
  void* user_;
  std::string name_;
  Grid grid_;
  ViewLayout views_;
  int channels_;
  std::size_t together_;
  ProbeCost cost_;
};

constexpr int kMostTogether = 1 << 20;

/// The members of the first version of symrig_own_rig.
constexpr std::size_t kFirstSize = offsetof(symrig_own_rig, together) + sizeof(symrig_own_rig::together);

Error wrong_member(const char* member, std::int64_t value, const char* next) {
  return {ErrorCode::bad_argument, fmt::format("symrig_own_rig.{} is {}", member, value), next};
}

/// The caller's structure as this version has it. Members that the caller does not know are 0.
Result<symrig_own_rig> known_members(const symrig_own_rig& own) {
  if (own.size < kFirstSize || own.size > sizeof(symrig_own_rig))
    return wrong_member("size", static_cast<std::int64_t>(own.size),
                        "set it to sizeof(symrig_own_rig), and use a library as new as your header");
  symrig_own_rig known{};
  std::memcpy(&known, &own, own.size);
  for (std::int32_t* with_default : {&known.channels, &known.view_rows, &known.view_columns, &known.together})
    if (*with_default == 0) *with_default = 1;
  return known;
}

Result<void> check_shape(const symrig_own_rig& own, Grid grid) {
  if (!grid.valid() || grid.size() < 1)
    return Error{ErrorCode::bad_argument,
                 fmt::format("symrig_own_rig has {} rows and {} columns", own.rows, own.columns),
                 "give at least one of each, and at most 2^30 places"};
  if (own.channels < 1 || own.channels > kExecChannels)
    return wrong_member("channels", own.channels, "give a number from 1 to 64");
  if (own.together < 1 || own.together > kMostTogether)
    return wrong_member("together", own.together, "give a number from 1 to 1048576");
  const bool views = own.view_rows > 0 && own.view_columns > 0;
  if (!views || !ViewLayout{own.view_rows, own.view_columns}.fits(grid))
    return Error{
        ErrorCode::bad_argument,
        fmt::format("{} x {} views do not fit the grid {}", own.view_rows, own.view_columns, to_string(grid)),
        "give the rows and columns of views that tile the grid"};
  constexpr double kValue = 2 * sizeof(float) + 1;  // mean, variance, valid
  const double bytes = static_cast<double>(grid.size()) * (sizeof(float) + kValue * own.channels);
  if (bytes * own.together <= static_cast<double>(kExecLargest)) return {};
  return Error{ErrorCode::limit,
               fmt::format("a batch of {} patterns needs {:.3g} bytes, but at most {} are allowed",
                           own.together, bytes * own.together, kExecLargest),
               "use fewer patterns together, a smaller grid or fewer channels"};
}

/// A text that a callback has filled; it may lack its end.
template <std::size_t N>
std::string text_of(const char (&text)[N]) {
  return printable_line(std::string_view(text, strnlen(text, N)));
}

/// A code that no error has becomes device_lost.
Error failure_of(int code, const symrig_error& told) {
  const bool known = name(static_cast<ErrorCode>(code)) != "unknown" && code > 0 && code <= UINT16_MAX;
  const ErrorCode meant = known ? static_cast<ErrorCode>(code) : ErrorCode::device_lost;
  std::string what = text_of(told.what);
  if (what.empty())
    what = meant == ErrorCode::interrupted
               ? "the rig's callback stopped the capture"
               : fmt::format("the rig's callback returned {} ({})", code, name(meant));
  return {meant, std::move(what), text_of(told.hint)};
}

/// Room for the answers to a batch, as the callback finds it.
struct Answers {
  Answers(std::size_t count, std::size_t values)
      : each(values),
        mean(count * values, std::numeric_limits<float>::quiet_NaN()),
        variance(count * values, 0.0F),
        valid(count * values, 1) {}

  Radiance photograph(std::size_t k, Grid grid, int channels) const {
    Radiance one{Image<float>(grid, channels), Image<float>(grid, channels),
                 Image<std::uint8_t>(grid, channels)};
    const auto first = static_cast<std::ptrdiff_t>(k * each);
    std::copy_n(mean.begin() + first, each, one.mean.values().begin());
    std::copy_n(variance.begin() + first, each, one.variance.values().begin());
    std::copy_n(valid.begin() + first, each, one.valid.values().begin());
    return one;
  }

  std::size_t each;  ///< values of a photograph
  std::vector<float> mean, variance;
  std::vector<std::uint8_t> valid;
};

/// The callback may be C++, and what it throws must not pass through C.
Result<double> call_measure(symrig_measure measure, void* user, symrig_batch& batch) {
  symrig_error told{};
  batch.error = &told;
  int code = 0;
  try {
    code = measure(&batch, user);
  } catch (...) {
    return Error{ErrorCode::fault, "the rig's callback threw an exception", "catch it there"};
  }
  if (code != 0) return failure_of(code, told);
  if (std::isfinite(batch.seconds) && batch.seconds >= 0) return batch.seconds;
  return Error{ErrorCode::bad_value, fmt::format("the rig's callback states {} seconds", batch.seconds),
               "give 0 or more"};
}

CallbackProbe::CallbackProbe(const symrig_own_rig& own, Grid grid)
    : measure_(own.measure),
      user_(own.user),
      name_(own.name == nullptr ? "callback" : printable_line(own.name)),
      grid_(grid),
      views_{own.view_rows, own.view_columns},
      channels_(own.channels),
      together_(static_cast<std::size_t>(own.together)) {}

Result<std::unique_ptr<CallbackProbe>> CallbackProbe::make(const symrig_own_rig& own) {
  SYMRIG_TRY(const symrig_own_rig known, known_members(own));
  if (known.measure == nullptr)
    return Error{ErrorCode::bad_argument, "symrig_own_rig.measure is null", "give a function"};
  const Grid grid{known.rows, known.columns};
  SYMRIG_CHECK(check_shape(known, grid));
  return std::unique_ptr<CallbackProbe>(new CallbackProbe(known, grid));
}

Result<double> CallbackProbe::ask(std::span<const Pattern> patterns,
                                  std::vector<Radiance>& photographs) const {
  const auto cells = static_cast<std::size_t>(grid_.size());
  std::vector<float> shown;
  shown.reserve(patterns.size() * cells);
  for (const Pattern& pattern : patterns)
    shown.insert(shown.end(), pattern.values().begin(), pattern.values().end());
  Answers answers(patterns.size(), cells * static_cast<std::size_t>(channels_));
  symrig_batch batch{};
  batch.count = patterns.size();
  batch.patterns = shown.data();
  batch.mean = answers.mean.data();
  batch.variance = answers.variance.data();
  batch.valid = answers.valid.data();
  SYMRIG_TRY(const double seconds, call_measure(measure_, user_, batch));
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    Radiance photograph = answers.photograph(k, grid_, channels_);
    if (const auto fault = rig::settle(photograph))
      return Error{
          ErrorCode::bad_value,
          fmt::format("the rig's callback: photograph {} of {} has {}", k + 1, patterns.size(), *fault),
          "fill every mean with a finite number, give no negative variance, and mark unusable "
          "pixels by valid 0"};
    photographs.push_back(std::move(photograph));
  }
  return seconds;
}

Result<std::vector<Radiance>> CallbackProbe::measure(std::span<const Pattern> patterns) {
  SYMRIG_CHECK(check_patterns(*this, patterns));
  std::vector<Radiance> photographs;
  double seconds = 0;
  while (photographs.size() < patterns.size()) {
    const std::size_t first = photographs.size();
    SYMRIG_TRY(const double more,
               ask(patterns.subspan(first, std::min(together_, patterns.size() - first)), photographs));
    seconds += more;
  }
  cost_.photographs += std::ssize(patterns);
  cost_.frames += std::ssize(patterns);
  cost_.rig_seconds += seconds;
  return photographs;
}

}  // namespace

}  // namespace symrig::capi

namespace {

using namespace symrig;
using namespace symrig::capi;

std::string text_or_empty(const char* text) {
  return text == nullptr ? std::string() : std::string(text);
}

/// The handle first: what waits for a device asks its member `stop`.
Result<std::unique_ptr<symrig_rig>> open_named(const char* name, const char* registration) {
  auto handle = std::make_unique<symrig_rig>();
  handle->name = name;
  handle->registration = text_or_empty(registration);
  SYMRIG_TRY(handle->opened, symrig::open_rig(handle->name, handle->registration,
                                              [rig = handle.get()] { return !rig->stop; }));
  return handle;
}

}  // namespace

int symrig_rig_open(const char* name, const char* registration, symrig_rig** rig, symrig_error* error) {
  return guarded(error, [&] {
    if (name == nullptr) return missing("name", error);
    if (rig == nullptr) return missing("rig", error);
    *rig = nullptr;
    auto opened = open_named(name, registration);
    if (!opened) return report(opened.error(), error);
    *rig = (*std::move(opened)).release();
    return 0;
  });
}

int symrig_rig_of_callback(const symrig_own_rig* own, symrig_rig** rig, symrig_error* error) {
  return guarded(error, [&] {
    if (own == nullptr) return missing("own", error);
    if (rig == nullptr) return missing("rig", error);
    *rig = nullptr;
    auto probe = CallbackProbe::make(*own);
    if (!probe) return report(probe.error(), error);
    auto handle = std::make_unique<symrig_rig>();
    handle->opened.probe = *std::move(probe);
    handle->opened.noise = "camera";
    *rig = handle.release();
    return 0;
  });
}

void symrig_rig_close(symrig_rig* rig) {
  guarded(nullptr, [&] {
    delete rig;
    return 0;
  });
}

symrig_shape symrig_rig_shape(const symrig_rig* rig) {
  symrig_shape shape{};
  guarded(nullptr, [&] {
    if (rig == nullptr) return 0;
    const Probe& probe = *rig->opened.probe;
    const Grid patterns = probe.grid(), photographs = probe.camera_grid();
    shape = {patterns.rows, patterns.cols, photographs.rows, photographs.cols, probe.channels()};
    return 0;
  });
  return shape;
}

void symrig_rig_stop(symrig_rig* rig) {
  if (rig != nullptr) rig->stop = true;
}
