// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/route.hpp"

#include <algorithm>
#include <optional>

#include <drm_fourcc.h>

namespace symrig::projector::drm {
namespace {

/// A CRTC that can drive a connector, and its index in the card's list. Plane masks use this index.
struct ChosenCrtc {
  std::uint32_t id = 0;
  std::size_t place = 0;
};

/// Pairs of a connector and the CRTC that drives it now.
using Driven = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

Driven driven_connectors(Kms& kms, const Resources& resources) {
  Driven driven;
  for (const std::uint32_t id : resources.connectors)
    if (const auto connector = kms.connector(id, false); connector && connector.value.crtc != 0)
      driven.emplace_back(id, connector.value.crtc);
  return driven;
}

/// Lower is better: the CRTC drives this connector, is free, or drives another connector.
int cost(std::uint32_t crtc, const Connector& connector, const Driven& driven) {
  if (connector.crtc == crtc) return 0;
  return std::any_of(driven.begin(), driven.end(), [&](const auto& each) { return each.second == crtc; }) ? 2
                                                                                                          : 1;
}

std::optional<ChosenCrtc> choose_crtc(const Resources& resources, const Connector& connector,
                                      const Driven& driven) {
  std::optional<ChosenCrtc> best;
  for (std::size_t k = 0; k < resources.crtcs.size(); ++k) {
    const std::uint32_t id = resources.crtcs[k];
    if ((connector.possible_crtcs >> k & 1U) == 0) continue;
    if (!best || cost(id, connector, driven) < cost(best->id, connector, driven)) best = {id, k};
  }
  return best;
}

bool is_primary(Kms& kms, const Plane& plane) {
  const auto properties = kms.properties(plane.id, Kind::plane);
  for (const Property& property : properties.value)
    if (property.name == "type") return property.value == DRM_PLANE_TYPE_PRIMARY;
  return false;
}

bool shows_pictures(const Plane& plane) {
  return std::find(plane.formats.begin(), plane.formats.end(), DRM_FORMAT_XRGB8888) != plane.formats.end();
}

/// Many primary planes can go to any CRTC. Prefers the plane that the CRTC shows now, then the first unused
/// one.
void choose_planes(Kms& kms, const ChosenCrtc& crtc, Route& route) {
  const auto planes = kms.planes();
  const Plane* best = nullptr;
  for (const Plane& plane : planes.value) {
    if ((plane.possible_crtcs >> crtc.place & 1U) == 0 || !shows_pictures(plane) || !is_primary(kms, plane))
      continue;
    if (plane.crtc == crtc.id || (best == nullptr && plane.crtc == 0)) best = &plane;
  }
  if (best != nullptr) route.plane = best->id;
  for (const Plane& plane : planes.value)
    if (plane.crtc == crtc.id && plane.id != route.plane) route.other_planes.push_back(plane.id);
}

}  // namespace

Result<Route> choose_route(Kms& kms, const FoundConnector& found, const ModeRequest& request) {
  Route route;
  route.connector_name = found.card + "-" + found.connector.name;
  route.connector = found.connector.id;
  SYMRIG_TRY(route.mode, choose_mode(found.connector.modes, request, route.connector_name));
  const auto resources = kms.resources();
  if (!resources) return refusal(route.connector_name, "its card does not respond", resources.error);
  const Driven driven = driven_connectors(kms, resources.value);
  const auto crtc = choose_crtc(resources.value, found.connector, driven);
  if (!crtc)
    return Error{ErrorCode::device_refused, route.connector_name + ": the card has no CRTC for it",
                 "use another connector"};
  route.crtc = crtc->id;
  for (const auto& [connector, its_crtc] : driven)
    if (its_crtc == crtc->id && connector != route.connector) route.other_connectors.push_back(connector);
  choose_planes(kms, *crtc, route);
  return route;
}

}  // namespace symrig::projector::drm
