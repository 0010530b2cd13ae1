// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/kms.hpp"

#include <string>
#include <vector>

namespace symrig::projector::drm {

/// A property that can change pictures on their way from memory to light, and its identity value.
struct IdentityValue {
  Setting setting;
  Property property;     // its state before
  std::string wanted;    // the value's name: "Full", "0"
  bool must = false;     // true: without it pixels would be wrong, which is an error; false: a warning
  bool possible = true;  // the property has this value and can be set
};

/// The identity values for all known properties of one object.
/// Documentation: Linux, Documentation/gpu/drm-kms.rst (standard properties); the driver's sources for its
/// own properties.
std::vector<IdentityValue> identity_values(std::uint32_t object, Kind kind,
                                           std::span<const Property> properties);

/// The identity table: v(i) = 65535·i / (size − 1), rounded.
Gamma straight_gamma(int size);

/// "connector property 'Broadcast RGB' is 'Limited 16:235' and cannot be 'Full'"
std::string complaint(const IdentityValue& identity);

}  // namespace symrig::projector::drm
