// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/stored_image.hpp"
#include "symrig/tensor/camera_transport.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace symrig {

/// A held-out photograph: not used to make the tensor, kept to estimate its error.
struct HeldOut {
  std::string name;
  StoredImage pattern;     ///< projector grid, 1 channel
  StoredImage photograph;  ///< camera grid, tensor channels
};

/// The content of a scene.h5: the tensor, how it was captured, held-out photographs, and T on the camera's
/// own pixels where it is known.
struct StoredScene {
  TransportTensor tensor;
  std::string capture_json = "{}";  ///< the `--json` of the command that made it (docs/command-line.md)
  std::vector<HeldOut> held_out;
  std::shared_ptr<const CameraTransport> camera = {};  ///< of a camera with pixels of its own; or none
  bool camera_left_out = false;                        ///< the file has it, but LoadOptions::camera was false
};

/// Writes scene.h5 (HDF5, docs/file-format.md) atomically: a temporary file beside it, fsync, rename.
/// work: counts the bytes.  fails: io; bad_argument (a camera of another scene).  throws: Stopped. Never
/// leaves a half-written file under `path`.
Result<void> save_scene(const std::filesystem::path& path, const StoredScene& scene, const Work& work = {});

struct LoadOptions {
  /// Bytes of factors that may be kept in memory; 0: usual_memory(). A tensor with more leaves them in its
  /// file (TransportTensor::in_memory).
  std::int64_t memory = 0;
  bool camera = true;  ///< also T on the camera's own pixels; it is in memory as a whole
};

/// Reads scene.h5. Checks version, sizes and every index before it uses them; refuses NaN and infinity.
/// Factors that stay in the file are checked when they are read.
/// fails: not_found, io, bad_format, bad_value.
Result<StoredScene> load_scene(const std::filesystem::path& path, const LoadOptions& options = {});

}  // namespace symrig
