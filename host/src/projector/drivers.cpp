// SPDX-License-Identifier: Apache-2.0
// The table of projector drivers. A new driver is a folder beside drm, and its header and a line here
// (CONTRIBUTING.md).
#include "projector/dlpc350/dlpc350_driver.hpp"
#include "projector/dlpc900/dlpc900_driver.hpp"
#include "projector/driver.hpp"
#include "projector/drm/drm_driver.hpp"
#include "projector/folder/folder_driver.hpp"

#include <algorithm>
#include <array>

namespace symrig::projector {

std::span<const ProjectorDriver> projector_drivers() {
  static constexpr std::array kDrivers{
      drm_driver(),
      folder_driver(),
      dlpc350_driver(),
      dlpc900_driver(),
  };
  return kDrivers;
}

const ProjectorDriver* usual_driver(const base::TableReader& table) {
  const auto drivers = projector_drivers();
  const auto named = std::ranges::find_if(drivers, [&table](const ProjectorDriver& driver) {
    return !driver.key.empty() && table.has(driver.key);
  });
  return named == drivers.end() ? drivers.data() : &*named;
}

}  // namespace symrig::projector
