// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_check.hpp"
#include "acquisition/light/light_columns.hpp"
#include "acquisition/search/photographer.hpp"
#include "symrig/acquisition/capture.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace symrig {

namespace {

/// Random patterns of fewer pixels tell no order (LightMatch), and so few are soon lit one by one.
constexpr std::int64_t kFewPixels = 64;

Result<TransportTensor> measure_each_pixel(Probe& rig, const Progress& progress) {
  SYMRIG_TRY(CaptureResult result, capture(rig, {.algorithm = Algorithm::brute, .progress = progress}));
  return std::move(result.tensor);
}

}  // namespace

Result<void> check_light_of_rig(Probe& rig, const Progress& progress) {
  std::optional<TransportTensor> alone;
  if (rig.grid().size() < kFewPixels) {
    SYMRIG_TRY(alone, measure_each_pixel(rig, progress));
    SYMRIG_CHECK(check_measured_light(*alone));
  }
  return check_light_of_rig(rig, alone ? &*alone : nullptr, progress);
}

Result<void> check_measured_light(const TransportTensor& measured) {
  return acquisition::check_columns(measured);
}

Result<void> check_light_of_rig(Probe& rig, const TransportTensor* measured, const Progress& progress) {
  using namespace acquisition;
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
    const LookAside look = [&](std::span<const Pattern> shown) { return rig.measure(shown); };
    SYMRIG_CHECK(check_light(series, look));
    return measured != nullptr ? check_sum_of_columns(*measured, series, look) : Result<void>();
  });
}

}  // namespace symrig
