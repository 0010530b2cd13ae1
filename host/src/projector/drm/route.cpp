// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/text.hpp"
#include "symrig/projector/internal/drm.hpp"

#include <algorithm>
#include <cerrno>
#include <optional>
#include <system_error>

#include <drm_fourcc.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::projector::drm {

Error refusal(const std::string& name, const std::string& what, Errno error) {
  const std::string cause = fmt::format("{}: {} ({})", name, what, std::generic_category().message(error));
  switch (error) {
    case EACCES:
    case EPERM:
      return {ErrorCode::device_lost, name + ": another program has taken over the screen",
              "keep desktops and other viewers off this card, and open the projector again"};
    case ENODEV:
    case ENXIO:
    case ENOENT:
    case EIO:
      return {ErrorCode::device_lost, name + ": the display or its card is lost",
              "connect it, and open the projector again"};
    case ENOMEM:
    case ENOSPC:
      return {ErrorCode::limit, cause,
              "the card has too little memory for pictures of this size: use a smaller mode"};
    case EBUSY:
    case ETIMEDOUT:
      return {ErrorCode::timeout, cause, "check that the projector is on, and open it again"};
    default:
      return {ErrorCode::device_refused, cause,
              "the driver cannot do this: try another mode or another card"};
  }
}

namespace {

/// What the search has found so far.
struct Search {
  std::vector<std::string> connectors;  // full names of all connectors
  std::vector<std::string> connected;
  std::vector<FoundConnector> matches;
  std::optional<Error> unopened;  // the first card that could not be queried
};

bool matches(const std::string& wanted, const std::string& card, const Connector& connector) {
  if (wanted.empty()) return connector.connected;
  return wanted == connector.name || wanted == card + "-" + connector.name;
}

/// Keeps the card open if one of its connectors matches.
void look_at(Search& search, const std::string& card, std::unique_ptr<Kms> kms, const std::string& wanted) {
  const auto resources = kms->resources();
  std::vector<Connector> found;
  for (const std::uint32_t id : resources.value.connectors) {
    auto connector = kms->connector(id, true);
    if (!connector) continue;
    const std::string name = card + "-" + connector.value.name;
    search.connectors.push_back(name);
    if (connector.value.connected) search.connected.push_back(name);
    if (matches(wanted, card, connector.value)) found.push_back(std::move(connector.value));
  }
  for (auto& connector : found) search.matches.push_back({card, nullptr, std::move(connector)});
  if (!found.empty()) search.matches.back().kms = std::move(kms);  // several matches are an error anyway
}

Error none(const Search& search, const std::string& wanted) {
  if (search.unopened && search.matches.empty()) return *search.unopened;
  if (search.connectors.empty())
    return {ErrorCode::device_lost, "this computer has no graphics card for displays",
            "`symrig list` shows projectors"};
  if (wanted.empty())
    return {ErrorCode::device_lost, "no projector is connected",
            fmt::format("connect one to {}", fmt::join(search.connectors, ", "))};
  return {
      ErrorCode::unknown_name, fmt::format("there is no connector '{}'", wanted),
      suggestion(wanted, std::vector<std::string_view>(search.connectors.begin(), search.connectors.end())) +
          fmt::format("this computer has {}", fmt::join(search.connectors, ", "))};
}

Error several(const Search& search, const std::string& wanted) {
  std::vector<std::string> names;
  for (const auto& match : search.matches) names.push_back(match.card + "-" + match.connector.name);
  return {ErrorCode::bad_argument,
          wanted.empty() ? fmt::format("{} displays are connected", names.size())
                         : fmt::format("'{}' matches {} connectors", wanted, names.size()),
          fmt::format("choose one of {}", fmt::join(names, ", "))};
}

}  // namespace

Result<FoundConnector> find_connector(Cards& cards, const std::string& wanted) {
  Search search;
  for (const std::string& card : cards.names()) {
    if (wanted.starts_with("card") && !wanted.starts_with(card + "-")) continue;
    auto kms = cards.open(card);
    if (kms)
      look_at(search, card, *std::move(kms), wanted);
    else if (kms.error().code == ErrorCode::device_lost && !search.unopened)
      search.unopened = kms.error();
  }
  if (search.matches.empty()) return none(search, wanted);
  if (search.matches.size() > 1) return several(search, wanted);
  FoundConnector found = std::move(search.matches.front());
  if (found.connector.connected) return found;
  return Error{ErrorCode::device_lost,
               fmt::format("nothing is connected to {}-{}", found.card, found.connector.name),
               search.connected.empty()
                   ? "connect the projector and switch it on"
                   : fmt::format("a display is connected to {}", fmt::join(search.connected, ", "))};
}

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
  const auto properties = kms.properties(plane.id, ObjectKind::plane);
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
