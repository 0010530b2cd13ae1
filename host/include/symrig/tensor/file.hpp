// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace symrig {

/// A photograph that was not used to make the tensor, kept to tell its error.
struct HeldOut {
  std::string name;
  Image<float> pattern;     ///< projector grid, 1 channel
  Image<float> photograph;  ///< camera grid, tensor channels
};

/// What a scene.h5 holds: the tensor, how it was captured, and photographs to judge it by.
struct StoredScene {
  TransportTensor tensor;
  std::string capture_json = "{}";  ///< the `--json` of the command that made it (docs/command-line.md)
  std::vector<HeldOut> held_out;
};

/// Writes scene.h5 (HDF5, docs/file-format.md) atomically: a temporary file beside it, fsync, rename.
/// fails: io. Never leaves a half-written file under `path`.
Result<void> save_scene(const std::filesystem::path& path, const StoredScene& scene);

/// Reads scene.h5. Checks version, sizes and every index before anything is trusted; NaN and infinity are
/// refused. fails: not_found, io, bad_format, bad_value.
Result<StoredScene> load_scene(const std::filesystem::path& path);

}  // namespace symrig
