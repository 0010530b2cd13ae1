// SPDX-License-Identifier: Apache-2.0
// benchmark_random_scenes [first last [ROWSxCOLS [picture.png]]]: a row for each seed, as
// Markdown: what each seed of sim:random draws, and how its light is distributed. The picture shows for each
// seed the flood-lit scene and the photograph of one lit point, without that point. Both have a tone curve
// that shows dim light.
#include "sim/drawn/recipe.hpp"
#include "symrig/image/file.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace {

using namespace symrig;

std::unique_ptr<Scene> scene_of(const SceneUri& uri) {
  auto scene = make_scene(uri);
  if (!scene) {
    (void)std::fprintf(stderr, "%s\n", scene.error().line().c_str());
    std::exit(4);
  }
  return *std::move(scene);
}

Image<float> flood_lit(const Scene& scene) {
  return scene.apply(Image<float>(scene.grid(), 1, 1.F));
}

double sum(const Image<float>& image) {
  return std::accumulate(image.values().begin(), image.values().end(), 0.0);
}

/// Share of the flood-lit photograph that is not the direct bounce.
double indirect_share(SceneUri uri, const Image<float>& flood) {
  uri.indirect = 0;
  return 1 - sum(flood_lit(*scene_of(uri))) / sum(flood);
}

/// The brightest against the dimmest of the points that return light, without the outer 2 % at both ends.
double range(const Image<float>& flood) {
  std::vector<float> lit;
  std::copy_if(flood.values().begin(), flood.values().end(), std::back_inserter(lit),
               [](float v) { return v > 0; });
  std::sort(lit.begin(), lit.end());
  return static_cast<double>(lit[lit.size() - 1 - lit.size() / 50] / lit[lit.size() / 50]);
}

double dark_share(const Image<float>& flood) {
  return static_cast<double>(std::count(flood.values().begin(), flood.values().end(), 0.F)) /
         static_cast<double>(flood.grid().size());
}

void print_row(const SceneUri& uri, const Image<float>& flood) {
  fmt::print("| {} | {:.1f} % | {:.0f} % | {:.0f} | {} |\n", uri.seed, 100 * indirect_share(uri, flood),
             100 * dark_share(flood), range(flood),
             sim::drawn::ingredients(sim::drawn::draw_recipe(uri.seed, uri.size)));
}

/// Values from 0 to 1 with the brightest at 1, and a power that shows dim light.
void paste(const Image<float>& from, double power, int row, int col, Image<std::uint8_t>& to) {
  const float most = *std::max_element(from.values().begin(), from.values().end());
  for (int r = 0; r < from.grid().rows; ++r)
    for (int c = 0; c < from.grid().cols; ++c) {
      const double share = most > 0 ? from.at(r, c) / most : 0;
      to.at(row + r, col + c) = static_cast<std::uint8_t>(std::lround(255 * std::pow(share, power)));
    }
}

int number(const char* text) {
  return static_cast<int>(std::strtol(text, nullptr, 10));
}

Image<float> one_point(const Scene& scene) {
  const Grid grid = scene.grid();
  Image<float> light(grid);
  const int row = static_cast<int>(0.55 * grid.rows), col = static_cast<int>(0.45 * grid.cols);
  light.at(row, col) = 1;
  Image<float> seen = scene.apply(light);
  seen.at(row, col) = 0;
  return seen;
}

}  // namespace

int main(int argc, char** argv) {
  const int first = argc > 1 ? number(argv[1]) : 1, last = argc > 2 ? number(argv[2]) : 60;
  const std::string size = argc > 3 ? argv[3] : "64x64";
  constexpr int kAcross = 5, kGap = 4;
  Image<std::uint8_t> picture;
  for (int seed = first; seed <= last; ++seed) {
    const auto uri = parse_scene_uri(fmt::format("sim:random?seed={}&size={}", seed, size));
    if (!uri) return 2;
    const Grid grid = uri->size;
    const int rows = (last - first + kAcross) / kAcross, k = seed - first;
    if (picture.empty())
      picture = Image<std::uint8_t>({rows * (grid.rows + kGap), kAcross * 2 * (grid.cols + kGap)}, 1, 255);
    const auto scene = scene_of(*uri);
    const Image<float> flood = flood_lit(*scene);
    print_row(*uri, flood);
    const int row = k / kAcross * (grid.rows + kGap), col = k % kAcross * 2 * (grid.cols + kGap);
    paste(flood, 0.45, row, col, picture);
    paste(one_point(*scene), 0.3, row, col + grid.cols + 1, picture);
  }
  if (argc <= 4) return 0;
  const auto bytes = encode_png(picture);
  std::ofstream file(argv[4], std::ios::binary);
  std::copy(bytes.begin(), bytes.end(), std::ostreambuf_iterator<char>(file));
  file.close();
  return file ? 0 : 4;
}
