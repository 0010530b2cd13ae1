// SPDX-License-Identifier: Apache-2.0
#include "acquisition/capture_noise.hpp"

#include "acquisition/errors/noise_check.hpp"

#include <algorithm>
#include <functional>
#include <span>
#include <vector>

namespace symrig::acquisition {
namespace {

/// The photographs of level 0, which light the children of the whole grid one after another. None if combs
/// for short-range light came first.
Result<std::vector<TreePhotograph>> quarters(const BlockTree& tree, const Photographer& photographer,
                                             std::int64_t first) {
  std::vector<TreePhotograph> parts;
  std::vector<float> lit(tree.order().size());
  SYMRIG_CHECK(photographer.read(
      first, tree.level(0)[0].children, [&](std::int64_t, std::span<TreePhotograph> photographs) {
        for (const TreePhotograph& p : photographs)
          std::transform(lit.begin(), lit.end(), p.pattern.begin(), lit.begin(), std::plus<>());
        parts.insert(parts.end(), photographs.begin(), photographs.end());
      }));
  if (std::any_of(lit.begin(), lit.end(), [](float light) { return light != 1; })) parts.clear();
  return parts;
}

}  // namespace

Result<NoiseCheck> check_noise(const BlockTree& tree, const Photographer& photographer, const Checks& checks,
                               std::int64_t first_again, const Completion* completion) {
  constexpr std::int64_t kMost = 8;
  std::vector<TreePhotograph> floods;
  const auto keep = [&](std::int64_t, std::span<TreePhotograph> p) {
    floods.insert(floods.end(), p.begin(), p.end());
  };
  SYMRIG_CHECK(photographer.read(0, 1, keep));
  const std::int64_t again = first_again > 0 ? photographer.taken() - first_again : 0;
  SYMRIG_CHECK(photographer.read(first_again, std::min(again, kMost), keep));
  NoiseEvidence besides;
  std::vector<TreePhotograph> parts;
  if (completion != nullptr) {
    besides.mirrored = completion->mirrored();
    SYMRIG_TRY(parts, quarters(tree, photographer, checks.last()));
    besides.parts = parts;
  }
  const auto& held_out = checks.photographs();
  return check_noise(tree, floods, &held_out[Checks::kHalf].photograph,
                     &held_out[Checks::kOtherHalf].photograph, besides);
}

}  // namespace symrig::acquisition
