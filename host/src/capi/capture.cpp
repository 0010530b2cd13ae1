// SPDX-License-Identifier: Apache-2.0

#include "capi/guard.hpp"
#include "capi/handles.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/base/text.hpp"
#include "symrig/job/capture_job.hpp"
#include "symrig/report/summary.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::capi {

namespace {

/// A budget of 0 is refused, but means "none" in CaptureOptions. So budgets wait until all are known.
struct CaptureDraft {
  CaptureJob& job;
  GivenBudgets budgets;
};

Error wrong_value(std::string_view key, std::string_view value, const char* next) {
  return {ErrorCode::bad_argument, fmt::format("the option {} cannot be '{}'", key, printable_line(value)),
          next};
}

template <class Number>
Result<void> take_number(std::string_view key, std::string_view value, std::optional<Number>& into) {
  Number number{};
  const char* const end = value.data() + value.size();
  const auto [stop, failed] = std::from_chars(value.data(), end, number);
  if (failed != std::errc{} || stop != end)
    return wrong_value(key, value, std::is_integral_v<Number> ? "give a whole number" : "give a number");
  into = number;
  return {};
}

Result<void> take_switch(std::string_view key, std::string_view value, bool& into) {
  if (value != "on" && value != "off") return wrong_value(key, value, "give on or off");
  into = value == "on";
  return {};
}

using TakeValue = Result<void> (*)(std::string_view key, std::string_view value, CaptureDraft& draft);

struct CaptureKey {
  std::string_view name;
  TakeValue take;
};

/// A number of the options or of the job, or a budget.
template <auto Member>
constexpr TakeValue kNumber = [](std::string_view key, std::string_view value, CaptureDraft& draft) {
  if constexpr (std::is_invocable_v<decltype(Member), CaptureOptions&>)
    return take_number(key, value, draft.job.options.*Member);
  else if constexpr (std::is_invocable_v<decltype(Member), CaptureJob&>)
    return take_number(key, value, draft.job.*Member);
  else
    return take_number(key, value, draft.budgets.*Member);
};

/// A switch of the job, of its log, or of the options.
template <auto Member>
constexpr TakeValue kSwitch = [](std::string_view key, std::string_view value, CaptureDraft& draft) {
  if constexpr (std::is_invocable_v<decltype(Member), CaptureJob&>)
    return take_switch(key, value, draft.job.*Member);
  else if constexpr (std::is_invocable_v<decltype(Member), LogOptions&>)
    return take_switch(key, value, draft.job.log.*Member);
  else
    return take_switch(key, value, draft.job.options.*Member);
};

/// A word of a list.
template <auto Member, auto Parse>
constexpr TakeValue kWord =
    [](std::string_view, std::string_view value, CaptureDraft& draft) -> Result<void> {
  SYMRIG_TRY(draft.job.options.*Member, Parse(value));
  return {};
};

Result<void> take_log(std::string_view key, std::string_view value, CaptureDraft& draft) {
  bool on = true;
  SYMRIG_CHECK(take_switch(key, value, on));
  draft.job.log.off = !on;
  return {};
}

constexpr std::array kCaptureKeys{
    CaptureKey{"algorithm", kWord<&CaptureOptions::algorithm, &parse_algorithm>},
    CaptureKey{"tolerance", kNumber<&CaptureOptions::tolerance>},
    CaptureKey{"max_patterns", kNumber<&GivenBudgets::max_patterns>},
    CaptureKey{"max_seconds", kNumber<&GivenBudgets::max_seconds>},
    CaptureKey{"target_error", kNumber<&GivenBudgets::target_error>},
    CaptureKey{"photograph_seconds", kNumber<&CaptureOptions::photograph_seconds>},
    CaptureKey{"polish", kNumber<&CaptureOptions::polish>},
    CaptureKey{"split", kWord<&CaptureOptions::split, &parse_split_order>},
    CaptureKey{"dual_threshold", kNumber<&CaptureOptions::dual_threshold>},
    CaptureKey{"dual_subtracts", kSwitch<&CaptureOptions::dual_subtracts>},
    CaptureKey{"check_axis", kSwitch<&CaptureJob::check_axis>},
    CaptureKey{"unchecked", kSwitch<&CaptureOptions::unchecked>},
    CaptureKey{"log", &take_log},
    CaptureKey{"resume", kSwitch<&LogOptions::resume>},
    CaptureKey{"keep_log", kSwitch<&LogOptions::keep>},
    CaptureKey{"cells", kSwitch<&CaptureJob::cells_only>},
    CaptureKey{"fit_seconds", kNumber<&CaptureJob::fit_seconds>}};

const CaptureKey* capture_key(std::string_view name) {
  const auto* const found = std::find_if(kCaptureKeys.begin(), kCaptureKeys.end(),
                                         [&](const CaptureKey& one) { return one.name == name; });
  return found == kCaptureKeys.end() ? nullptr : found;
}

Error unknown_option(std::string_view key) {
  std::vector<std::string_view> names;
  names.reserve(kCaptureKeys.size());
  for (const CaptureKey& one : kCaptureKeys) names.push_back(one.name);
  return {ErrorCode::unknown_name, fmt::format("there is no option '{}' of a capture", printable_line(key)),
          nearest_hint(key, names)};
}

Result<void> take_pair(std::string_view pair, std::vector<std::string_view>& seen, CaptureDraft& draft) {
  const std::size_t equals = pair.find('=');
  if (equals == std::string_view::npos)
    return Error{ErrorCode::bad_argument, fmt::format("the option '{}' has no value", printable_line(pair)),
                 "give key=value"};
  const std::string_view key = pair.substr(0, equals);
  const CaptureKey* const known = capture_key(key);
  if (known == nullptr) return unknown_option(key);
  if (std::find(seen.begin(), seen.end(), key) != seen.end())
    return Error{ErrorCode::bad_argument, fmt::format("the option {} is given twice", key), "give it once"};
  seen.push_back(key);
  return known->take(key, pair.substr(equals + 1), draft);
}

/// Sets what the options of symrig_capture() say: pairs key=value with blanks or line feeds between them.
/// fails: bad_argument (no pair, a value out of its kind, a key twice), unknown_name (a key, or the name of
/// an algorithm or an order).
Result<void> take_capture_text(std::string_view text, CaptureJob& job) {
  constexpr std::string_view kBetween = " \n\r\t";
  CaptureDraft draft{job, {}};
  std::vector<std::string_view> seen;
  for (std::size_t at = text.find_first_not_of(kBetween); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kBetween, at), text.size());
    SYMRIG_CHECK(take_pair(text.substr(at, end - at), seen, draft));
    at = text.find_first_not_of(kBetween, end);
  }
  SYMRIG_CHECK(check_budgets(draft.budgets));
  job.options.max_patterns = draft.budgets.max_patterns.value_or(0);
  job.options.max_seconds = draft.budgets.max_seconds.value_or(0);
  job.options.target_error = draft.budgets.target_error.value_or(0);
  return {};
}

}  // namespace

}  // namespace symrig::capi

