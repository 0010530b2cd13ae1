// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"
#include "symrig/sim/scene.hpp"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace symrig {

/// T as a matrix, one channel, in raster order.
struct DenseMatrix {
  Grid grid;                  ///< of camera and projector
  std::vector<float> values;  ///< [camera pixel × projector pixel], row after row
};

/// What `dense:FILE` or `dense:FILE?grid=ROWSxCOLS&views=ROWSxCOLS` names. Each key may be left out. Keys of
/// a simulated rig (scene_keys()) make the matrix the scene of one.
struct DenseUri {
  std::filesystem::path file;
  Grid grid = {};             ///< 0x0: not given
  ViewLayout views = {};      ///< that tile the grid
  std::string rig_keys = {};  ///< "noise=camera&profile=dim"; empty: photographs are exact and take no time
};

/// True for "dense:…".
bool is_dense(const std::string& rig);

/// fails: bad_argument.
Result<DenseUri> parse_dense_uri(const std::string& rig);

/// Reads a matrix. The content of the file chooses the format:
/// - .npy (NumPy's format, version 1 to 3) and HDF5 (the data set T): pixels in raster order;
/// - .mat (MATLAB's level 4, 5, 7 or 7.3; the variable T): pixels column after column, as T · light(:) has
///   them. light_size or photo_size states the grid.
/// shapes: [rows, cols, rows, cols] (camera, then projector), or [n, n] with n = grid.size(). Without a grid,
/// n must be a square number: the grid is then a square. Numbers are real. fails: as read_file; bad_format
/// (none of these, other numbers, truncated), size_mismatch, bad_value (NaN or infinity), limit (more than
/// 2^16 pixels), bad_argument (views that do not fit the grid).
Result<DenseMatrix> read_dense(const DenseUri& uri);

/// T as a scene of one channel.
std::unique_ptr<Scene> make_dense_scene(DenseMatrix matrix);

/// The largest |T_ij - T_ji| as a share of the largest |T_ij|.
double asymmetry(const DenseMatrix& matrix);

/// A rig whose photographs are T · pattern, exact to the rounding of one float. It has no clock and no noise.
/// needs: views.fits(matrix.grid).
std::unique_ptr<Probe> make_dense_rig(DenseMatrix matrix, std::string name, ViewLayout views = {});

}  // namespace symrig
