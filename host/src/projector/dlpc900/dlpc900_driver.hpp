// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/driver.hpp"

namespace symrig::projector {

std::unique_ptr<ProjectorSource> read_dlpc900_projector(base::TableReader& table);

/// Projectors with a DLPC900, such as the LightCrafter 6500 and 9000, in video-pattern mode.
constexpr ProjectorDriver dlpc900_driver() {
  return {"dlpc900", "a DLPC900 that splits the pictures of a screen into bit planes", "",
          read_dlpc900_projector};
}

}  // namespace symrig::projector
