// SPDX-License-Identifier: Apache-2.0
// The table of projector drivers. A new driver is a folder beside drm, and its function here
// (CONTRIBUTING.md).
#include "symrig/projector/internal/driver.hpp"

#include <algorithm>
#include <array>

namespace symrig::projector {

// Each is in the driver's folder.
ProjectorDriver drm_driver();
ProjectorDriver folder_driver();
ProjectorDriver dlpc350_driver();
ProjectorDriver dlpc900_driver();

std::span<const ProjectorDriver> projector_drivers() {
  static const std::array drivers{
      drm_driver(),
      folder_driver(),
      dlpc350_driver(),
      dlpc900_driver(),
  };
  return drivers;
}

const ProjectorDriver* usual_driver(const base::TableReader& table) {
  const auto drivers = projector_drivers();
  const auto named = std::ranges::find_if(drivers, [&table](const ProjectorDriver& driver) {
    return !driver.key.empty() && table.has(driver.key);
  });
  return named == drivers.end() ? drivers.data() : &*named;
}

}  // namespace symrig::projector
