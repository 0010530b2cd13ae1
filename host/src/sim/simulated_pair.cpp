// SPDX-License-Identifier: Apache-2.0
// One pair of a simulated scene, behind a socket.
#include "rig/exec/client_talk.hpp"
#include "sim/pair_request.hpp"
#include "sim/pair_scene.hpp"
#include "symrig/sim/simulated_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {
namespace {

constexpr std::size_t kQuotedRequest = 60;

Error bad_request(std::string what) {
  return {ErrorCode::protocol, std::move(what), "see docs/pair-protocol.md"};
}

template <class T>
bool receive_one(rig::ClientTalk& talk, T& value) {
  return talk.receive(std::as_writable_bytes(std::span(&value, 1)));
}

class SimulatedPair final : public PairService {
 public:
  SimulatedPair(PairScene scene, Bench bench, std::size_t pair)
      : scene_(std::move(scene)),
        bench_(std::move(bench)),
        pair_(pair),
        images_(scene_.uri, *bench_.view, scene_.layout.tile(pair)) {}

  std::string facts() const override {
    return fmt::format("kind=simulated pair={} layout={} scene={}", pair_ + 1,
                       to_string(scene_.layout.layout), scene_.uri.to_string());
  }

  Result<bool> answer(const std::string& request, rig::ClientTalk& talk) override {
    const auto header = parse_develop(request);
    if (!header)
      return bad_request(fmt::format("'{}' is not 'develop PATTERNS EXPOSURES' with at most {} and {}",
                                     request.substr(0, kQuotedRequest), kMostPatterns, kMostExposures));
    std::vector<Pattern> patterns(header->patterns, Pattern(scene_.layout.cells));
    std::vector<LitPattern> lit(header->patterns);
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      if (!receive_one(talk, lit[i].shown_before) ||
          !talk.receive(std::as_writable_bytes(patterns[i].values())))
        return false;
      if (!std::ranges::all_of(patterns[i].values(), [](float v) { return v >= 0 && v <= 1; }))
        return bad_request(fmt::format("pattern {} has values that are not from 0 to 1", i + 1));
      lit[i].pattern = &patterns[i];
    }
    std::vector<LitExposure> exposures(header->exposures);
    for (LitExposure& exposure : exposures) {
      SYMRIG_TRY(const bool there, receive_exposure(talk, patterns.size(), exposure));
      if (!there) return false;
    }
    SYMRIG_TRY(const auto frames, images_.develop(lit, exposures));
    for (std::size_t k = 0; k < frames.size(); ++k)
      if (!send(k + 1, frames[k], talk)) return false;
    return true;
  }

 private:
  /// false: the host has gone.
  static Result<bool> receive_exposure(rig::ClientTalk& talk, std::size_t patterns, LitExposure& exposure) {
    ExposureHead head;
    if (!receive_one(talk, head)) return false;
    if (!(head.seconds > 0 && head.seconds <= kLongestExposure) || head.shares > kMostPatterns)
      return bad_request(fmt::format("an exposure of {} s with {} patterns", head.seconds, head.shares));
    exposure.seconds = head.seconds;
    exposure.noise = head.noise;
    for (std::uint64_t i = 0; i < head.shares; ++i) {
      ShareRecord record;
      if (!receive_one(talk, record)) return false;
      if (record.pattern >= patterns || !(record.share >= 0 && record.share <= 1))
        return bad_request(fmt::format("an exposure names pattern {} of {} with the share {}",
                                       record.pattern + 1, patterns, record.share));
      exposure.shares.push_back({static_cast<std::uint32_t>(record.pattern), record.share});
    }
    return true;
  }

  static bool send(std::size_t number, const CameraFrame& frame, rig::ClientTalk& talk) {
    const auto* light = std::any_cast<ImageFormation::Light>(&frame.attachment);
    const auto bytes =
        light == nullptr ? std::as_bytes(std::span(frame.raw)) : std::as_bytes((*light)->values());
    return talk.send(fmt::format("frame {} {}\n", number, bytes.size())) && talk.send(bytes);
  }

  PairScene scene_;
  Bench bench_;
  std::size_t pair_;
  LocalImages images_;
};

}  // namespace
}  // namespace symrig::sim

namespace symrig {

Result<std::unique_ptr<PairService>> make_simulated_pair(std::string_view uri, ViewLayout pairs,
                                                         std::size_t pair) {
  SYMRIG_TRY(sim::PairScene scene, sim::parse_pair_scene(uri, pairs));
  if (pair >= scene.layout.count())
    return Error{ErrorCode::bad_argument,
                 fmt::format("there is no pair {} in a layout of {}", pair + 1, to_string(pairs)),
                 fmt::format("give a pair from 1 to {}", scene.layout.count())};
  SYMRIG_TRY(auto bench, sim::make_bench(scene.uri));
  return std::unique_ptr<PairService>(
      std::make_unique<sim::SimulatedPair>(std::move(scene), std::move(bench), pair));
}

}  // namespace symrig
