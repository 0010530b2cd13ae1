// SPDX-License-Identifier: Apache-2.0
// What a bench that was aligned by hand costs: each scene captured by the ideal coaxial rig and by a bench,
// which is registered from its own Gray-code photographs. Errors of both against the ideal T. A ratio of 1 is
// a perfect bench.
#include "benchmark/registration_bench.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/time.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace {

using namespace symrig;
using namespace symrig::benchmark;

Result<void> compare(const std::string& scene, const Compared& how) {
  SYMRIG_TRY(const auto ideal_rig, open_virtual_rig(scene + how.ideal));
  SYMRIG_TRY(const TrueTransport ideal_truth, truth_of(*ideal_rig, how.own));
  SYMRIG_TRY(const Captured ideal, captured(*ideal_rig, ideal_truth));
  SYMRIG_TRY(const auto rig, open_virtual_rig(scene + how.bench));
  SYMRIG_TRY(const Registration registration, register_camera(*rig));
  SYMRIG_TRY(const Captured found, captured_registered(*rig, registration, how.own));
  const auto ratio = [](double a, double b) {
    return b > 0 ? fmt::format("{:.2f}", a / b) : std::string("-");
  };
  fmt::print("{:<18} {:5.0f} {:5.0f} {:>6}   {:.4f} {:.4f}   {:.4f} {:>6}   {:.4f} {:>6}   {:.5f} {:.5f}\n",
             rig->uri().name, ideal.patterns, found.patterns, ratio(found.patterns, ideal.patterns),
             ideal.errors.frobenius, found.errors.frobenius, found.errors.indirect,
             ratio(found.errors.indirect, ideal.errors.indirect), found.errors.bar_indirect,
             ratio(found.errors.bar_indirect, ideal.errors.bar_indirect),
             map_error(registration, rig->exact_corners()).corners, registration.error());
  (void)std::fflush(stdout);
  return {};
}

/// only: a scene, or empty for all.
int run(int size, int seed, const Compared& how, std::string_view only) {
  fmt::print("{}x{} cells, seed {}: {} compared with '{}'\n", size, size, seed, how.bench, how.ideal);
  fmt::print("{:<18} {:>5} {:>5} {:>6}   {:>6} {:>6}   {:>6} {:>6}   {:>6} {:>6}   {:>7} {:>7}\n", "scene",
             "ideal", "bench", "ratio", "frob", "bench", "indir", "ratio", "bar", "ratio", "map", "stated");
  for (const std::string_view name : scene_names()) {
    if (!only.empty() && only != name) continue;
    const std::string scene = fmt::format("sim:{}?size={}x{}&fine=4&seed={}", name, size, size, seed);
    if (const auto done = compare(scene, how); !done) fmt::print("{:<18} {}\n", name, done.error().line());
  }
  return 0;
}

/// The map of a bench, before and after its refinement by reciprocity.
int run_map(int size, int seed, const std::string& bench) {
  fmt::print("{0}x{0} cells, seed {1}: {2}\n{3:<18} {4:>8} {5:>8} {6:>8} {7:>8} {8:>8} {9:>9} {10:>7}\n",
             size, seed, bench, "scene", "before", "tiles", "stated", "refined", "tiles", "corrected",
             "left");
  for (const std::string_view name : scene_names()) {
    const auto rig =
        open_virtual_rig(fmt::format("sim:{}?size={}x{}&fine=4&seed={}{}", name, size, size, seed, bench));
    if (!rig) return fmt::print("{}\n", rig.error().line()), 4;
    const auto plain = register_camera(**rig, {.refine = false}), refined = register_camera(**rig);
    if (!plain || !refined) {
      fmt::print("{:<18} {}\n", name, (plain ? refined : plain).error().line());
      continue;
    }
    const auto exact = (*rig)->exact_corners();
    const MapError before = map_error(*plain, exact), after = map_error(*refined, exact);
    fmt::print("{:<18} {:8.5f} {:8.5f} {:8.5f} {:8.5f} {:8.5f} {:9.5f} {:7.5f}\n", name, before.corners,
               before.tiles, plain->error(), after.corners, after.tiles, refined->reciprocity.corrected,
               refined->reciprocity.left);
    (void)std::fflush(stdout);
  }
  return 0;
}

