// SPDX-License-Identifier: Apache-2.0
// What a simulated pair knows of the scene, and the request "develop" to one, as bytes
// (docs/pair-protocol.md).
#pragma once

#include "sim/image_source.hpp"
#include "symrig/base/result.hpp"
#include "symrig/rig/pairs.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/simulated_pairs.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::sim {

/// A scene in front of several pairs.
struct PairScene {
  SceneUri uri;
  PairLayout layout;
};
/// fails: as parse_scene_uri; bad_argument (pairs cannot have this scene).
Result<PairScene> parse_pair_scene(std::string_view uri, ViewLayout pairs);

inline constexpr std::size_t kMostPatterns = 64;    // of one request
inline constexpr std::size_t kMostExposures = 256;  // of one request
inline constexpr double kLongestExposure = 86'400;  // seconds

/// "develop PATTERNS EXPOSURES".
struct DevelopHeader {
  std::size_t patterns = 0, exposures = 0;
};
/// none: not such a line, or too many.
std::optional<DevelopHeader> parse_develop(std::string_view line);

/// What follows the header.
std::vector<std::byte> encode_develop(std::span<const LitPattern> patterns,
                                      std::span<const LitExposure> exposures);

/// The fixed part of an exposure; its shares follow.
struct ExposureHead {
  double seconds = 0;
  std::uint64_t noise = 0;
  std::uint64_t shares = 0;
};
struct ShareRecord {
  std::uint64_t pattern = 0;
  double share = 0;
};

/// Bytes of a frame with these values.
std::size_t frame_bytes(bool noisy, std::int64_t values);

/// The frames of one pair, developed in the pair's own process.
class RemoteImages final : public ImageSource {
 public:
  /// frame: the grid of its frames. facts: what the pair must state of itself each time it is connected.
  RemoteImages(LinkedPair pair, PairLink::KeepWaiting keep_waiting, bool noisy, Grid frame, int channels);

  /// Connects again if the connection is lost.
  Result<void> open() override;
  Result<std::vector<CameraFrame>> develop(std::span<const LitPattern> patterns,
                                           std::span<const LitExposure> exposures) override;

 private:
  Result<void> develop_some(std::span<const LitPattern> patterns, std::span<const LitExposure> exposures,
                            std::vector<CameraFrame>& frames);
  Result<CameraFrame> receive(std::size_t number);
  std::string identity() const;

  LinkedPair pair_;
  PairLink::KeepWaiting keep_waiting_;
  bool noisy_;
  Grid frame_;
  int channels_;
  std::string identity_;
};

}  // namespace symrig::sim
