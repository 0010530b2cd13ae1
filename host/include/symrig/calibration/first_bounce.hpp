// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace symrig {

struct FitOptions {
  DecodeOptions decode = {};  ///< decode.held_out_pair: the pair that the fit does not use, and then predicts
  /// Near light comes from about this many projector pixels around the position; 0: from 4, 16 and 64, as
  /// each camera pixel needs.
  int surroundings = 0;
  double weight_cutoff = 0.1;  ///< footprint weights below this share of the largest one are not stored
};

/// The error of the prediction of a photograph that the fit has not used.
struct PredictionError {
  std::string name;
  double rms_lit = 0;  ///< rms error over lit pixels (white − black above DecodePolicy::contrast_sigmas)
  double rms_all = 0;  ///< over all camera pixels; both as a share of the mean white of the lit pixels
};

struct FitStatistics {
  double mean_white = 0;       ///< of the white photograph over lit pixels, units of the photographs
  double lit_share = 0;        ///< lit / all camera pixels
  double decoded_share = 0;    ///< pixels with a measured position / all
  double direct_share = 0;     ///< direct light / all light, over lit pixels
  double near_share = 0;       ///< near light / all light
  double footprint_sigma = 0;  ///< blur of projector and camera together [projector pixels]
  /// The one reach of 16, 32, 64 and 128 that alone describes near light best; or the given one [projector
  /// pixels].
  int surroundings = 0;
  std::array<int, 3> near_reaches{};    ///< the reaches of the fit [projector pixels]
  std::array<double, 3> near_shares{};  ///< share of all light from each reach; the sum is near_share
  /// rms residual of the fit over lit pixels and the photographs it used, share of mean white
  double residual = 0;
  std::int64_t scalars = 0;  ///< stored weights of direct light
};

/// photograph ≈ T · pattern + black, from the photographs of a Gray-code sequence.
struct FirstBounceFit {
  TransportTensor tensor;  ///< not symmetric: camera grid × projector grid
  Image<float> black;      ///< fitted black level of each camera pixel, units of the photographs
  PixelMap map;
  std::vector<HeldOut> held_out;        ///< pattern and complement of the held-out pair; black is subtracted
  std::vector<PredictionError> errors;  ///< one for each held-out photograph
  FitStatistics statistics;
};

/// Fits the first bounce of light and a smooth rest to the photographs of a Gray-code sequence:
/// y_i(p) = b_i + a_i Σ_j f_ij p_j + Σ_z n_iz Σ_B w_iB mean_B(p) + u_i mean(p)
/// - b_i: black level.
/// - a_i ≥ 0: direct light (albedo × projector light).
/// - f_ij, Σ_j f_ij = 1: footprint of camera pixel i on the projector. It is a Gaussian around the decoded
/// position, integrated over projector pixels. Its width (blur of projector, camera and camera pixel) is one
/// number for the whole picture.
/// - n_iz ≥ 0: near light of three reaches, scattered below the surface or in the lenses. w_iB interpolates
/// between the blocks B around the position.
/// - u_i ≥ 0: far light, which comes from the whole scene.
/// For each pixel, a, n, u and b are the linear least-squares solution over all photographs that are not held
/// out. Fine stripes separate direct light from the rest, because they light every other projector pixel
/// [Nayar06 §3]. Lit pixels without a decoded position get one from their neighbours; the fit finds their
/// direct light.
/// units: those of the photographs (1 = the largest code) per unit of projector light, without black.
/// error: FirstBounceFit::errors, on photographs that the fit has not used.
/// fails: as decode; bad_argument (surroundings or cutoff out of range).
Result<FirstBounceFit> fit_first_bounce(const CodePhotographs& photographs, const FitOptions& options = {});
/// read_gray_code_folder, then the fit.
Result<FirstBounceFit> fit_first_bounce(const std::filesystem::path& folder,
                                        const ReadCodeOptions& reading = {}, const FitOptions& options = {});

}  // namespace symrig
