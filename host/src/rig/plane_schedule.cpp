// SPDX-License-Identifier: Apache-2.0
#include "rig/plane_schedule.hpp"

#include "symrig/program/bracket.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

/// Clocks of board and projector differ by less: 100 ppm of a refresh of 16.7 ms are 1.7 us.
constexpr Nanoseconds kPlaneGuard{5'000};

int planes_for(Nanoseconds time, const PlaneRules& rules) {
  const Nanoseconds needed = rules.settle + time + kPlaneGuard, period = rules.timing.period;
  return static_cast<int>((needed + period - Nanoseconds{1}) / period);
}

/// Since the first edge of the frame trigger.
Nanoseconds begin_of(const PlaneExposure& at, const PlaneRules& rules) {
  return at.refresh * rules.refresh + rules.timing.frame_lead + at.plane * rules.timing.period;
}

/// The first refresh in which the exposure's plane begins at or after `ready`.
void place_after(PlaneExposure& at, Nanoseconds ready, const PlaneRules& rules) {
  at.refresh = 0;
  const Nanoseconds late = ready - begin_of(at, rules);
  if (late.count() > 0) at.refresh = (late + rules.refresh - Nanoseconds{1}) / rules.refresh;
}

/// Sets the refresh of each exposure of a picture, and sorts them by time.
void put_in_time(std::vector<PlannedExposure>& exposures, const PlaneRules& rules) {
  Nanoseconds ready{0};
  for (std::size_t done = 0; done < exposures.size(); ++done) {
    const auto left = exposures.begin() + static_cast<std::ptrdiff_t>(done);
    for (auto one = left; one != exposures.end(); ++one) place_after(one->at, ready, rules);
    const auto next =
        std::min_element(left, exposures.end(), [&rules](const PlannedExposure& a, const PlannedExposure& b) {
          return begin_of(a.at, rules) < begin_of(b.at, rules);
        });
    std::iter_swap(left, next);
    ready = begin_of(left->at, rules) + rules.settle + left->at.exposure + rules.gap +
            plane_lead(rules.timing.period);
  }
}

}  // namespace

Result<Nanoseconds> longest_in_planes(const PlaneRules& rules) {
  const PlaneTiming& timing = rules.timing;
  const bool one_light = timing.exposure == timing.period;
  const Nanoseconds light = one_light ? timing.planes * timing.period : timing.exposure;
  const Nanoseconds longest = light - rules.settle - kPlaneGuard;
  if (longest.count() > 0) return longest;
  return Error{ErrorCode::limit,
               fmt::format("a plane is bright for {} us, but settles for {} us", light.count() / 1000,
                           rules.settle.count() / 1000),
               "set a shorter rig.projector.settle"};
}

Result<Nanoseconds> light_in_planes(Nanoseconds wanted, const PlaneRules& rules) {
  SYMRIG_TRY(const Nanoseconds longest, longest_in_planes(rules));
  if (wanted <= longest) return wanted;
  if (rules.timing.exposure == rules.timing.period) {
    const Nanoseconds of_refresh = rules.timing.planes * rules.timing.period;
    return std::max<std::int64_t>(1, wanted / of_refresh) * of_refresh;
  }
  return Error{ErrorCode::limit,
               fmt::format("an exposure of {:.4g} ms is longer than a plane, {:.4g} ms",
                           1e3 * seconds(wanted), 1e3 * seconds(longest)),
               "use more light, open the aperture, or remove projector.plane_exposure"};
}

bool over_refreshes(const PlaneExposure& at, const PlaneRules& rules) {
  return at.planes == rules.timing.planes && at.exposure >= rules.refresh &&
         at.exposure % rules.refresh == Nanoseconds{0};
}

Nanoseconds light_of(const PlaneExposure& at, Nanoseconds width, const PlaneRules& rules) {
  if (!over_refreshes(at, rules)) return width;
  const double share = seconds(rules.timing.planes * rules.timing.period) / seconds(rules.refresh);
  return Nanoseconds{std::llround(static_cast<double>(width.count()) * share)};
}

Result<std::vector<PlanePicture>> plan_planes(std::span<const WantedExposure> wanted,
                                              const PlaneRules& rules) {
  SYMRIG_TRY(const Nanoseconds longest, longest_in_planes(rules));
  std::vector<PlanePicture> pictures;
  for (std::size_t first = 0, last = 0; first < wanted.size(); first = last) {
    // All exposures of one photograph use the same planes.
    int planes = 1;
    std::vector<Nanoseconds> shutters;
    for (last = first; last < wanted.size() && wanted[last].photograph == wanted[first].photograph; ++last) {
      SYMRIG_TRY(const Nanoseconds light, light_in_planes(wanted[last].time, rules));
      const bool whole = light > longest;
      planes = std::max(planes, whole ? rules.timing.planes : planes_for(light, rules));
      shutters.push_back(whole ? light / (rules.timing.planes * rules.timing.period) * rules.refresh : light);
    }
    const auto fits = static_cast<std::size_t>(rules.timing.planes - planes);
    if (pictures.empty() || pictures.back().plan.size() > fits) pictures.emplace_back();
    PlanePicture& picture = pictures.back();
    const auto plane = static_cast<int>(picture.plan.size());
    picture.plan.insert(picture.plan.end(), static_cast<std::size_t>(planes),
                        static_cast<int>(wanted[first].photograph));
    for (std::size_t i = first; i < last; ++i)
      picture.exposures.push_back({wanted[i], {0, plane, planes, shutters[i - first]}});
  }
  for (PlanePicture& picture : pictures) put_in_time(picture.exposures, rules);
  return pictures;
}

}  // namespace symrig
