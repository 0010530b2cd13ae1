// SPDX-License-Identifier: Apache-2.0
// T on the camera's own pixels of a bench that was aligned by hand, against the ideal coaxial rig on its
// cells: errors of both, each against its own truth. A ratio of 1 is a perfect bench.
//   benchmark_camera_pixels [SIZE] [SEED] [A|B] [SCENE]
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/base/time.hpp"
#include "symrig/calibration/camera_fit.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/image/outline.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "unit/calibration/camera_errors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace {

using namespace symrig;

using tests::Keeping, tests::LightErrors, tests::lit;

using Photograph = std::function<Image<float>(const Pattern&)>;

struct Rig {
  Photograph found, truth;
  Photograph upsampled;  ///< of a bench: T on the cells, times the flood-lit picture within each of them
  CornerMap corners;     ///< of a bench
  double seconds = 0, patterns = 0, bytes = 0, fit_seconds = 0;
};

LightErrors compared(const Rig& rig, std::span<const Pattern> patterns) {
  LightErrors sums;
  for (const Pattern& p : patterns) {
    const Image<float> found = rig.found(p), truth = rig.truth(p);
    const Grid grid = found.grid();
    for (int y = 0; y < grid.rows; ++y)
      for (int x = 0; x < grid.cols; ++x) {
        const auto is_lit = rig.corners.grid().size() > 0 ? lit(outline_of(rig.corners, y, x), p)
                                                          : std::optional(p.at(y, x) > 0);
        if (is_lit) sums.add(found.at(y, x), truth.at(y, x), *is_lit);
      }
  }
  return sums;
}

/// Light within two cells of lit ones: rows of T over T on the cells, upsampled.
double against_upsampled(const Rig& rig, std::span<const Pattern> patterns) {
  LightErrors rows, upsampled;
  for (const Pattern& p : patterns) {
    const Image<float> found = rig.found(p), other = rig.upsampled(p), truth = rig.truth(p);
    const Grid grid = found.grid();
    for (int y = 0; y < grid.rows; ++y)
      for (int x = 0; x < grid.cols; ++x) {
        const auto is_near = lit(outline_of(rig.corners, y, x), p, 2);
        if (!is_near.value_or(false)) continue;
        rows.add(found.at(y, x), truth.at(y, x), false);
        upsampled.add(other.at(y, x), truth.at(y, x), false);
      }
  }
  return rows.all() / upsampled.all();
}

Photograph upsampling(const TransportTensor& tensor, const CornerMap& corners, const Image<float>& flood) {
  const auto white =
      std::make_shared<const Image<float>>(*tensor.apply(Image<float>(tensor.projector_grid(), 1, 1.F)));
  return [=](const Pattern& p) {
    const Image<float> cells = *tensor.apply(p);
    Image<float> picture(flood.grid());
    for (int y = 0; y < picture.grid().rows; ++y)
      for (int x = 0; x < picture.grid().cols; ++x) {
        Point middle;
        for (const Point& at : outline_of(corners, y, x)) middle.row += at.row / 4, middle.col += at.col / 4;
        if (!(middle.row >= 0 && middle.col >= 0 && middle.row < cells.grid().rows &&
              middle.col < cells.grid().cols))
          continue;
        const int row = static_cast<int>(middle.row), col = static_cast<int>(middle.col);
        const float light = white->at(row, col);
        picture.at(y, x) = light > 0 ? cells.at(row, col) * flood.at(y, x) / light : 0;
      }
    return picture;
  };
}

Result<Rig> ideal(const std::string& uri) {
  SYMRIG_TRY(auto opened, open_virtual_rig(uri));
  const std::shared_ptr<VirtualRig> rig = std::move(opened);
  SYMRIG_TRY(const CaptureResult result, capture(*rig, {}));
  const TransportTensor tensor = result.tensor;
  return Rig{[tensor](const Pattern& p) { return *tensor.apply(p); },
             [rig](const Pattern& p) { return rig->ideal_photograph(p); },
             {},
             {},
             rig->cost().rig_seconds,
             static_cast<double>(result.patterns)};
}

