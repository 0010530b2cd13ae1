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
    // The picture stays until the end of the run, so whole refreshes see nothing but its planes.
    const bool inside =
        over_refreshes(at, rules_) || exposure.end <= begin + rate_.ticks(at.planes * rules_.timing.period);
    return settled && inside ? PlaneProof::proved : PlaneProof::other_plane;
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
    case PlaneProof::earlier_picture:
      return "an exposure came before the planes of its picture";
    case PlaneProof::edges_missing:
      return "the edges of the plane line are not one a plane";
    case PlaneProof::other_plane:
      return "an exposure was not within its planes";
  }
  return "";
}

Result<std::vector<PlaneProof>> prove_planes(const Receipt& receipt, const PlaneLines& lines,
                                             std::span<const PlannedExposure> planned,
                                             const BoardEvidence& evidence, const PlaneRules& rules,
                                             SteadyTime since, const SteadyClock& clock) {
  const PlaneJudge judge(receipt, lines, rules);
  // Half a refresh before: the frame edge of the picture itself comes a lead before its planes.
  const SteadyTime earliest = since + (2 * rules.timing.latency - 1) * rules.refresh / 2;
  std::vector<PlaneProof> proofs(planned.size(), PlaneProof::no_exposure);
  for (std::size_t i = 0; i < planned.size(); ++i) {
    const auto pulse = evidence.pulse_of[i];
    if (!pulse) continue;
    const TickPulse& exposure = evidence.pulses[*pulse];
    const auto frame = judge.frame_before(exposure.begin);
    proofs[i] = PlaneProof::no_refresh;
    if (!frame) continue;
    SYMRIG_TRY(const SteadyMoment moment, clock.at(*frame));
    proofs[i] = PlaneProof::earlier_picture;
    if (moment.at - moment.bound < earliest) continue;
    proofs[i] = judge.judge(*frame, exposure, planned[i].at);
  }
  return proofs;
}

}  // namespace symrig
