// SPDX-License-Identifier: Apache-2.0
#include "rig/plane_evidence.hpp"

#include <algorithm>
#include <iterator>
#include <optional>

namespace symrig {
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
