// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/route.hpp"
#include "projector/drm/saved_screen.hpp"

#include <string>
#include <vector>

namespace symrig::projector::drm {

/// Makes a route show framebuffer `fb` in its mode, with everything between it and the wire set to identity,
/// and reads all of it back. What cannot be identity and only may matter is added to `warnings`. blobs: made
/// on the way, to be destroyed by the caller.
/// fails: device_refused (the mode, or a property that changes pixels), device_lost, limit.
struct Takeover {
  Kms& kms;
  const Route& route;
  SavedScreen& saved;
  std::vector<std::string>& warnings;
  std::vector<std::uint32_t>& blobs;

  /// In one atomic commit, tried before it is done.
  Result<void> atomic(std::uint32_t fb);
  /// Call by call, for drivers without atomic commits.
  Result<void> legacy(std::uint32_t fb);

 private:
  Result<std::vector<Wish>> wishes();
  Result<std::vector<Setting>> base_settings(std::uint32_t fb);
  Result<void> cannot(const Wish& wish);
  Result<void> verify(std::span<const Setting> settings, std::span<const Wish> kept);
  Result<void> straighten_gamma();
};

}  // namespace symrig::projector::drm
