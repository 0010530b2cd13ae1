// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/driver.hpp"

namespace symrig::projector {

std::unique_ptr<ProjectorSource> read_folder_projector(base::TableReader& table);

/// Projectors with their own memory. They get patterns as a folder of pictures.
constexpr ProjectorDriver folder_driver() {
  return {"folder", "a folder of pictures for a projector with its own memory", "folder",
          read_folder_projector};
}

}  // namespace symrig::projector
