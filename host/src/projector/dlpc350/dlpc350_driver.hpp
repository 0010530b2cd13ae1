// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/driver.hpp"

namespace symrig::projector {

std::unique_ptr<ProjectorSource> read_dlpc350_projector(base::TableReader& table);

/// Projectors with a DLPC350, such as the LightCrafter 4500, in video-pattern mode.
constexpr ProjectorDriver dlpc350_driver() {
  return {"dlpc350", "a DLPC350 that splits the pictures of a screen into bit planes", "controller",
          read_dlpc350_projector};
}

}  // namespace symrig::projector