namespace {

using namespace symrig;
using namespace symrig::capi;

Result<CaptureJob> capture_job(const symrig_rig& rig, const char* output, const char* options) {
  CaptureJob job;
  if (output != nullptr) job.output = output;
  if (options != nullptr) SYMRIG_CHECK(take_capture_text(options, job));
  job.made = [] { return Made{utc_now(), symrig_version(), "symrig_capture() of C"}; };
  JobFiles files = rig.name.empty() ? JobFiles() : rig_files(rig.name);
  files.reads("the registration", rig.registration).writes("output", job.output, FileFormat::scene);
  if (!job.output.empty()) SYMRIG_CHECK(CaptureLog::declare(job.output, job.log, std::move(files)).check());
  return job;
}

Result<StoredScene> capture_now(symrig_rig& rig, CaptureJob job, Progress progress) {
  job.options.progress = std::move(progress);
  SYMRIG_TRY(CaptureOutcome outcome, run_job(job, rig.opened));
  return std::move(outcome).scene();
}

}  // namespace

int symrig_capture(symrig_rig* rig, const char* output, const char* options, symrig_on_capture on_progress,
                   void* user, symrig_tensor** tensor, symrig_error* error) {
  return guarded(error, [&] {
    if (tensor != nullptr) *tensor = nullptr;
    if (rig == nullptr) return missing("rig", error);
    const bool writes = output != nullptr && *output != '\0';
    if (tensor == nullptr && !writes) return missing("tensor", error);
    const RigTurn turn(*rig);
    if (const auto free = turn.check(); !free) return report(free.error(), error);
    auto job = capture_job(*rig, output, options);
    if (!job) return report(job.error(), error);
    auto scene = capture_now(*rig, *std::move(job), turn.progress(on_progress, user));
    if (!scene) return report(scene.error(), error);
    if (tensor == nullptr) return 0;
    const auto made = symrig_tensor::make(*std::move(scene));
    if (!made) return report(made.error(), error);
    *tensor = *made;
    return 0;
  });
}
