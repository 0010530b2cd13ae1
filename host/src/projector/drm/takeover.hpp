// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/route.hpp"
#include "projector/drm/saved_screen.hpp"

#include <string>
#include <vector>

namespace symrig::projector::drm {

/// Makes a route show framebuffer `fb` in its mode. Sets everything between framebuffer and cable to
/// identity, and reads it all back. Less important properties that cannot be identity become `warnings`.
/// blobs: created here; the caller destroys them.
/// fails: device_refused (the mode, or a property that changes pixels), device_lost, limit.
struct Takeover {
  Kms& kms;
  const Route& route;
  SavedScreen& saved;
  std::vector<std::string>& warnings;
  std::vector<std::uint32_t>& blobs;

  /// With one atomic commit, which is tested first.
  Result<void> atomic(std::uint32_t fb);
  /// With single calls, for drivers without atomic commits.
  Result<void> legacy(std::uint32_t fb);

 private:
  Result<std::vector<IdentityValue>> identities();
  Result<std::vector<Setting>> base_settings(std::uint32_t fb);
  Result<void> cannot(const IdentityValue& identity);
  Result<void> verify(std::span<const Setting> settings, std::span<const IdentityValue> kept);
  Result<void> straighten_gamma();
};

}  // namespace symrig::projector::drm
