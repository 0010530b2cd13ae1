// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <filesystem>
#include <optional>
#include <string>

namespace symrig {

/// What the header of an OpenEXR file states beside its pixels (docs/images.md). Empty parts are left out.
struct PictureFacts {
  std::string units = {};  ///< of the values
  std::optional<double> exposure =
      {};                  ///< factor that maps white to 1 on a screen; the values are without it
  std::string view = {};   ///< who sees it: "camera", "projector"
  std::string light = {};  ///< the light that the scene is under
  std::string scene = {};  ///< SHA-256 of the scene file

  bool operator==(const PictureFacts&) const = default;
};

/// Reads what an OpenEXR file states. Other pictures, and files of other programs, state nothing.
/// fails: not_found, io, bad_format (a damaged OpenEXR header).
Result<PictureFacts> read_picture_facts(const std::filesystem::path& path);

}  // namespace symrig
