// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_check.hpp"
#include "acquisition/light/light_tests.hpp"
#include "acquisition/tree/photographer.hpp"
#include "symrig/acquisition/capture.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace symrig {
namespace {

using namespace acquisition;

Result<TransportTensor> light_each_pixel(Probe& rig, const Progress& progress) {
  SYMRIG_TRY(CaptureResult result, capture(rig, {.algorithm = Algorithm::brute, .progress = progress}));
  return std::move(result.tensor);
}

/// measured: are_columns(), to be compared with the seven photographs; may be nullptr.
/// captured: of the same rig before; nullptr: not to be compared.
Result<void> check_seven(Probe& rig, const TransportTensor* measured, const TransportTensor* captured,
                         const Progress& progress) {
  const BlockTree tree(rig.grid());
  const Work work(progress);
  return stoppable(work, [&]() -> Result<void> {
    Photographer photographer(rig, nullptr, tree, work);
    photographer.expect_later(kNoneToCome);
    std::optional<TreePhotograph> flood;
    const std::vector<LitBlocks> all{{{0, static_cast<std::int32_t>(tree.grid().size())}}};
    SYMRIG_CHECK(photographer.take_each(
        "checking the light", all, [&](std::size_t, TreePhotograph& taken) { flood = std::move(taken); }));
    SYMRIG_TRY(const Checks checks, Checks::take(tree, photographer));
    const LightSeries series(tree, *flood, &checks);
    const LookAside look = [&](std::span<const Pattern> shown, std::span<const Expectation>) {
      return rig.measure(shown);
    };
    if (measured != nullptr) SYMRIG_CHECK(check_order_of_columns(*measured, series));
    SYMRIG_CHECK(check_light(series, look));
    if (measured == nullptr) return {};
    SYMRIG_CHECK(check_sum_of_columns(*measured, series, look));
    return captured != nullptr ? check_capture_by_columns(*captured, *measured, series) : Result<void>();
  });
}

/// captured: as of check_seven().
Result<void> check_rig_light(Probe& rig, const TransportTensor* captured, const Progress& progress) {
  std::optional<TransportTensor> alone;
  if (rig.grid().size() < kFewestInOrder) {
    SYMRIG_TRY(alone, light_each_pixel(rig, progress));
    if (!are_columns(*alone)) return {};
    SYMRIG_CHECK(check_columns(*alone));
  }
  return check_seven(rig, alone ? &*alone : nullptr, captured, progress);
}

}  // namespace

Result<void> check_light_of_rig(Probe& rig, const Progress& progress) {
  return check_rig_light(rig, nullptr, progress);
}

Result<void> judge_light(Probe& rig, const CaptureOptions& options, const CaptureResult& result) {
  constexpr std::int64_t kSeven = 7;
  if (options.unchecked) return {};
  const std::int64_t pixels = rig.grid().size();
  const bool few = pixels < kFewestInOrder;
  // Where brute force had to finish a search, the held-out photographs have become part of the tensor.
  const bool searched = !result.held_out.empty() || result.undetermined;
  if (searched && !few) return {};
  const bool alone = !searched && are_columns(result.tensor);
  if (alone) SYMRIG_CHECK(check_columns(result.tensor));
  const std::int64_t wanted = kSeven + (few && !alone ? pixels : 0);
  if (options.max_seconds != 0 ||
      (options.max_patterns != 0 && result.patterns + wanted > options.max_patterns))
    return {};
  if (alone) return check_seven(rig, &result.tensor, nullptr, options.progress);
  // Where a budget or a target ended the search, or a coarse tolerance, it may be far from the rig.
  const bool comparable = searched && result.stopped_by == "done" && options.max_patterns == 0 &&
                          options.target_error == 0 && !options.tolerance;
  return check_rig_light(rig, comparable ? &result.tensor : nullptr, options.progress);
}

}  // namespace symrig
