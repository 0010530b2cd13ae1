// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace symrig {

/// The projector position that each camera pixel sees. A sequence of one axis gives that coordinate alone:
/// the other one is NaN in decoded pixels, with an infinite standard deviation. Such a map is no map of
/// places on the projector. Whatever needs both coordinates refuses it (require_both_axes).
struct PixelMap {
  Grid camera, projector;
  Image<float> col,
      row;  ///< projector position [px], camera grid; pixel j covers [j − ½, j + ½); 0 where mask is 0
  Image<std::uint8_t> mask;           ///< 1 = decoded
  Image<float> col_sigma, row_sigma;  ///< standard deviation of the position [px], where decoded
  Image<float> contrast;              ///< white − black, units of the photographs
  double noise = 0;                ///< rms of one photograph's pixel, estimated from all of them; same units
  CodeAxes axes = CodeAxes::both;  ///< the known coordinates
  double decoded_share() const;    ///< decoded / all camera pixels
};

/// fails: bad_value (a map of columns or rows alone). what: what needs both, "a registration".
Result<void> require_both_axes(const PixelMap& map, const char* what);

/// The constants of decoding, each with its reason. Most values were found on the 42 real photographs that
/// also measure the accuracy, and the reasons were written afterwards. So those figures are no independent
/// proof. `benchmark_pixel_map --sensitivity` shows the cost of half and twice each value.
struct DecodePolicy {
  /// A pixel is in shadow if white − black is below this many of its standard deviations. One shadow pixel in
  /// 700 passes.
  double contrast_sigmas = 3;
  /// The finest stripes must be visible around a pixel: their energy must exceed noise by this many standard
  /// deviations. One pixel without direct light in 30,000 passes.
  double direct_sigmas = 4;
  /// [px] A position with a larger standard deviation is rejected. At 0.75, two sigmas are the 1.5 pixels
  /// that make an outlier.
  double largest_sigma = 0.75;
  /// Any position elsewhere must fit worse by this χ²: a likelihood ratio of 20 : 1, 2 ln 20.
  double evidence = 6;
  /// No footprint is exactly a mixture of Gaussians, so differences are only known to this share of white −
  /// black. For an edge under a Gaussian of any sigma from 0.25 to 2.5 px, its two neighbours in the mixture
  /// err by at most 2.1 %. Real footprints are not Gaussians.
  double model_error = 0.03;
  /// Largest misfit of the best position, in sigmas of that error, rms over the bits.
  double largest_misfit = 4.5;
  /// Weight of the picture's footprint shape in the shape of a tile, in pixels.
  double tile_weight = 5;
  /// Standard deviation of the shares of a pixel's own footprint around those of its tile.
  double shape_spread = 0.15;
  /// This share of the decoded pixels within 3 pixels must predict the pixel's position,
  double support_share = 0.4;
  /// [px] within this distance. 1: the next stripe of the finest pattern belongs to another position.
  double support_distance = 1;
};

/// How to decode.
struct DecodeOptions {
  DecodePolicy policy = {};
  bool neighbours = true;  ///< reject positions that too few neighbours support
  bool smooth = false;  ///< replace positions by the plane of their neighbours' positions, fill small holes
  /// Refuse a sequence that contradicts itself: a wrong order, photographs of another scene, a wrong
  /// projector. If false, everything that decodes is used, right or wrong.
  bool check_sequence = true;
  bool mirrored = false;  ///< a rear projection: the map reverses orientation
  /// A pair that decoding must not use, because it is predicted later. Its bit is derived. Without Gray bit k
  /// a position is known up to a reflection inside its block of 2^(bits−k) pixels. Camera and projector see
  /// the same side of a surface, so the map keeps orientation. In blocks that are wide on the camera, only
  /// one of the two candidates does so. In narrow blocks (below 10 camera pixels) the blocks around predict
  /// the right one.
  std::optional<int> held_out_pair = {};
};