/// What a capture says of its errors. planted: rms of an error of the gain ratio that nobody tells it of.
Result<void> compare_estimates(const std::string& scene, const std::string& bench, bool own, double planted) {
  SYMRIG_TRY(const auto rig, open_virtual_rig(scene + bench));
  SYMRIG_TRY(Registration registration, register_camera(*rig));
  if (planted > 0) {
    registration.gain.known = true;
    double square = 0;
    const auto shapes = gain_shapes(registration.cells);
    for (const GainShapes& one : shapes) square += one[2] * one[2] / static_cast<double>(shapes.size());
    registration.gain.shape[2] += planted / std::sqrt(square);
  }
  SYMRIG_TRY(const Captured found, captured_registered(*rig, registration, own));
  const auto row = [&](double TransportErrors::*error) {
    const double truth = found.errors.*error, said = found.estimated.*error;
    return fmt::format("{:.4f} {:.4f} {:.4f} {:5.2f}", truth, said, found.half_width.*error, said / truth);
  };
  fmt::print("{:<18} {:5.0f}   {}   {}   {}   {:.4f} {:.4f}{}\n", rig->uri().name, found.patterns,
             row(&TransportErrors::frobenius), row(&TransportErrors::indirect),
             row(&TransportErrors::bar_indirect), found.gain.rms, found.gain.sigma,
             found.gain.found ? " found" : "");
  (void)std::fflush(stdout);
  return {};
}

int run_estimates(int size, int seed, const std::string& bench, bool own, double planted) {
  fmt::print("{0}x{0} cells, seed {1}: {2}; error of the gain ratio {3}\n", size, seed, bench, planted);
  fmt::print("{:<18} {:>5}   {:<26}   {:<26}   {:<26}   gain mismatch\n", "", "", "frobenius", "indirect",
             "bar_indirect");
  fmt::print("{:<18} {:>5}   {:<26}   {:<26}   {:<26}   {:<6} sigma\n", "scene", "bench",
             "true   said   +-     ratio", "true   said   +-     ratio", "true   said   +-     ratio", "rms");
  for (const std::string_view name : scene_names()) {
    const std::string scene = fmt::format("sim:{}?size={}x{}&fine=4&seed={}", name, size, size, seed);
    if (const auto done = compare_estimates(scene, bench, own, planted); !done)
      fmt::print("{:<18} {}\n", name, done.error().line());
  }
  return 0;
}

/// The map of a projector out of focus.
int run_blur() {
  fmt::print("defocus [cells]  edge [cells]  map [cells]  stated\n");
  for (const double blur : {0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 2.0}) {
    const auto rig = open_virtual_rig(
        fmt::format("sim:vgroove-textured?size=32x32&fine=4&defocus=0,{}{}", blur, bench_of(32)));
    if (!rig) return fmt::print("{}\n", rig.error().line()), 4;
    RegistrationOptions forced;
    forced.widest_edge = 100;
    const auto found = register_camera(**rig, forced);
    if (!found) return fmt::print("{}\n", found.error().line()), 4;
    fmt::print("{:15.1f} {:13.2f} {:12.4f} {:.4f}\n", blur, found->maps.front().edge_width(),
               map_error(*found, (*rig)->exact_corners()).corners, found->error());
  }
  return 0;
}

/// What a capture errs if the rig has moved after its registration, and nobody watches. Beside it: the
/// registration is told how far.
Result<void> capture_moved(const std::string& scene, int size) {
  SYMRIG_TRY(const auto still, open_virtual_rig(scene + bench_of(size)));
  SYMRIG_TRY(const Registration registration, register_camera(*still));
  for (const double moved : {0.0, 0.0025, 0.005, 0.01, 0.02, 0.04, 0.1}) {
    std::string row;
    for (const double told : {0.0, moved}) {
      SYMRIG_TRY(const auto rig, open_virtual_rig(scene + bench_of(size, moved)));
      SYMRIG_TRY(const Captured found, captured_registered(*rig, registration, false, told));
      row += fmt::format("   {:8.0f} {:9.4f} {:8.4f} {:8.4f} {:12.4f} {:8.4f}", found.patterns,
                         found.errors.frobenius, found.errors.indirect, found.estimated.indirect,
                         found.errors.bar_indirect, found.estimated.bar_indirect);
    }
    fmt::print("{:<18} {:6.4f}{}\n", still->uri().name, moved, row);
    (void)std::fflush(stdout);
  }
  return {};
}

/// only: a scene, or empty for all.
int run_moved(int size, std::string_view only) {
  const std::string_view columns = "patterns frobenius indirect     said bar_indirect     said";
  fmt::print("{0}x{0} cells, seed 1\n{1:<18} {2:<6}   {3:<56}   the same, told\n{1:<18} {4:<6}   {5}   {5}\n",
             size, "", "", "not told", "moved", columns);
  for (const std::string_view name : scene_names()) {
    if (!only.empty() && only != name) continue;
    if (const auto done = capture_moved(fmt::format("sim:{}?size={}x{}&fine=4", name, size, size), size);
        !done)
      fmt::print("{:<18} {}\n", name, done.error().line());
  }
  return 0;
}

