// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace symrig::drm {

/// The display's name from its EDID (VESA E-EDID 1.4 §3.10.3, display product name descriptor). Empty if the
/// EDID has no name or is invalid.
std::string display_name(std::span<const std::byte> edid);

}  // namespace symrig::drm
