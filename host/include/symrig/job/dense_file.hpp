// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <filesystem>

namespace symrig {

/// Writes T as a matrix of 32-bit floats, atomically. The suffix chooses the format:
/// - .npy: [camera pixel × projector pixel] in raster order; a rig of dense_rig.hpp reads it.
/// - .mat (MATLAB's level 4, which Octave reads too): T for pictures that MATLAB stores, column after column,
/// so
///   photograph = reshape(T * light(:), photo_size); and light_size, photo_size, each [rows cols].
/// error: as TransportTensor::apply of one pixel.
/// fails: bad_argument (another suffix; several channels), limit (more than max_bytes), interrupted,
/// not_found, io.
Result<void> save_dense(const std::filesystem::path& path, const TransportTensor& tensor,
                        std::int64_t max_bytes, const Progress& progress);

}  // namespace symrig