/// What fewer camera pixels along the side of a cell cost.
Result<void> capture_with_pixels(const std::string& scene, int size, double pixels) {
  constexpr double kZoom = 0.78;
  const auto camera = static_cast<int>(std::lround(size * pixels / kZoom));
  const std::string keys =
      fmt::format("&camera={0}x{0}&turn=1.5&zoom={1}&shift=3.3,-2.1&distortion=0.02", camera, kZoom);
  SYMRIG_TRY(const auto rig, open_virtual_rig(scene + keys));
  SYMRIG_TRY(const Registration registration, register_camera(*rig));
  SYMRIG_TRY(const Captured found, captured_registered(*rig, registration, false));
  fmt::print("{:<18} {:6.2f} {:<7} {:9.0f} {:9.4f} {:9.4f} {:13.4f}\n", rig->uri().name,
             registration.pixels_per_cell(), to_string(registration.weighting()), found.patterns,
             found.errors.frobenius, found.errors.indirect, found.errors.bar_indirect);
  (void)std::fflush(stdout);
  return {};
}

int run_pixels(int size) {
  fmt::print("{0}x{0} cells, seed 1\n{1:<18} pixels weights patterns frobenius  indirect  bar_indirect\n",
             size, "scene");
  for (const std::string_view name : {"vgroove-textured", "gummy", "mirror"})
    for (const double pixels : {2.25, 2.5, 3.0, 4.0, 6.0}) {
      const std::string scene = fmt::format("sim:{}?size={}x{}&fine=4", name, size, size);
      if (const auto done = capture_with_pixels(scene, size, pixels); !done)
        fmt::print("{:<18} {}\n", name, done.error().line());
    }
  return 0;
}

/// Squares of light by the distance from the lit cells: the lit cells, their neighbours, other cells of the
/// part of the grid where cells are lit, and the rest.
using ByDistance = std::array<double, 4>;

/// The cells of these patterns that are lit are eight apart, in a quarter of the grid.
Pattern dots(Grid cells, int number) {
  Pattern pattern(cells);
  for (int row = number * 5 % 8; row < cells.rows / 2; row += 8)
    for (int col = number * 3 % 8; col < cells.cols / 2; col += 8) pattern.at(row, col) = 1;
  return pattern;
}

std::size_t distance_class(const Pattern& lit, int row, int col) {
  const Grid cells = lit.grid();
  if (lit.at(row, col) > 0) return 0;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, cells.rows - 1); ++r)
    for (int c = std::max(col - 1, 0); c <= std::min(col + 1, cells.cols - 1); ++c)
      if (lit.at(r, c) > 0) return 1;
  return row < cells.rows / 2 && col < cells.cols / 2 ? 2 : 3;
}

/// Adds the squares of a photograph's first channel, or of its difference from another.
void add_squares(const Pattern& lit, const Image<float>& photograph, const Image<float>* less,
                 ByDistance& sums) {
  for (int row = 0; row < lit.grid().rows; ++row)
    for (int col = 0; col < lit.grid().cols; ++col) {
      const float off = photograph.at(row, col) - (less != nullptr ? less->at(row, col) : 0.F);
      sums[distance_class(lit, row, col)] += static_cast<double>(off * off);
    }
}

/// What the weights alone err: exact map, no noise.
Result<void> compare_by_distance(const std::string& scene) {
  SYMRIG_TRY(const auto rig, open_virtual_rig(scene));
  SYMRIG_TRY(const Registration found, register_camera(*rig));
  const auto corners = rig->exact_corners();
  constexpr int kPatterns = 8;
  ByDistance light{};
  for (int k = 0; k < kPatterns; ++k)
    add_squares(dots(found.cells, k), rig->truth().apply(dots(found.cells, k)), nullptr, light);
  for (const Weighting weighting : {Weighting::area, Weighting::cores}) {
    const WeightOptions options{.weighting = weighting, .margin = found.margin()};
    SYMRIG_TRY(const CellWeights weights,
               CellWeights::make(found.cells, corners, found.flood, options, &found.shares));
    ByDistance errors{};
    for (int k = 0; k < kPatterns; ++k) {
      const Pattern lit = dots(found.cells, k);
      SYMRIG_TRY(const auto photograph, rig->measure({&lit, 1}));
      SYMRIG_TRY(const Radiance cells, weights.gather(photograph.front()));
      const Image<float> ideal = rig->truth().apply(lit);
      add_squares(lit, cells.mean, &ideal, errors);
    }
    fmt::print("{:<18} {:<7}", rig->uri().name, to_string(weighting));
    for (std::size_t k = 0; k < light.size(); ++k)
      fmt::print("   {:6.4f} {:6.4f}", std::sqrt(light[k] / light[0]), std::sqrt(errors[k] / light[0]));
    fmt::print("\n");
    (void)std::fflush(stdout);
  }
  return {};
}

