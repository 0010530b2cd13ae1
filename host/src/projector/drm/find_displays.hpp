// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/kms.hpp"
#include "symrig/projector/display.hpp"

namespace symrig::projector::drm {

/// symrig::find_displays() on these cards.
std::vector<Display> find_displays(Cards& cards);

}  // namespace symrig::projector::drm
