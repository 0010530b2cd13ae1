// SPDX-License-Identifier: Apache-2.0
#include "rig/camera_ledgers.hpp"

#include "rig/evidence.hpp"
#include "symrig/rig/pairs.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

/// The places of the frames of one camera.
std::vector<std::size_t> places_of(std::size_t camera, std::span<const CameraFrame> frames) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (frames[i].camera == camera) places.push_back(i);
  return places;
}

std::string trouble_of(const FrameCounts& counts, std::size_t camera, std::size_t cameras) {
  std::string trouble = counts.trouble();
  if (trouble.empty() || cameras == 1) return trouble;
  return fmt::format("pair {}: {}", camera + 1, trouble);
}

}  // namespace

JudgedFrames CameraLedgers::judge(std::span<const SeenExposure> exposures, std::vector<CameraFrame> frames,
                                  const Camera& camera) {
  JudgedFrames judged;
  std::vector<std::vector<CameraFrame>> parts(exposures.size());
  for (std::size_t k = 0; k < ledgers_.size(); ++k) {
    const std::vector<std::size_t> places = places_of(k, frames);
    std::vector<SeenFrame> seen;
    seen.reserve(places.size());
    for (const std::size_t i : places) seen.push_back(camera_evidence(frames[i], camera.part(k).noise()));
    const RunIdentity identity = ledgers_[k].judge(exposures, seen);
    judged.counts += identity.counts;
    const std::string trouble = trouble_of(identity.counts, k, ledgers_.size());
    judged.trouble += (judged.trouble.empty() || trouble.empty() ? "" : ", ") + trouble;
    for (std::size_t j = 0; j < exposures.size(); ++j)
      if (identity.frame[j]) parts[j].push_back(std::move(frames[places[*identity.frame[j]]]));
  }
  judged.frame.resize(exposures.size());
  for (std::size_t j = 0; j < exposures.size(); ++j)
    if (parts[j].size() == ledgers_.size())
      judged.frame[j] = ledgers_.size() == 1 ? std::move(parts[j].front()) : join_frames(std::move(parts[j]));
  return judged;
}

void CameraLedgers::restart() {
  for (CameraLedger& ledger : ledgers_) ledger.restart();
}

void CameraLedgers::doubt() {
  for (CameraLedger& ledger : ledgers_) ledger.doubt();
}

bool CameraLedgers::needs_guards() const {
  return std::ranges::any_of(ledgers_, [](const CameraLedger& ledger) { return ledger.needs_guards(); });
}

int CameraLedgers::guards_needed() const {
  int most = 0;
  for (const CameraLedger& ledger : ledgers_) most = std::max(most, ledger.guards_needed());
  return most;
}

}  // namespace symrig