/// Decodes each pixel from its own photographs by maximum likelihood. It compares pattern minus complement of
/// every bit with what a footprint at x would see of the stripes. x may lie between pixels. The noise is
/// estimated from the photographs.
/// The footprint's width and tails are a mixture of Gaussians, which fits defocus, translucent matter and
/// reflections of other surfaces. Each 16 × 16 camera pixels share one footprint; a pixel that it does not
/// explain gets its own. Positions are never taken from neighbours unless `smooth` is set.
/// A pixel is decoded if all of this holds: it is lit; the finest stripes are visible around it (else it sees
/// indirect light only); its position is known well enough; no other position explains it nearly as well;
/// neighbours agree.
/// A sequence of one axis gives a map of that axis. A derived complement has the noise of three photographs.
/// error: col_sigma, row_sigma; rms 0.05 px on a plain surface. The stated deviations are scaled to the
/// scatter of the positions. fails: bad_value (no pairs; no pixel has enough contrast;
/// most of the map runs backwards: a pair is swapped or out of order), bad_argument (no such held_out_pair,
/// or one of a single axis, whose bit cannot be derived), size_mismatch.
Result<PixelMap> decode(const CodePhotographs& photographs, const DecodeOptions& options = {});

/// read_gray_code_folder, then decode.
Result<PixelMap> decode_gray_code(const std::filesystem::path& folder, const ReadCodeOptions& reading = {},
                                  const DecodeOptions& decoding = {});

/// The map as a picture for other programs. Its channels are projector column, projector row, decoded (1 or
/// 0), on the camera grid. A map of one axis has -1 in the channel of the other, where it is decoded.
Image<float> map_picture(const PixelMap& map);

/// Reads the map from such a picture. A channel that is -1 in every decoded pixel is not known. Uncertainty,
/// contrast and noise are not in it and stay empty. fails: bad_value (a decoded position is not on the
/// projector; names the first such pixel), bad_format (another number of channels, a third channel that is
/// neither 0 nor 1).
Result<PixelMap> map_of_picture(const Image<float>& picture, Grid projector, const std::string& name);

/// read_image, then map_of_picture, for a file of `symrig calibrate -o`.
Result<PixelMap> read_pixel_map(const std::filesystem::path& path, Grid projector);

struct MapQualityOptions {
  /// A pixel is lit if white − black is above this, in units of the photographs. The value is more than 10
  /// codes of 8 bits, plus half a code for rounding. It is less, in proportion, if the brightest hundredth of
  /// the pixels is below a quarter of the range.
  double lit_contrast = 10.5 / 255;
  double outlier = 1.5;  ///< [projector pixels] from the local affine fit
  int reach = 7;         ///< the fit uses (2 reach + 1)² camera pixels
  int least = 20;        ///< and needs this many valid pixels
  int stride = 1;        ///< judges every stride-th row and column
};

/// The smoothness of a pixel map, computed independently of the decoder. All shares but the first two are
/// shares of the judged pixels, which are valid and lit.
struct MapQuality {
  double lit_share = 0;           ///< lit / all camera pixels
  double valid_share = 0;         ///< lit pixels with a position / lit pixels
  double outlier_share = 0;       ///< further than `outlier` from the fit, or without a fit (alone_share)
  double axis_outlier_share = 0;  ///< further than `outlier` along one axis; mean of both axes
  double rms = 0;          ///< residual per axis of the pixels that are not outliers [projector pixels]
  double alone_share = 0;  ///< with fewer than `least` valid neighbours, or all of them on a line
};

/// Distances along both axes of the projector; NaN where there is no position or no fit.
struct MapResiduals {
  Image<float> col, row;

  /// Distance of one pixel [projector pixels].
  float distance(std::size_t pixel) const;
};

/// The distance of each valid position from an affine map that is fitted to the valid positions around it
/// [projector pixels]. The fit does not use the pixel itself. It is iteratively re-weighted least squares
/// (first absolute residuals, then Tukey's biweight at 4.685 robust sigmas). Where two surfaces meet, it
/// follows the one with more pixels. A map that was smoothed over neighbours looks better here than it is:
/// also test such a map on photographs that it has not used.
MapResiduals map_residuals(const PixelMap& map, const MapQualityOptions& options = {});

MapQuality judge_map(const PixelMap& map, const MapQualityOptions& options = {});
/// As above, with known residuals.
MapQuality judge_map(const PixelMap& map, const MapResiduals& residuals,
                     const MapQualityOptions& options = {});

/// A smooth model of a pixel map, piece by piece, and the edges between the pieces.
struct SmoothMap {
  Image<float> col, row;      ///< the projector position of the model [px], camera grid; 0 where not known
  Image<std::uint8_t> known;  ///< 1: decoded, and the model describes it
  Image<std::uint8_t> edges;  ///< 1: decoded, and no model describes it, or two pieces meet here
  int pieces = 0;
  int knots = 0;                           ///< distance of the splines' knots [camera pixels]
  double smoothing = 0;                    ///< cost of the fourth differences of the splines' coefficients
  double known_share = 0, edge_share = 0;  ///< of the decoded pixels

