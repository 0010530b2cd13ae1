// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/identity.hpp"
#include "projector/drm/route.hpp"

namespace symrig::projector::drm {

/// What a screen was before we took it, and how to give it back.
class SavedScreen {
 public:
  /// Remembers mode, picture and connectors of a route's CRTC.
  static SavedScreen take(Kms& kms, const Route& route);
  /// Remembers a property that is about to be set; of a blob its bytes, because its owner may be gone by
  /// then.
  void remember(Kms& kms, const Wish& wish);
  void remember(Gamma gamma) { gamma_ = std::move(gamma); }
  /// As far as the kernel lets it: a picture whose owner is gone leaves the screen off, and the kernel's
  /// console takes it once the card is closed.
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
