// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/kms.hpp"
#include "symrig/projector/display.hpp"

#include <cstddef>
#include <span>
#include <string>

namespace symrig::projector::drm {

/// symrig::find_displays() on these cards.
std::vector<Display> find_displays(Cards& cards);

/// The name that a display gives itself (VESA E-EDID 1.4 §3.10.3, display product name descriptor); empty if
/// it gives none or this is no EDID.
std::string display_name(std::span<const std::byte> edid);

}  // namespace symrig::projector::drm
