// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/first_bounce.hpp"

#include "calibration/light_model.hpp"
#include "calibration/light_tensor.hpp"
#include "calibration/raw_map.hpp"
#include "calibration/sequence_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

namespace symrig {
namespace {

using namespace calibration;

/// Lit pixels: white − black well above the noise.
std::vector<std::uint8_t> lit_pixels(const PixelMap& map, const DecodeOptions& options) {
  const double least = options.policy.contrast_sigmas * std::sqrt(2.0) * map.noise;
  std::vector<std::uint8_t> lit;
  lit.reserve(map.contrast.values().size());
  for (const float c : map.contrast.values()) lit.push_back(static_cast<double>(c) > least ? 1 : 0);
  return lit;
}

/// The map with positions in the holes, extended from the decoded pixels. The fit finds how much direct light
/// they have.
PixelMap without_holes(const PixelMap& map, const DecodeOptions& options) {
  Image<std::uint8_t> lit(map.camera);
  std::ranges::copy(lit_pixels(map, options), lit.values().begin());
  RawMap raw{{map.col, map.row}, map.mask};
  fill_holes(raw, lit);
  PixelMap filled = map;
  filled.col = std::move(raw.position[0]);
  filled.row = std::move(raw.position[1]);
  filled.mask = std::move(raw.mask);
  return filled;
}

Result<void> check(const FitOptions& options) {
  if (options.surroundings < 0)
    return Error{ErrorCode::bad_argument,
                 fmt::format("surroundings = {}; must not be below 0", options.surroundings)};
  if (!(options.weight_cutoff >= 0 && options.weight_cutoff < 1))
    return Error{ErrorCode::bad_argument,
                 fmt::format("weight_cutoff = {}; must be 0 or more and below 1", options.weight_cutoff)};
  return {};
}

/// The sizes of the surroundings that near light may come from [projector pixels]: translucent matter,
/// lenses, and the scene nearby. Or the given size.
std::array<int, kNearSizes> near_reaches(const FitOptions& options) {
  std::array<int, kNearSizes> sizes{4, 16, 64};
  if (options.surroundings > 0) sizes.fill(options.surroundings);
  return sizes;
}

std::vector<Surroundings> surroundings_of(const BlockTree& projector,
                                          const std::array<int, kNearSizes>& sizes) {
  std::vector<Surroundings> all;
  all.reserve(sizes.size());
  for (const int size : sizes) all.emplace_back(projector, size);
  return all;
}

/// See FitStatistics::surroundings.
int best_surroundings(const CodePhotographs& photographs, const FitOptions& options, const PixelMap& map,
                      const BlockTree& projector) {
  if (options.surroundings > 0) return options.surroundings;
  int best = 0;
  double least = 0;
  for (const int size : {16, 32, 64, 128}) {
    std::array<int, kNearSizes> sizes{};
    sizes.fill(size);
    const auto surroundings = surroundings_of(projector, sizes);
    const double left = LightModel(photographs, options.decode, surroundings).best_blur(map).squared_residual;
    if (best == 0 || left < least) best = size, least = left;
  }
  return best;
}

Image<float> black_level(Grid camera, const std::vector<PixelLight>& light) {
  Image<float> black(camera);
  std::ranges::transform(light, black.values().begin(),
                         [](const PixelLight& l) { return static_cast<float>(l.black); });
  return black;
}

/// rms over masked pixels; an empty mask means all.
double rms(std::span<const float> a, std::span<const float> b, std::span<const std::uint8_t> mask) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!mask.empty() && !mask[i]) continue;
    const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    sum += d * d;
    count += 1;
  }
  return count == 0 ? 0 : std::sqrt(sum / count);
}