int run_distance(int size, const std::string& bench) {
  fmt::print("{0}x{0} cells, seed 1, no noise: light and its error, both of the lit cells' light\n", size);
  fmt::print("{:<18} {:<7}   {:<13}   {:<13}   {:<13}   {:<13}\n", "scene", "weights", "lit cells",
             "next to them", "near", "far");
  for (const std::string_view name : scene_names())
    if (const auto done =
            compare_by_distance(fmt::format("sim:{}?size={}x{}&fine=4&noise=off{}", name, size, size, bench));
        !done)
      fmt::print("{:<18} {}\n", name, done.error().line());
  return 0;
}

/// Single lit cells, 16 apart, so that most of the grid is further than three cells from all of them.
Pattern far_dots(Grid cells, int number) {
  Pattern pattern(cells);
  for (int row = number * 5 % 16; row < cells.rows; row += 16)
    for (int col = number * 3 % 16; col < cells.cols; col += 16) pattern.at(row, col) = 1;
  return pattern;
}

/// True if a cell is lit within three cells.
bool near_light(const Pattern& lit, int row, int col) {
  constexpr int kNear = 3;
  const Grid cells = lit.grid();
  for (int r = std::max(row - kNear, 0); r <= std::min(row + kNear, cells.rows - 1); ++r)
    for (int c = std::max(col - kNear, 0); c <= std::min(col + kNear, cells.cols - 1); ++c)
      if (lit.at(r, c) > 0) return true;
  return false;
}

/// The error of light that goes further than three cells, as a share of it.
Result<double> far_error(const TransportTensor& tensor, const TrueTransport& truth) {
  constexpr int kPatterns = 16;
  double error = 0, light = 0;
  for (int k = 0; k < kPatterns; ++k) {
    const Pattern lit = far_dots(tensor.projector_grid(), k);
    SYMRIG_TRY(const Image<float> expected, truth(lit));
    SYMRIG_TRY(const Image<float> found, tensor.apply(lit));
    for (int row = 0; row < lit.grid().rows; ++row)
      for (int col = 0; col < lit.grid().cols; ++col) {
        if (near_light(lit, row, col)) continue;
        const double is = expected.at(row, col), off = static_cast<double>(found.at(row, col)) - is;
        error += off * off, light += is * is;
      }
  }
  return light > 0 ? std::sqrt(error / light) : 0;
}

/// The weights of a registration, with the exact map in the place of the one that it found.
Result<CellWeights> exact_weights(const VirtualRig& rig, const Registration& found) {
  const WeightOptions options{.weighting = found.weighting(), .margin = found.margin()};
  SYMRIG_TRY(CellWeights weights,
             CellWeights::make(found.cells, rig.exact_corners(), found.flood, options, &found.shares));
  if (found.gain.known) SYMRIG_CHECK(weights.divide_by(found.gain.over(found.cells)));
  SYMRIG_CHECK(weights.blur_by(found.blur.missing(weights.pixel_side())));
  return weights;
}

/// Light far away, captured through the map that was found and through the exact one.
Result<void> compare_far(const std::string& scene) {
  SYMRIG_TRY(const auto rig, open_virtual_rig(scene));
  SYMRIG_TRY(const TrueTransport truth, truth_of(*rig, true));
  SYMRIG_TRY(const Registration found, register_camera(*rig));
  std::array<double, 2> errors{};
  for (const bool exact : {false, true}) {
    SYMRIG_TRY(const auto again, open_virtual_rig(scene));
    SYMRIG_TRY(CellWeights weights, exact ? exact_weights(*again, found) : found.weights());
    RegisteredProbe probe(*again, std::move(weights), exact ? 0 : found.error());
    SYMRIG_TRY(const CaptureResult result, capture(probe, {}));
    SYMRIG_TRY(errors[exact ? 1 : 0], far_error(result.tensor, truth));
  }
  fmt::print("{:<18} {:.4f} {:.4f} {:.2f}\n", rig->uri().name, errors[0], errors[1], errors[0] / errors[1]);
  (void)std::fflush(stdout);
  return {};
}

