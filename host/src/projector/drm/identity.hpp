// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/kms.hpp"

#include <string>
#include <vector>

namespace symrig::projector::drm {

/// A property between a picture in memory and the light, and the value with which it changes nothing.
struct Wish {
  Setting setting;
  Property property;     // as it was found
  std::string wanted;    // the value by name: "Full", "0"
  bool must = false;     // without it pixels are not what was asked for: an error, else a warning
  bool possible = true;  // the property has such a value and can be set
};

/// What must be set on one object to make it pass pictures through unchanged; only properties that it has.
/// Docs: Linux, Documentation/gpu/drm-kms.rst (standard properties), and the drivers for their own.
std::vector<Wish> identity_wishes(std::uint32_t object, Kind kind, std::span<const Property> properties);

/// The codes of a table that changes nothing: v(i) = 65535·i / (size − 1), rounded.
Gamma straight_gamma(int size);

/// "connector property 'Broadcast RGB' is 'Limited 16:235' and cannot be 'Full'"
std::string complaint(const Wish& wish);

}  // namespace symrig::projector::drm