Result<void> predict_held_out(const CodePhotographs& photographs, const FitOptions& options,
                              FirstBounceFit& fit) {
  const auto lit = lit_pixels(fit.map, options.decode);
  const int pair = *options.decode.held_out_pair;
  for (int complement = 0; complement < 2; ++complement) {
    const int index = 2 * pair + complement;
    HeldOut held{photographs.code.pair(pair).name + (complement ? ", complement" : ""),
                 photographs.code.pattern(index), photographs.images[index]};
    std::ranges::transform(held.photograph.values(), fit.black.values(), held.photograph.values().begin(),
                           std::minus{});
    SYMRIG_TRY(const auto predicted, fit.tensor.apply(held.pattern));
    fit.errors.push_back({held.name,
                          rms(predicted.values(), held.photograph.values(), lit) / fit.statistics.mean_white,
                          rms(predicted.values(), held.photograph.values(), {}) / fit.statistics.mean_white});
    fit.held_out.push_back(std::move(held));
  }
  return {};
}

FitStatistics statistics_of(const CodePhotographs& photographs, const PixelMap& map,
                            const std::vector<PixelLight>& light, const FitOptions& options,
                            std::size_t seen) {
  const auto lit = lit_pixels(map, options.decode);
  FitStatistics s;
  double white = 0, direct = 0, near = 0, far = 0, residual = 0, count = 0;
  s.near_reaches = near_reaches(options);
  for (std::size_t i = 0; i < lit.size(); ++i) {
    if (!lit[i]) continue;
    white += static_cast<double>(photographs.white().values()[i]);
    direct += light[i].direct;
    near += std::accumulate(light[i].near.begin(), light[i].near.end(), 0.0);
    for (std::size_t z = 0; z < kNearSizes; ++z) s.near_shares[z] += light[i].near[z];
    far += light[i].far;
    residual += light[i].squared_residual;
    count += 1;
  }
  s.mean_white = white / count;
  s.lit_share = count / static_cast<double>(lit.size());
  s.decoded_share = map.decoded_share();
  s.direct_share = direct / (direct + near + far);
  s.near_share = near / (direct + near + far);
  for (double& share : s.near_shares) share /= direct + near + far;
  s.residual = std::sqrt(residual / (count * static_cast<double>(seen))) / s.mean_white;
  return s;
}

}  // namespace

Result<FirstBounceFit> fit_first_bounce(const CodePhotographs& photographs, const FitOptions& options) {
  SYMRIG_CHECK(check(options));
  SYMRIG_TRY(auto map, decode(photographs, options.decode));
  SYMRIG_CHECK(require_both_axes(map, "a first-bounce tensor"));
  if (options.decode.check_sequence) SYMRIG_CHECK(check_light(photographs, options.decode.held_out_pair));
  const BlockTree projector(map.projector);
  const auto surroundings = surroundings_of(projector, near_reaches(options));
  const LightModel model(photographs, options.decode, surroundings);
  const Blur blur = model.best_blur(map);
  const PixelMap filled = without_holes(map, options.decode);
  const auto light = model.fit_all(filled, blur.sigma);
  FirstBounceFit fit{light_tensor(filled, light, surroundings, projector, blur.sigma, options.weight_cutoff),
                     black_level(map.camera, light),
                     std::move(map),
                     {},
                     {},
                     {}};
  fit.statistics = statistics_of(photographs, fit.map, light, options, model.photographs());
  fit.statistics.footprint_sigma = blur.sigma;
  fit.statistics.surroundings = best_surroundings(photographs, options, fit.map, projector);
  fit.statistics.scalars = static_cast<std::int64_t>(fit.tensor.column_rows().size());
  if (options.decode.held_out_pair) SYMRIG_CHECK(predict_held_out(photographs, options, fit));
  return fit;
}

Result<FirstBounceFit> fit_first_bounce(const std::filesystem::path& folder, const ReadCodeOptions& reading,
                                        const FitOptions& options) {
  SYMRIG_TRY(const auto photographs, read_gray_code_folder(folder, reading));
  return fit_first_bounce(photographs, options);
}

}  // namespace symrig
