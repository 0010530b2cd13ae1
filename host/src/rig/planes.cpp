// SPDX-License-Identifier: Apache-2.0

#include "rig/planes.hpp"

#include "rig/exposure_choice.hpp"
#include "symrig/program/compile.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig {

namespace {

/// Clocks of board and projector differ by less: 100 ppm of a refresh of 16.7 ms are 1.7 us.
constexpr Nanoseconds kPlaneGuard{5'000};

std::int64_t rounded_up(Nanoseconds time, Nanoseconds period) {
  return (time + period - Nanoseconds{1}) / period;
}

/// The begin of an exposure's plane, since the first edge of the frame trigger.
Nanoseconds begin_of(const PlaneExposure& at, const PlaneRules& rules) {
  return at.refresh * rules.refresh + rules.timing.frame_lead + at.plane * rules.timing.period;
}

/// When the board can wait for the next plane if nothing overlaps.
Nanoseconds ready_after(const PlaneExposure& at, const PlaneRules& rules) {
  return begin_of(at, rules) + rules.settle + rules.reaction + at.exposure + rules.gap +
         plane_lead(rules.timing.period);
}

/// Places exposures one after the other. Planes are counted through the refreshes of the run.
class PlanePlanner {
 public:
  explicit PlanePlanner(const PlaneRules& rules)
      : rules_(rules), planes_(rules.timing.planes), ready_(rules.first) {}

  void add(const WantedExposure& wanted) {
    std::int64_t plane = first_plane_after(ready_ - rig::overlap_before(wanted.time, rules_.overlap));
    std::optional<PlaneExposure> at;
    for (at = placed(plane, wanted.time); !at || !is_free(*at, wanted.photograph);
         at = placed(plane, wanted.time))
      ++plane;
    for (int k = 0; k < at->planes; ++k) pattern_of(*at, k) = static_cast<int>(wanted.photograph);
    out_.exposures.push_back({wanted, *at});
    ready_ = ready_after(*at, rules_);
  }

  /// Pictures that are equal to the one before are that picture.
  PlaneSchedule finish() {
    for (const PlanePlan& plan : plans_) {
      if (out_.pictures.empty() || out_.pictures.back() != plan) out_.pictures.push_back(plan);
      out_.order.insert(out_.order.end(), static_cast<std::size_t>(rules_.hold), out_.pictures.size() - 1);
    }
    return std::move(out_);
  }

 private:
  std::int64_t first_plane_after(Nanoseconds ready) const {
    const Nanoseconds late = std::max(ready - rules_.timing.frame_lead, Nanoseconds{0});
    const std::int64_t refresh = late / rules_.refresh;
    const std::int64_t plane = rounded_up(late - refresh * rules_.refresh, rules_.timing.period);
    return refresh * planes_ + std::min<std::int64_t>(plane, planes_);
  }

  /// None: the exposure would end in the dark time, or too near to it, or in a picture where it must not.
  std::optional<PlaneExposure> placed(std::int64_t plane, Nanoseconds light) const {
    const Nanoseconds period = rules_.timing.period, whole = planes_ * period;
    PlaneExposure at{plane / planes_, static_cast<int>(plane % planes_), 1, light};
    if (!rules_.one_light()) return at;
    // Without dark time, counted from plane 0 of the picture in which it begins.
    // A board that reacts sooner ends it sooner, but in the same picture.
    const Nanoseconds end = at.plane * period + rules_.settle + rules_.reaction + light;
    const std::int64_t pictures = end / whole;
    const Nanoseconds left = end % whole;
    const bool inside =
        left <= whole - kPlaneGuard && (pictures == 0 || left >= kPlaneGuard + rules_.reaction);
    if (!inside || (pictures > 0 && !rules_.may_cross())) return std::nullopt;
    at.exposure = light + pictures * rules_.dark();
    at.planes = static_cast<int>(pictures * planes_ + rounded_up(left + kPlaneGuard, period) - at.plane);
    return at;
  }

  /// Plane k of those of an exposure.
  int& pattern_of(const PlaneExposure& at, int k) {
    const std::int64_t plane = at.refresh * planes_ + at.plane + k;
    const auto picture = static_cast<std::size_t>(plane / planes_ / rules_.hold);
    while (plans_.size() <= picture) plans_.emplace_back(static_cast<std::size_t>(planes_), kBlackPlane);
    return plans_[picture][static_cast<std::size_t>(plane % planes_)];
  }

  bool is_free(const PlaneExposure& at, std::size_t photograph) {
    for (int k = 0; k < at.planes; ++k) {
      const int pattern = pattern_of(at, k);
      if (pattern != kBlackPlane && pattern != static_cast<int>(photograph)) return false;
    }
    return true;
  }

  const PlaneRules& rules_;
  std::int64_t planes_;
  Nanoseconds ready_;
  std::vector<PlanePlan> plans_;  // of each `hold` refreshes
  PlaneSchedule out_;
};

}  // namespace

int PlaneSchedule::pattern(std::size_t picture, int plane) const {
  return pictures[picture][static_cast<std::size_t>(plane)];
}

Result<Nanoseconds> longest_in_planes(const PlaneRules& rules) {
  const PlaneTiming& timing = rules.timing;
  const Nanoseconds light = rules.one_light() ? timing.planes * timing.period : timing.exposure;
  const Nanoseconds settle = rules.settle + rules.reaction;
  const Nanoseconds longest = light - settle - kPlaneGuard;
  // Plane k + 1 must not have begun before the exposure does.
  if (longest.count() > 0 && settle + kPlaneGuard < timing.period) return longest;
  return Error{
      ErrorCode::limit,
      fmt::format("planes {} us apart are too short: {} us of settling, {} us of the board's reaction",
                  timing.period.count() / 1000, rules.settle.count() / 1000, rules.reaction.count() / 1000),
      "set a shorter rig.projector.settle, a longer projector.plane_period with fewer planes, or use "
      "a board whose hardware makes the edges"};
}

Nanoseconds longest_in_one_plane(const PlaneRules& rules) {
  return std::min(rules.timing.exposure, rules.timing.period) - rules.settle - rules.reaction - kPlaneGuard;
}

Result<PlaneSchedule> plan_planes(std::span<const WantedExposure> wanted, const PlaneRules& rules) {
  SYMRIG_TRY(const Nanoseconds longest, longest_in_planes(rules));
  PlanePlanner planner(rules);
  for (const WantedExposure& one : wanted) {
    if (one.time > longest && !rules.may_cross())
      return Error{ErrorCode::limit,
                   fmt::format("an exposure of {:.4g} ms is longer than the planes of a picture, {:.4g} ms",
                               1e3 * seconds(one.time), 1e3 * seconds(longest)),
                   "use more light, open the aperture, or remove projector.plane_exposure"};
    planner.add(one);
  }
  return planner.finish();
}

namespace {

/// The picture of a shot.
PlanePlan picture_of(const PlaneShot& shot, int number, int bright, int planes) {
  PlanePlan plan(static_cast<std::size_t>(planes), kBlackPlane);
  for (int k = 0; k < planes; ++k)
    if ((shot.lit >> static_cast<unsigned>(k) & 1U) != 0) plan[static_cast<std::size_t>(k)] = bright;
  plan[static_cast<std::size_t>(shot.plane)] = number;
  return plan;
}

}  // namespace

PlaneSchedule plan_shots(std::span<const PlaneShot> shots, std::span<const WantedExposure> wanted, int bright,
                         const PlaneRules& rules) {
  PlaneSchedule out;
  out.pictures.emplace_back(static_cast<std::size_t>(rules.timing.planes), kBlackPlane);
  const auto hold = static_cast<std::size_t>(rules.hold);
  Nanoseconds ready = rules.first;
  for (const WantedExposure& one : wanted) {
    const PlaneShot& shot = shots[one.photograph];
    PlaneExposure at{static_cast<std::int64_t>(out.order.size()), shot.plane, 1, one.time};
    const Nanoseconds after = ready - rig::overlap_before(one.time, rules.overlap);
    if (!out.exposures.empty()) {
      const PlannedExposure& before = out.exposures.back();
      at.refresh = before.at.refresh;
      if (shots[before.what.photograph].lit == shot.lit && shot.plane > before.at.plane &&
          begin_of(at, rules) >= after) {
        out.pictures.back()[static_cast<std::size_t>(shot.plane)] = static_cast<int>(one.photograph);
        out.exposures.push_back({one, at});
        ready = ready_after(at, rules);
        continue;
      }
      at.refresh = static_cast<std::int64_t>(out.order.size());
    }
    for (; begin_of(at, rules) < after; at.refresh += rules.hold) out.order.insert(out.order.end(), hold, 0);
    out.order.insert(out.order.end(), hold, out.pictures.size());
    out.pictures.push_back(picture_of(shot, static_cast<int>(one.photograph), bright, rules.timing.planes));
    out.exposures.push_back({one, at});
    ready = ready_after(at, rules);
  }
  return out;
}

namespace {

/// Edges are this exact, and the clocks of board and controller differ by at most 1/1000.
constexpr Nanoseconds kEdgeError{10'000};
constexpr std::int64_t kClockShare = 1000;

/// The moments at which a line became active.
std::vector<Ticks> rises(const Receipt& receipt, int line, bool active_low) {
  std::vector<Ticks> ticks;
  for (const CapturedEdge& edge : receipt.edges)
    if (edge.line == line && edge.level != active_low) ticks.push_back(edge.tick);
  return ticks;
}

Ticks distance(Ticks a, Ticks b) {
  return a > b ? a - b : b - a;
}

/// Which picture the screen showed in each refresh.
class PictureJudge {
 public:
  PictureJudge(const PlaneSchedule& schedule, const PlaneRules& rules, std::span<const ShownPicture> shown)
      : schedule_(schedule), rules_(rules), shown_(shown) {}

  PlaneProof judge(const SteadyMoment& frame, const PlannedExposure& planned) const {
    const SteadyTime scan_out = frame.at - rules_.timing.latency * rules_.refresh;
    const auto after = std::ranges::find_if(
        shown_, [&](const ShownPicture& one) { return one.shown.since > scan_out + rules_.refresh / 2; });
    if (after == shown_.begin()) return PlaneProof::unclear_refresh;
    const ShownPicture& last = *std::prev(after);
    const Nanoseconds since = scan_out - last.shown.since;
    const auto refreshes = (since + rules_.refresh / 2) / rules_.refresh;
    const Nanoseconds off = since - refreshes * rules_.refresh;
    if (std::max(off, -off) + frame.bound > 3 * rules_.refresh / 8) return PlaneProof::unclear_refresh;
    return judge(last.shown.refresh + static_cast<std::uint64_t>(refreshes), planned);
  }

 private:
  PlaneProof judge(std::uint64_t refresh, const PlannedExposure& planned) const {
    const PlaneExposure& at = planned.at;
    const int planes = rules_.timing.planes;
    for (int k = at.plane; k < at.plane + at.planes; ++k) {
      const auto picture = picture_in(refresh + static_cast<std::uint64_t>(k / planes));
      const int wanted = static_cast<int>(planned.what.photograph);
      if (!picture || schedule_.pattern(*picture, k % planes) != wanted) return PlaneProof::other_picture;
    }
    return PlaneProof::proved;
  }

  std::optional<std::size_t> picture_in(std::uint64_t refresh) const {
    const auto after = std::ranges::upper_bound(shown_, refresh, {},
                                                [](const ShownPicture& one) { return one.shown.refresh; });
    if (after == shown_.begin()) return std::nullopt;
    return std::prev(after)->picture;
  }

  const PlaneSchedule& schedule_;
  const PlaneRules& rules_;
  std::span<const ShownPicture> shown_;
};

/// The edges of one receipt against the plan.
class PlaneJudge {
 public:
  PlaneJudge(const Receipt& receipt, const PlaneLines& lines, const PlaneRules& rules)
      : rate_(receipt.rate),
        rules_(rules),
        frames_(rises(receipt, lines.frame, lines.frame_low)),
        planes_(rises(receipt, lines.plane, lines.plane_low)) {}

  /// The newest frame edge before `begin`.
  std::optional<Ticks> frame_before(Ticks begin) const {
    const auto after = std::upper_bound(frames_.begin(), frames_.end(), begin);
    if (after == frames_.begin()) return std::nullopt;
    return *std::prev(after);
  }

  PlaneProof judge(Ticks frame, const TickPulse& exposure, const PlaneExposure& at) const {
    const auto first = std::lower_bound(planes_.begin(), planes_.end(), frame);
    const auto after = std::upper_bound(first, planes_.end(), exposure.begin);
    if (after - first != at.plane + 1) return PlaneProof::edges_missing;
    for (std::int64_t k = 0; k <= at.plane; ++k) {
      const Ticks due = frame + rate_.ticks(rules_.timing.frame_lead + k * rules_.timing.period);
      const Ticks tolerance = rate_.ticks(kEdgeError + k * rules_.timing.period / kClockShare);
      if (distance(*(first + k), due) > tolerance) return PlaneProof::edges_missing;
    }
    const Ticks begin = *(first + at.plane);
    const bool settled = exposure.begin - begin < rate_.ticks(rules_.timing.period);
    const std::int64_t refreshes = (at.plane + at.planes - 1) / rules_.timing.planes;
    const Nanoseconds lit = at.planes * rules_.timing.period + refreshes * rules_.dark();
    return settled && exposure.end <= begin + rate_.ticks(lit) ? PlaneProof::proved : PlaneProof::other_plane;
  }

 private:
  TickRate rate_;
  const PlaneRules& rules_;
  std::vector<Ticks> frames_, planes_;
};

}  // namespace

std::string_view text_of(PlaneProof proof) {
  switch (proof) {
    case PlaneProof::proved:
      return "proved";
    case PlaneProof::no_exposure:
      return "no exposure";
    case PlaneProof::no_refresh:
      return "no edge of the vsync line before an exposure";
    case PlaneProof::unclear_refresh:
      return "an edge of the vsync line fits to no refresh of the screen";
    case PlaneProof::other_picture:
      return "the screen showed another picture";
    case PlaneProof::edges_missing:
      return "the edges of the plane line are not one a plane";
    case PlaneProof::other_plane:
      return "an exposure was not within its planes";
  }
  return "";
}

Result<std::vector<PlaneProof>> prove_planes(const Receipt& receipt, const PlaneLines& lines,
                                             const PlaneSchedule& schedule, const BoardEvidence& evidence,
                                             const PlaneRules& rules, std::span<const ShownPicture> shown,
                                             const SteadyClock& clock) {
  const PlaneJudge planes(receipt, lines, rules);
  const PictureJudge pictures(schedule, rules, shown);
  std::vector<PlaneProof> proofs(schedule.exposures.size(), PlaneProof::no_exposure);
  for (std::size_t i = 0; i < proofs.size(); ++i) {
    const auto pulse = evidence.pulse_of[i];
    if (!pulse) continue;
    const TickPulse& exposure = evidence.on_board[*pulse];
    const auto frame = planes.frame_before(exposure.begin);
    proofs[i] = PlaneProof::no_refresh;
    if (!frame) continue;
    proofs[i] = planes.judge(*frame, exposure, schedule.exposures[i].at);
    if (proofs[i] != PlaneProof::proved) continue;
    SYMRIG_TRY(const SteadyMoment moment, clock.at(*frame));
    proofs[i] = pictures.judge(moment, schedule.exposures[i]);
  }
  return proofs;
}

std::int64_t late_pictures(std::span<const ShownPicture> shown) {
  std::int64_t late = 0;
  for (std::size_t k = 1; k < shown.size(); ++k)
    late += static_cast<std::int64_t>(shown[k].shown.refresh - shown[k - 1].shown.refresh) - 1;
  return late;
}

}  // namespace symrig
