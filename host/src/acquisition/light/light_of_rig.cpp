// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_check.hpp"
#include "acquisition/search/photographer.hpp"
#include "symrig/acquisition/capture.hpp"

#include <optional>
#include <utility>
#include <vector>

namespace symrig {

Result<void> check_light_of_rig(Probe& rig, const Progress& progress) {
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
    return check_light(LightSeries(tree, *flood, &checks),
                       [&](std::span<const Pattern> patterns) { return rig.measure(patterns); });
  });
}

}  // namespace symrig