  /// How well a model of half of the pixels predicts the other half.
  struct HeldOut {
    double planar_share = 0;  ///< of the decoded left-out pixels: those on planar parts; these are judged
    double rms = 0;           ///< along an axis [px], of all judged pixels
    double far_share = 0;     ///< of the judged pixels: further away than kFar
  };
  static constexpr double kFar = 1.5;  ///< [px]
  HeldOut held_out;
};

/// Fits smooth surfaces to the decoded positions, two for each piece of the map: projector column and row.
///
///     min Σ (f(block) − position)² / variance + smoothing · (fourth differences of the spline's
///     coefficients)²
///
/// A block is the mean position of 4 × 4 camera pixels, weighted by the decoder's standard deviations. Its
/// variance is theirs and 0.11² [px²], for errors that neighbours share.
///
/// Pieces: at an edge, the planes through the blocks on both sides are half a projector pixel apart or more,
/// and more than five sigmas of their scatter. Blocks without an edge that touch are a piece, if there are
/// 100 of them. Fit: robust, by Tukey's biweight. Distance of knots and smoothing are those that predict
/// left-out blocks best. Edges: a block belongs to the piece within four blocks whose model is nearest. It
/// belongs to none if all are more than three sigmas away. Marked are groups of four such blocks or more, and
/// blocks where two pieces meet. By chance, 80,000 blocks have one such group in 2,000 maps.
///
/// Held out: every other block, like the black squares of a chessboard. Pieces, knots, smoothing and a model
/// of its own come from the others alone. Planar parts, too: no edge is within four blocks, and each
/// direction has neighbours enough to tell. So a pixel is not judged or left out because of its own error.
///
/// fails: bad_value (too few decoded pixels).
Result<SmoothMap> fit_smooth_map(const PixelMap& map);

/// Converts pictures from the camera's grid to the projector's and back, through a pixel map. It is a sparse
/// matrix R, projector pixels × camera pixels. R_ji is the share of camera pixel i's light that came from
/// projector pixel j. Camera pixel i covers a box on the projector; R_ji is the part of the box in projector
/// pixel j. The sides of the box are the steps of the map from one camera pixel to the next, along both axes
/// of the projector.
/// Each decoded camera pixel distributes all of its light, Σ_j R_ji = 1, also at the projector's border; the
/// others distribute none. So Σ R x = Σ x over decoded pixels: no light is added or lost.
class Resampling {
 public:
  /// cost: 4 to 9 weights for each decoded pixel.
  /// fails: size_mismatch (images of the map differ in size), bad_value (a position is not finite, or is more
  /// than a pixel outside the projector).
  static Result<Resampling> from_map(const PixelMap& map);

  Grid camera() const { return camera_; }
  Grid projector() const { return projector_; }
  std::size_t weights() const { return weight_.size(); }

  /// R x: light on each projector pixel, any number of channels.
  /// error: sums are 64 bits wide, results are rounded to 32.
  /// fails: size_mismatch.
  Result<Image<float>> to_projector(const Image<float>& camera) const;
  /// Rᵀ y: the mean of a projector picture over each camera pixel's box; 0 where not decoded.
  /// fails: size_mismatch.
  Result<Image<float>> to_camera(const Image<float>& projector) const;
  /// R 1: the number of camera pixels that each projector pixel gets its light from; 0 where no camera pixel
  /// looks.
  const Image<float>& coverage() const { return coverage_; }
  /// R x / R 1, for quantities that are means and not sums (radiance, reflectance); 0 where no camera pixel
  /// looks. A camera pixel on the projector's border also sees the dark beside it, and would darken the mean.
  /// It counts only where no camera pixel lies completely on the projector.
  /// fails: size_mismatch.
  Result<Image<float>> mean_on_projector(const Image<float>& camera) const;

 private:
  Resampling(Grid camera, Grid projector) : camera_(camera), projector_(projector), inside_(camera) {}

  Grid camera_, projector_;
  std::vector<std::uint32_t> first_;  ///< first weight of each camera pixel, and the end
  std::vector<std::uint32_t> pixel_;  ///< projector pixel of each weight
  std::vector<float> weight_;
  Image<float> coverage_;
  Image<float> inside_;           ///< camera grid: 1 where the box lies completely on the projector
  Image<float> inside_coverage_;  ///< R inside
};

}  // namespace symrig
