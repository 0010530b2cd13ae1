// SPDX-License-Identifier: Apache-2.0
// A small bench of projector and camera whose photographs can have every fault that a table names.
#pragma once

#include "symrig/calibration/gray_code.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::test {

/// What differs from one good bench to another.
struct Bench {
  Grid camera{60, 80}, projector{24, 32};
  double exposure = 1;    ///< white reaches 0.75 of the largest code at 1
  double ambient = 0.02;  ///< light of the room, share of the projector's
  double far = 0.08;      ///< light by way of the whole scene
  double black_level = 0.01;
  double noise = 0.002;  ///< of a photograph, share of the largest code
  double dark_part = 0;  ///< of the scene has almost no light
  int bits = 12;
  std::uint64_t seed = 1;
};

/// A sequence in the making: first light, then codes.
struct Photographs {
  Bench bench;
  GrayCode code{bench.projector};
  std::vector<Image<float>> light;  ///< of each photograph, 1 = white at albedo 1
  Image<float> col, row;            ///< the true position of each camera pixel
  std::vector<std::string> names = {};

  int count() const { return static_cast<int>(light.size()); }
};

inline double bench_col(int r, int c) {
  const bool step = c > 45 && c < 60 && r > 15 && r < 40;
  return -1 + 0.425 * c + 0.01 * r + 0.4 * std::sin(c / 15.0) + (step ? 1.5 : 0);
}
inline double bench_row(int r, int c) {
  return -0.8 + 0.42 * r - 0.012 * c;
}

/// The light of a pattern of the projector, by sampling each footprint at 5 × 5 points.
inline Image<float> light_of(const Bench& bench, const Pattern& pattern) {
  constexpr double kSigma = 0.45;
  const auto values = pattern.values();
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  Image<float> light(bench.camera);
  for (int r = 0; r < bench.camera.rows; ++r)
    for (int c = 0; c < bench.camera.cols; ++c) {
      double sum = 0, weights = 0;
      for (int i = -2; i <= 2; ++i)
        for (int j = -2; j <= 2; ++j) {
          const double w = std::exp(-0.5 * (i * i + j * j));
          const int y = static_cast<int>(std::lround(bench_row(r, c) + kSigma * i)),
                    x = static_cast<int>(std::lround(bench_col(r, c) + kSigma * j));
          if (y >= 0 && y < pattern.grid().rows && x >= 0 && x < pattern.grid().cols)
            sum += w * static_cast<double>(pattern.at(y, x));
          weights += w;
        }
      const bool dark = c < bench.dark_part * bench.camera.cols;
      const double albedo =
          (0.55 + 0.2 * std::sin(0.31 * r) * std::cos(0.27 * c) + ((r / 9 + c / 11) % 2 ? 0.2 : -0.2)) *
          (dark ? 0.01 : 1);
      light.at(r, c) =
          static_cast<float>(albedo * ((1 - bench.far) * sum / weights + bench.far * mean + bench.ambient));
    }
  return light;
}

inline Photographs photograph(const Bench& bench) {
  Photographs all{
      bench, GrayCode(bench.projector), {}, Image<float>(bench.camera), Image<float>(bench.camera)};
  for (int k = 0; k < all.code.photographs(); ++k) all.light.push_back(light_of(bench, all.code.pattern(k)));
  for (int r = 0; r < bench.camera.rows; ++r)
    for (int c = 0; c < bench.camera.cols; ++c)
      all.col.at(r, c) = static_cast<float>(bench_col(r, c)),
                    all.row.at(r, c) = static_cast<float>(bench_row(r, c));
  return all;
}

/// Light becomes codes: black level, noise, whole codes of so many bits.
inline CodePhotographs coded(const Photographs& all) {
  CodePhotographs photographs{all.code, all.names, {}};
  std::uint64_t counter = all.bench.seed << 32;
  const double most = std::pow(2.0, all.bench.bits) - 1;
  for (const Image<float>& light : all.light) {
    Image<float> image(light.grid());
    for (std::size_t i = 0; i < image.values().size(); ++i) {
      const double seen = all.bench.black_level +
                          0.75 * all.bench.exposure * static_cast<double>(light.values()[i]) +
                          all.bench.noise * normal(counter);
      image.values()[i] = static_cast<float>(std::round(most * std::clamp(seen, 0.0, 1.0)) / most);
    }
    photographs.images.push_back(std::move(image));
    if (photographs.names.size() < photographs.images.size())
      photographs.names.push_back(fmt::format("{:02}.png", photographs.images.size() - 1));
  }
  return photographs;
}

