// SPDX-License-Identifier: Apache-2.0
// The objects of a card: connectors, CRTCs, planes and their properties. This file copies libdrm's lists and
// frees them at once.
#include "projector/drm/libdrm_kms.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <xf86drm.h>

namespace symrig::projector::drm {
namespace {

/// Frees what libdrm allocated, with libdrm's own function.
template <auto free_it>
struct Freer {
  template <class T>
  void operator()(T* pointer) const {
    free_it(pointer);
  }
};
template <class T, auto free_it>
using Owned = std::unique_ptr<T, Freer<free_it>>;

/// A list from libdrm. Its count is an int in some structures and unsigned in others.
template <class T, class Count>
std::span<const T> list(const T* items, Count count) {
  return {items, items == nullptr ? 0 : static_cast<std::size_t>(count)};
}

template <class T, class Count>
std::vector<T> copy(const T* items, Count count) {
  const auto all = list(items, count);
  return {all.begin(), all.end()};
}

/// errno of a libdrm call that has just returned null.
Errno last_error() {
  return errno != 0 ? errno : EIO;
}

std::string connector_name(const drmModeConnector& connector) {
  const char* type = drmModeGetConnectorTypeName(connector.connector_type);
  return fmt::format("{}-{}", type != nullptr ? type : "Unknown", connector.connector_type_id);
}

std::uint32_t current_crtc(int fd, const drmModeConnector& connector) {
  if (connector.encoder_id == 0) return 0;
  const Owned<drmModeEncoder, drmModeFreeEncoder> encoder(drmModeGetEncoder(fd, connector.encoder_id));
  return encoder ? encoder->crtc_id : 0;
}

Property describe_property(const drmModePropertyRes& raw) {
  Property property;
  property.id = raw.prop_id;
  property.name = std::string(raw.name, strnlen(raw.name, sizeof raw.name));
  property.immutable = (raw.flags & DRM_MODE_PROP_IMMUTABLE) != 0;
  const std::uint32_t type = drmModeGetPropertyType(&raw);
  property.blob = type == DRM_MODE_PROP_BLOB;
  for (const auto& choice : list(raw.enums, raw.count_enums))
    property.choices.emplace_back(
        std::string(choice.name, strnlen(choice.name, sizeof choice.name)),
        type == DRM_MODE_PROP_BITMASK ? std::uint64_t{1} << choice.value : choice.value);
  if ((type == DRM_MODE_PROP_RANGE || type == DRM_MODE_PROP_SIGNED_RANGE) && raw.count_values == 2)
    property.range = {{raw.values[0], raw.values[1]}};
  return property;
}

}  // namespace

Answer<Resources> LibdrmKms::resources() {
  errno = 0;
  const Owned<drmModeRes, drmModeFreeResources> raw(drmModeGetResources(fd()));
  if (!raw) return {last_error(), {}};
  return {0, {copy(raw->crtcs, raw->count_crtcs), copy(raw->connectors, raw->count_connectors)}};
}

Answer<Connector> LibdrmKms::connector(std::uint32_t id, bool probe) {
  errno = 0;
  const Owned<drmModeConnector, drmModeFreeConnector> raw(probe ? drmModeGetConnector(fd(), id)
                                                                : drmModeGetConnectorCurrent(fd(), id));
  if (!raw) return {last_error(), {}};
  Connector connector;
  connector.id = id;
  connector.name = connector_name(*raw);
  connector.connected = raw->connection == DRM_MODE_CONNECTED;
  connector.modes = copy(raw->modes, raw->count_modes);
  connector.possible_crtcs = drmModeConnectorGetPossibleCrtcs(fd(), raw.get());
  connector.crtc = current_crtc(fd(), *raw);
  return {0, std::move(connector)};
}

Answer<Crtc> LibdrmKms::crtc(std::uint32_t id) {
  errno = 0;
  const Owned<drmModeCrtc, drmModeFreeCrtc> raw(drmModeGetCrtc(fd(), id));
  if (!raw) return {last_error(), {}};
  Crtc crtc{.id = id, .fb = raw->buffer_id, .x = raw->x, .y = raw->y, .gamma_size = raw->gamma_size};
  if (raw->mode_valid != 0) crtc.mode = raw->mode;
  return {0, crtc};
}

Answer<Plane> LibdrmKms::plane(std::uint32_t id) {
  errno = 0;
  const Owned<drmModePlane, drmModeFreePlane> raw(drmModeGetPlane(fd(), id));
  if (!raw) return {last_error(), {}};
  return {0, {id, raw->possible_crtcs, raw->crtc_id, copy(raw->formats, raw->count_formats)}};
}

Answer<std::vector<Plane>> LibdrmKms::planes() {
  errno = 0;
  const Owned<drmModePlaneRes, drmModeFreePlaneResources> raw(drmModeGetPlaneResources(fd()));
  if (!raw) return {last_error(), {}};
  Answer<std::vector<Plane>> planes;
  for (const std::uint32_t id : list(raw->planes, raw->count_planes)) {
    auto found = plane(id);
    if (!found) return {found.error, {}};
    planes.value.push_back(std::move(found.value));
  }
  return planes;
}

const Property& LibdrmKms::kind_of(std::uint32_t property) {
  const auto known = kinds_.find(property);
  if (known != kinds_.end()) return known->second;
  const Owned<drmModePropertyRes, drmModeFreeProperty> raw(drmModeGetProperty(fd(), property));
  return kinds_.emplace(property, raw ? describe_property(*raw) : Property{.id = property}).first->second;
}

Answer<std::vector<Property>> LibdrmKms::properties(std::uint32_t object, Kind kind) {
  errno = 0;
  const Owned<drmModeObjectProperties, drmModeFreeObjectProperties> raw(
      drmModeObjectGetProperties(fd(), object, static_cast<std::uint32_t>(kind)));
  if (!raw) return {last_error(), {}};
  Answer<std::vector<Property>> properties;
  const auto values = list(raw->prop_values, raw->count_props);
  for (std::size_t k = 0; k < values.size(); ++k) {
    properties.value.push_back(kind_of(raw->props[k]));
    properties.value.back().value = values[k];
  }
  return properties;
}

Answer<std::vector<std::byte>> LibdrmKms::blob(std::uint32_t id) {
  errno = 0;
  const Owned<drmModePropertyBlobRes, drmModeFreePropertyBlob> raw(drmModeGetPropertyBlob(fd(), id));
  if (!raw) return {last_error(), {}};
  return {0, copy(static_cast<const std::byte*>(raw->data), raw->length)};
}

}  // namespace symrig::projector::drm
