// SPDX-License-Identifier: Apache-2.0
// How well a folder of real Gray-code photographs is decoded, and how much that hangs on what decoding takes
// as given: one line a decoder, then (--sensitivity) one a constant at half and at twice its value, on the
// photographs and on simulated ones with a known map.
#include "symrig/calibration/pixel_map.hpp"

#include "symrig/base/time.hpp"
#include "symrig/calibration/first_bounce.hpp"
#include "unit/calibration/synthetic_photographs.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace {

using symrig::CodePhotographs;
using symrig::DecodeOptions;
using symrig::DecodePolicy;
using symrig::GrayCode;
using symrig::PixelMap;
using symrig::StripeAxis;

/// The plain decoder that the bars compare with: a bit is pattern > complement, by more than `margin` or the
/// pixel is lost; positions are whole.
PixelMap decode_plainly(const CodePhotographs& photographs, float margin) {
  const GrayCode& code = photographs.code;
  const symrig::Grid camera = photographs.camera();
  PixelMap map{.camera = camera,
               .projector = code.projector(),
               .col = symrig::Image<float>(camera),
               .row = symrig::Image<float>(camera),
               .mask = symrig::Image<std::uint8_t>(camera),
               .col_sigma = {},
               .row_sigma = {},
               .contrast = symrig::Image<float>(camera)};
  for (std::size_t i = 0; i < map.mask.values().size(); ++i) {
    map.contrast.values()[i] = photographs.white().values()[i] - photographs.black().values()[i];
    bool clear = true;
    int position[2] = {0, 0}, bit[2] = {0, 0};
    for (int pair = 0; pair < code.pairs(); ++pair) {
      const int axis = code.pair(pair).axis == StripeAxis::columns ? 0 : 1;
      const float d = photographs.image(2 * pair).values()[i] - photographs.image(2 * pair + 1).values()[i];
      clear = clear && std::abs(d) > margin;
      bit[axis] ^= d > 0 ? 1 : 0;
      position[axis] = 2 * position[axis] + bit[axis];
    }
    clear = clear && position[0] < code.projector().cols && position[1] < code.projector().rows;
    map.col.values()[i] = static_cast<float>(position[0]);
    map.row.values()[i] = static_cast<float>(position[1]);
    map.mask.values()[i] = clear ? 1 : 0;
  }
  return map;
}

void print(const char* name, const PixelMap& map, int stride) {
  const symrig::MapQuality q = symrig::judge_map(map, {.stride = stride});
  std::printf("%-34s valid %6.2f %%   off %6.3f %% (an axis %6.3f %%)   rms %.4f px   alone %.3f %%\n", name,
              100 * q.valid_share, 100 * q.outlier_share, 100 * q.axis_outlier_share, q.rms,
              100 * q.alone_share);
  (void)std::fflush(stdout);
}

/// Of one axis: Σ D² of the two finest pairs over the 5 × 5 pixels around, D = pattern − complement, over
/// what noise alone gives; the larger of the two. 1: no stripes.
double fine_stripes(const CodePhotographs& photographs, StripeAxis axis, int row, int col, double noise) {
  const GrayCode& code = photographs.code;
  const symrig::Grid camera = photographs.camera();
  const int last = axis == StripeAxis::columns ? code.column_bits() - 1 : code.pairs() - 1;
  double most = 0;
  for (const int pair : {last, last - 1}) {
    double sum = 0, n = 0;
    for (int r = std::max(row - 2, 0); r <= std::min(row + 2, camera.rows - 1); ++r)
      for (int c = std::max(col - 2, 0); c <= std::min(col + 2, camera.cols - 1); ++c) {
        const auto d = static_cast<double>(photographs.image(2 * pair).at(r, c) -
                                           photographs.image(2 * pair + 1).at(r, c));
        sum += d * d, n += 1;
      }
    most = std::max(most, sum / n / (2 * noise * noise));
  }
  return most;
}

/// How much of the lit pixels can be decoded: those around which the finest stripes of both axes are there.
/// The others see light of other surfaces only. The rms must be 1.5 times that of noise. It asks nothing of
/// the decoder, which has a test of its own.
void print_stripes(const CodePhotographs& photographs, const PixelMap& map) {
  constexpr double kLeast = 1.5 * 1.5;
  const double least_contrast = symrig::MapQualityOptions{}.lit_contrast;
  double lit = 0, stripes = 0, decoded = 0, both = 0;
  const symrig::Grid camera = photographs.camera();
  for (int row = 0; row < camera.rows; ++row)
    for (int col = 0; col < camera.cols; ++col) {
      if (static_cast<double>(map.contrast.at(row, col)) <= least_contrast) continue;
      const bool seen = fine_stripes(photographs, StripeAxis::columns, row, col, map.noise) > kLeast &&
                        fine_stripes(photographs, StripeAxis::rows, row, col, map.noise) > kLeast;
      const bool valid = map.mask.at(row, col) != 0;
      lit += 1, stripes += seen ? 1 : 0, decoded += valid ? 1 : 0, both += seen && valid ? 1 : 0;
    }
  std::printf("of the lit: %.2f %% have stripes, %.2f %% are decoded; of those with stripes: %.2f %%\n",
              100 * stripes / lit, 100 * decoded / lit, 100 * both / stripes);
}