Result<Rig> bench(const std::string& uri) {
  SYMRIG_TRY(auto opened, open_virtual_rig(uri));
  const std::shared_ptr<VirtualRig> rig = std::move(opened);
  SYMRIG_TRY(const Registration registration, register_camera(*rig));
  const double before = rig->cost().rig_seconds;
  const auto log = make_memory_log(rig->grid(), rig->channels(), rig->camera_grid());
  SYMRIG_TRY(const auto probe, RegisteredProbe::make(std::make_unique<Keeping>(*rig, *log), registration));
  CaptureOptions options;
  options.exposure = goal_of_pixels(options.exposure, probe->weights().noise_share());
  SYMRIG_TRY(const CaptureResult result, capture(*probe, options));
  const Stopwatch watch;
  SYMRIG_TRY(CameraTransport fit,
             fit_camera(result.tensor, registration, *log, {.held_out = result.held_out_at}));
  const auto camera = std::make_shared<const CameraTransport>(std::move(fit));
  return Rig{[camera](const Pattern& p) { return *camera->apply(p); },
             [rig](const Pattern& p) { return rig->ideal_photograph(p); },
             upsampling(result.tensor, rig->exact_corners().front(),
                        rig->ideal_photograph(Image<float>(rig->grid(), 1, 1.F))),
             rig->exact_corners().front(),
             rig->cost().rig_seconds - before,
             static_cast<double>(result.patterns),
             static_cast<double>(camera->bytes()) / static_cast<double>(camera->rows()),
             watch.seconds()};
}

/// optics: of the ideal rig.
Result<void> compare(const std::string& scene, const std::string& keys, const std::string& optics) {
  SYMRIG_TRY(const Rig coaxial, ideal(scene + optics));
  SYMRIG_TRY(const Rig found, bench(scene + keys));
  SYMRIG_TRY(const auto sized, open_virtual_rig(scene));
  const Grid grid = sized->grid();
  std::vector<Pattern> dots, random;
  Random draw(7);
  for (int k = 0; k < 16; ++k) {
    dots.emplace_back(grid);
    for (float& v : dots.back().values()) v = draw.uniform() < 1.0 / 64 ? 1 : 0;
    if (k < 4) random.push_back(random_pattern(grid, 7 + k));
  }
  const std::vector<Pattern> bar{bar_pattern(grid)}, natural{natural_pattern(grid, 7)};
  const auto row = [&](std::span<const Pattern> patterns, double (LightErrors::*error)() const) {
    const double a = (compared(found, patterns).*error)(), b = (compared(coaxial, patterns).*error)();
    return fmt::format("{:.4f} {:5.2f}", a, a / b);
  };
  fmt::print("{:<18} {}   {}   {}   {}   {:5.2f} {:5.0f} {:5.2f} {:5.2f} {:6.0f} {:6.2f}\n",
             sized->uri().name, row(dots, &LightErrors::aside), row(bar, &LightErrors::aside),
             row(random, &LightErrors::all), row(natural, &LightErrors::all), against_upsampled(found, dots),
             found.patterns, found.patterns / coaxial.patterns, found.seconds / coaxial.seconds, found.bytes,
             found.fit_seconds);
  (void)std::fflush(stdout);
  return {};
}

}  // namespace

int main(int count, char** words) {
  const int size = count > 1 ? static_cast<int>(std::strtol(words[1], nullptr, 10)) : 32;
  const int seed = count > 2 ? static_cast<int>(std::strtol(words[2], nullptr, 10)) : 1;
  const bool b = count > 3 && std::string_view(words[3]) == "B";
  const int camera = static_cast<int>(std::lround(b ? size * 3.72 + 66 : size * 4.75));
  const std::string keys =
      b ? fmt::format(
              "&camera={0}x{0}&turn=1.5&zoom={1:.4f}&shift=7.3,-4.1&distortion=0.02&vignetting=0.2,0.35"
              "&defocus=0.15,0.3&parallax=0.3",
              camera, 3.72 * size / camera)
        : fmt::format("&camera={0}x{0}&turn=1.5&zoom=0.784&shift=3.3,-2.1&distortion=0.02", camera);
  const std::string optics = b ? "&defocus=0.3,0.3" : "";
  fmt::print("{0}x{0} cells, seed {1}: {2}\n", size, seed, keys);
  fmt::print("{:<18} {:<12}   {:<12}   {:<12}   {:<12}   {:>5} {:>5} {:>5} {:>5} {:>6} {:>6}\n", "scene",
             "dots, aside", "bar, outside", "random", "natural", "upsam", "shots", "ratio", "time", "bytes",
             "fit s");
  const std::vector<std::string> all{"vgroove-textured", "occluder", "gummy", "mirror", "views2"};
  const std::vector<std::string> asked(words + std::min(count, 4), words + count);
  for (const std::string& name : asked.empty() ? all : asked) {
    const std::string scene = fmt::format("sim:{}?size={}x{}&fine=4&seed={}", name, size, size, seed);
    if (const auto done = compare(scene, keys, optics); !done)
      fmt::print("{:<18} {}\n", name, done.error().line());
  }
  return 0;
}
