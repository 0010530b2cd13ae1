// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/saved_screen.hpp"

namespace symrig::projector::drm {

SavedScreen SavedScreen::take(Kms& kms, const Route& route) {
  SavedScreen saved;
  saved.crtc_ = kms.crtc(route.crtc).value;
  saved.crtc_.id = route.crtc;
  const auto connector = kms.connector(route.connector, false);
  if (connector.value.crtc == route.crtc) saved.connectors_.push_back(route.connector);
  saved.connectors_.insert(saved.connectors_.end(), route.other_connectors.begin(),
                           route.other_connectors.end());
  return saved;
}

void SavedScreen::remember(Kms& kms, const IdentityValue& identity) {
  SavedProperty saved{identity.setting, {}};
  saved.setting.value = identity.property.value;
  if (identity.property.blob && identity.property.value != 0)
    saved.blob = kms.blob(static_cast<std::uint32_t>(identity.property.value)).value;
  properties_.push_back(std::move(saved));
}

void SavedScreen::restore(Kms& kms) const {
  std::vector<std::uint32_t> blobs;
  for (const SavedProperty& saved : properties_) {
    Setting setting = saved.setting;
    if (!saved.blob.empty()) {
      const auto blob = kms.create_blob(saved.blob);
      if (!blob) continue;
      blobs.push_back(blob.value);
      setting.value = blob.value;
    }
    kms.set_property(setting);
  }
  const bool was_on = crtc_.mode && crtc_.fb != 0 && !connectors_.empty();
  if (!was_on || kms.set_crtc(crtc_, connectors_) != 0) kms.set_crtc(Crtc{.id = crtc_.id}, {});
  if (gamma_) kms.set_gamma(crtc_.id, *gamma_);
  for (const std::uint32_t blob : blobs) kms.destroy_blob(blob);  // the CRTC keeps the blobs that it uses
}

}  // namespace symrig::projector::drm
