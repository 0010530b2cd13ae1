// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/identity.hpp"
#include "projector/drm/route.hpp"

namespace symrig::projector::drm {

/// The state of a screen before symrig took it. It can be restored.
class SavedScreen {
 public:
  /// Saves mode, picture and connectors of a route's CRTC.
  static SavedScreen take(Kms& kms, const Route& route);
  /// Saves a property before it is set. Copies a blob's bytes, because its owner may have ended before the
  /// restore.
  void remember(Kms& kms, const IdentityValue& identity);
  void remember(Gamma gamma) { gamma_ = std::move(gamma); }
  /// Restores as much as the kernel allows. If the owner of the picture has ended, the screen goes off. The
  /// kernel's console then takes it when the card is closed.
  void restore(Kms& kms) const;

 private:
  struct SavedProperty {
    Setting setting;
    std::vector<std::byte> blob;  // empty: the value is a number
  };

  Crtc crtc_;
  std::vector<std::uint32_t> connectors_;
  std::optional<Gamma> gamma_;
  std::vector<SavedProperty> properties_;
};

}  // namespace symrig::projector::drm