/// Error of a pair that decoding and fit have not seen, % of mean white.
void predict(const CodePhotographs& photographs, int pair) {
  const auto fit = symrig::fit_first_bounce(photographs, {.decode = {.held_out_pair = pair}});
  if (!fit) return (void)std::printf("%s\n", fit.error().line().c_str());
  std::printf("held out %-16s %5.2f / %5.2f %% of mean white\n", photographs.code.pair(pair).name.c_str(),
              100 * fit->errors[0].rms_lit, 100 * fit->errors[1].rms_lit);
  (void)std::fflush(stdout);
}

struct Constant {
  const char* name;
  double DecodePolicy::*value;
};
constexpr Constant kConstants[] = {{"contrast_sigmas", &DecodePolicy::contrast_sigmas},
                                   {"direct_sigmas", &DecodePolicy::direct_sigmas},
                                   {"largest_sigma", &DecodePolicy::largest_sigma},
                                   {"evidence", &DecodePolicy::evidence},
                                   {"model_error", &DecodePolicy::model_error},
                                   {"largest_misfit", &DecodePolicy::largest_misfit},
                                   {"tile_weight", &DecodePolicy::tile_weight},
                                   {"shape_spread", &DecodePolicy::shape_spread},
                                   {"support_share", &DecodePolicy::support_share},
                                   {"support_distance", &DecodePolicy::support_distance}};

/// Against the known map: rms of what is within 1.5 pixels, share beyond, share of the directly lit that is
/// decoded, share of the shadow that is.
void print_against_truth(const char* name, const symrig::test::SyntheticScene& scene, const PixelMap& map) {
  double lit = 0, decoded = 0, off = 0, squares = 0, shadow = 0, invented = 0;
  for (int r = 0; r < scene.camera.rows; ++r)
    for (int c = 0; c < scene.camera.cols; ++c) {
      const bool valid = map.mask.at(r, c) != 0;
      if (symrig::test::SyntheticScene::shadow(r, c)) {
        shadow += 1, invented += valid;
        continue;
      }
      lit += 1;
      if (!valid) continue;
      const double dx = static_cast<double>(map.col.at(r, c)) - scene.col(r, c),
                   dy = static_cast<double>(map.row.at(r, c)) - symrig::test::SyntheticScene::row(r, c);
      decoded += 1;
      if (std::hypot(dx, dy) > 1.5)
        off += 1;
      else
        squares += (dx * dx + dy * dy) / 2;
    }
  std::printf("%-34s valid %6.2f %%   off %6.3f %%   rms %.4f px   in shadow %5.2f %%\n", name,
              100 * decoded / lit, 100 * off / decoded, std::sqrt(squares / (decoded - off)),
              100 * invented / shadow);
  (void)std::fflush(stdout);
}

template <class Show>
void for_each_change(const CodePhotographs& photographs, Show show) {
  for (const Constant& constant : kConstants)
    for (const double factor : {0.5, 2.0}) {
      DecodeOptions options;
      options.policy.*constant.value *= factor;
      char name[64];
      (void)std::snprintf(name, sizeof name, "%s x %.1f", constant.name, factor);
      if (const auto map = symrig::decode(photographs, options))
        show(name, *map);
      else
        std::printf("%-34s %s\n", name, map.error().line().c_str());
    }
}

/// Hard: strong noise, a wide footprint, half of the light by way of the scene.
constexpr symrig::test::SyntheticScene kHard{.blur = 1.0, .far = 0.4, .noise = 0.02};

void print_sensitivity(const CodePhotographs& photographs) {
  for (const auto& scene : {symrig::test::SyntheticScene{}, kHard}) {
    std::printf("\nsimulated: blur %.1f px, far light %.0f %%, noise %.3f\n", scene.blur, 100 * scene.far,
                scene.noise);
    const CodePhotographs simulated = symrig::test::photograph_sequence(scene);
    if (const auto map = symrig::decode(simulated)) print_against_truth("as it is", scene, *map);
    for_each_change(simulated,
                    [&](const char* name, const PixelMap& map) { print_against_truth(name, scene, map); });
  }
  std::printf("\nphotographs, every fourth pixel of every fourth row judged\n");
  for_each_change(photographs, [](const char* name, const PixelMap& map) { print(name, map, 4); });
}

int run(const char* folder, std::string_view what) {
  const auto photographs = symrig::read_gray_code_folder(folder);
  if (!photographs) return std::fprintf(stderr, "%s\n", photographs.error().line().c_str()), 4;
  const symrig::Stopwatch watch;
  const auto map = symrig::decode(*photographs);
  if (!map) return std::fprintf(stderr, "%s\n", map.error().line().c_str()), 4;
  std::printf("decode: %.1f s\n", watch.seconds());
  print("decode", *map, 1);
  print_stripes(*photographs, *map);
  if (const auto alone = symrig::decode(*photographs, {.neighbours = false}))
    print("decode, pixel by pixel", *alone, 1);
  print("plain, 5 levels of margin", decode_plainly(*photographs, 5.0F / 255), 1);
  print("plain, no margin", decode_plainly(*photographs, -1), 1);
  if (what == "--held-out")
    for (int pair = 0; pair < photographs->code.pairs(); ++pair) predict(*photographs, pair);
  else
    predict(*photographs,
            photographs->code.column_bits() - 1);  // a check without neighbours: the finest columns
  if (what == "--sensitivity") print_sensitivity(*photographs);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3)
    return std::fprintf(stderr, "usage: benchmark_pixel_map FOLDER [--held-out | --sensitivity]\n"), 2;
  return run(argv[1], argc == 3 ? argv[2] : "");
}