inline void change_each(Image<float>& image, const std::function<double(double)>& value) {
  for (float& v : image.values()) v = static_cast<float>(value(static_cast<double>(v)));
}

/// Photograph k becomes what photograph from(k) was.
inline void reorder(Photographs& all, const std::function<int(int)>& from) {
  std::vector<Image<float>> light;
  light.reserve(all.light.size());
  for (int k = 0; k < all.count(); ++k) light.push_back(all.light[from(k)]);
  all.light = std::move(light);
}

/// factor: of a row of photograph k.
inline void scale(Photographs& all, const std::function<double(int row, int k)>& factor) {
  for (int k = 0; k < all.count(); ++k)
    for (int r = 0; r < all.bench.camera.rows; ++r)
      for (int c = 0; c < all.bench.camera.cols; ++c)
        all.light[k].at(r, c) *= static_cast<float>(factor(r, k));
}

/// Each photograph contains this share of the one before.
inline void overlap(Photographs& all, const std::function<double(int row)>& share) {
  const std::vector<Image<float>> old = all.light;
  for (std::size_t k = 1; k < old.size(); ++k)
    for (int r = 0; r < all.bench.camera.rows; ++r)
      for (int c = 0; c < all.bench.camera.cols; ++c) {
        const auto s = static_cast<float>(share(r));
        all.light[k].at(r, c) = (1 - s) * old[k].at(r, c) + s * old[k - 1].at(r, c);
      }
}

/// Where a pixel of a turned picture was.
using PixelPlace = std::function<std::pair<int, int>(int row, int col)>;

inline Image<float> looked_up(const Image<float>& from, Grid grid, const PixelPlace& place) {
  Image<float> image(grid);
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.cols; ++c) {
      const auto [row, col] = place(r, c);
      image.at(r, c) =
          from.at(std::clamp(row, 0, from.grid().rows - 1), std::clamp(col, 0, from.grid().cols - 1));
    }
  return image;
}

/// The camera turns or mirrors its pictures.
inline void turn(Photographs& all, Grid grid, const PixelPlace& place) {
  for (Image<float>& light : all.light) light = looked_up(light, grid, place);
  all.col = looked_up(all.col, grid, place);
  all.row = looked_up(all.row, grid, place);
}

inline Image<float> sharpened(const Image<float>& image) {
  Image<float> sharp = image;
  for (int r = 1; r + 1 < image.grid().rows; ++r)
    for (int c = 1; c + 1 < image.grid().cols; ++c) {
      float mean = 0;
      for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j) mean += image.at(r + i, c + j) / 9;
      sharp.at(r, c) = std::max(2 * image.at(r, c) - mean, 0.0F);
    }
  return sharp;
}

/// As strong compression does: the details of each 2 × 2 pixels are rounded to a twentieth of the range.
inline Image<float> compressed(const Image<float>& image) {
  Image<float> out = image;
  for (int r = 0; r + 1 < image.grid().rows; r += 2)
    for (int c = 0; c + 1 < image.grid().cols; c += 2) {
      const float mean =
          (image.at(r, c) + image.at(r, c + 1) + image.at(r + 1, c) + image.at(r + 1, c + 1)) / 4;
      for (int i = 0; i < 4; ++i) {
        float& v = out.at(r + i / 2, c + i % 2);
        v = mean + std::round((v - mean) * 20) / 20;
      }
    }
  return out;
}

/// The first two causes of a refusal, and how many there are.
inline std::pair<std::string, std::size_t> first_causes(const std::string& line) {
  const std::string mark = "possible causes: ", between = "; or ";
  const auto begin = line.find(mark);
  if (begin == std::string::npos) return {line, 1};
  std::size_t count = 1, at = begin, second = std::string::npos;
  while ((at = line.find(between, at + 1)) != std::string::npos) {
    ++count;
    if (count == 3) second = at;
  }
  return {line.substr(0, second), count};
}

/// One of the fault's causes is named first or second, of at most three. "Moved" is said only of what moved.
template <class Fault>
void expect_named(const Fault& fault, const std::string& command, const std::string& line) {
  const auto named = first_causes(line);
  EXPECT_LE(named.second, 3U) << command << ": " << line;
  EXPECT_TRUE(std::ranges::any_of(
      fault.causes, [&](const std::string& one) { return named.first.find(one) != std::string::npos; }))
      << fault.name << ", " << command << ": " << line;
  if (!fault.moved) {
    EXPECT_EQ(line.find("moved"), std::string::npos) << fault.name << ", " << command << ": " << line;
  }
}

}  // namespace symrig::test
