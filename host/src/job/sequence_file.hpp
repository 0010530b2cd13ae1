// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/job/relight_sequence.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace symrig::job {

/// What the pictures of an output folder are made of. A resumed job trusts only pictures that it lists.
struct SequenceFile {
  std::string scene;                              ///< SHA-256
  std::string asked;                              ///< as SequenceOutput::asked
  double exposure = 0;                            ///< 0: pictures of radiance
  std::map<std::string, std::uint32_t> pictures;  ///< file name → light_digest of its light

  /// fails: io, bad_format (not such a file; names it).  Nothing if there is none.
  static Result<std::optional<SequenceFile>> read(const std::filesystem::path& folder);
  Result<void> write(const std::filesystem::path& folder) const;
};

/// CRC-32C of a light's values: an accidental change is seen.
std::uint32_t light_digest(const Image<float>& light);

}  // namespace symrig::job
