// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/kms.hpp"
#include "symrig/projector/display.hpp"

#include <cstddef>
#include <span>
#include <string>

namespace symrig::projector::drm {

/// symrig::find_displays() for these cards.
std::vector<Display> find_displays(Cards& cards);

/// The display's name from its EDID (VESA E-EDID 1.4 §3.10.3, display product name descriptor). Empty if the
/// EDID has no name or is invalid.
std::string display_name(std::span<const std::byte> edid);

}  // namespace symrig::projector::drm