int run_far(int size, int seed, const std::string& bench) {
  fmt::print("{0}x{0} cells, seed {1}: {2}\nerror of light beyond three cells\n{3:<18} {4:<6} {5:<6} ratio\n",
             size, seed, bench, "scene", "found", "exact");
  for (const std::string_view name : scene_names())
    if (const auto done =
            compare_far(fmt::format("sim:{}?size={}x{}&fine=4&seed={}{}", name, size, size, seed, bench));
        !done)
      fmt::print("{:<18} {}\n", name, done.error().line());
  return 0;
}

/// How long a photograph of 2048x1536 pixels and three channels takes to become cells, best of ten.
int run_time() {
  const Grid camera{1536, 2048}, cells{384, 512};
  CornerMap corners({camera.rows + 1, camera.cols + 1}, 2);
  const double turn = 1.5 * std::numbers::pi / 180;
  for (int row = 0; row <= camera.rows; ++row)
    for (int col = 0; col <= camera.cols; ++col) {
      corners.at(row, col, 0) = (std::cos(turn) * row + std::sin(turn) * col) / 3.72 - 10;
      corners.at(row, col, 1) = (std::cos(turn) * col - std::sin(turn) * row) / 3.72 - 5;
    }
  const Radiance flood{Image<float>(camera, 3, 1.F), Image<float>(camera, 3, 1e-4F),
                       Image<std::uint8_t>(camera, 3, std::uint8_t{1})};
  for (const auto& [weighting, blur] : {std::pair(Weighting::cores, 0.0), std::pair(Weighting::area, 0.06)}) {
    auto weights = CellWeights::make(cells, {&corners, 1}, flood, {.weighting = weighting});
    if (!weights || !weights->blur_by(blur)) return 4;
    double best = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 10; ++k) {
      const Stopwatch watch;
      if (!weights->gather(flood)) return 4;
      best = std::min(best, watch.seconds());
    }
    fmt::print("{}{}: {:.1f} ms\n", to_string(weighting), blur > 0 ? ", blurred" : "", 1e3 * best);
  }
  return 0;
}

constexpr const char* kUsage =
    "usage: benchmark_registration [A | B | C [SIZE [SEED [SCENE]]]]\n"
    "       benchmark_registration map | far | estimates-A | estimates-B | estimates-C [SIZE [SEED]]\n"
    "       benchmark_registration gain [SIZE [SEED [PLANTED]]]\n"
    "       benchmark_registration moved [SIZE [SCENE]]\n"
    "       benchmark_registration pixels | distance [SIZE]\n"
    "       benchmark_registration blur | time\n"
    "SIZE: from 8 to 1024, default 64\n";

}  // namespace

/// usage: kUsage
int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape): a benchmark may end so
  const std::string_view what = argc > 1 ? argv[1] : "A";
  const auto number = [&](int k, int otherwise) {
    return argc > k ? static_cast<int>(std::strtol(argv[k], nullptr, 10)) : otherwise;
  };
  const int size = number(2, 64), seed = number(3, 1);
  if (size < 8 || size > 1024) {
    (void)std::fputs(kUsage, stderr);
    return 2;
  }
  const std::string_view only = argc > 4 ? argv[4] : "";
  if (what == "blur") return run_blur();
  if (what == "time") return run_time();
  if (what == "moved") return run_moved(size, argc > 3 ? argv[3] : "");
  if (what == "pixels") return run_pixels(size);
  const std::string bench = bench_of(size);
  if (what == "distance") return run_distance(size, bench);
  if (what == "A") return run(size, seed, {"", bench, false}, only);
  // Blur costs patterns in every rig, so the rig to compare with has the same.
  const std::string blurred = bench + "&vignetting=0.2,0.35&defocus=0.15,0.3&parallax=0.3";
  if (what == "B") return run(size, seed, {"&defocus=0.3,0.3", blurred, true}, only);
  if (what == "map") return run_map(size, seed, blurred);
  if (what == "far") return run_far(size, seed, blurred);
  const std::string ghost = blurred + "&ghost=0.01@4.3,-2.6";
  if (what == "C") return run(size, seed, {"&defocus=0.3,0.3", ghost, true}, only);
  // Cores refer to the ideal T, so what a camera pixel does not show of a cell is in the true error.
  if (what == "estimates-A") return run_estimates(size, seed, bench, false, 0);
  if (what == "estimates-B") return run_estimates(size, seed, blurred, true, 0);
  if (what == "estimates-C") return run_estimates(size, seed, ghost, true, 0);
  if (what == "gain")
    return run_estimates(size, seed, bench + "&vignetting=0.2,0.35", true,
                         argc > 4 ? std::strtod(argv[4], nullptr) : 0.03);
  (void)std::fputs(kUsage, stderr);
  return 2;
}
