// SPDX-License-Identifier: Apache-2.0
// How well Gray-code sequences of random scenes are decoded, against their known maps. One line a seed, then
// all of them. Nothing of the decoder was chosen on seeds from 101 on.
#include "random_sequence.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/base/time.hpp"
#include "symrig/calibration/pixel_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace {

using symrig::Grid;
using symrig::PixelMap;
using symrig::benchmark::Draw;
using symrig::benchmark::RandomGeometry;
using symrig::benchmark::RandomOptics;
using symrig::benchmark::RandomSequence;
using symrig::benchmark::SequenceCamera;

constexpr Grid kCamera{240, 320};
constexpr double kOff = 1.5;      // projector pixels; as judge_map
constexpr double kSigmas = 3;     // of pattern − complement
constexpr double kFarSigmas = 5;  // of the stated sigma

/// A share of a number of pixels.
struct Share {
  double part = 0, all = 0;
  void add(bool yes) { part += yes ? 1 : 0, all += 1; }
  void operator+=(const Share& other) { part += other.part, all += other.all; }
  double percent() const { return all > 0 ? 100 * part / all : NAN; }
};

struct Tally {
  Share lit;                   // valid, of the pixels whose white − black by direct light is above 3 sigma
  Share seen;                  // valid, of those whose finest stripes are above 3 sigma too
  Share dark;                  // valid, of the lit with 11 to 40 levels of 255
  Share off;                   // further than kOff, of the valid
  Share inside;                // the same, away from edges
  Share beyond;                // off and in truth beyond the border of the projector, of the valid
  Share far;                   // further than kFarSigmas along an axis, of the valid away from edges
  std::vector<double> stated;  // error / stated sigma, of the valid away from edges

  void operator+=(const Tally& other) {
    lit += other.lit, seen += other.seen, dark += other.dark, off += other.off, inside += other.inside,
        beyond += other.beyond, far += other.far;
    stated.insert(stated.end(), other.stated.begin(), other.stated.end());
  }
  double ratio() const { return stated.empty() ? NAN : symrig::robust_sigma(stated, 0); }
};

struct Error {
  double col = 0, row = 0;
  double size() const { return std::hypot(col, row); }
};

/// Along the axes that the map knows.
Error error_at(const RandomSequence& truth, const PixelMap& map, int r, int c, int true_r, int true_c) {
  const auto col = static_cast<double>(map.col.at(r, c) - truth.col.at(true_r, true_c));
  if (map.axes == symrig::CodeAxes::columns) return {col, 0};
  return {col, static_cast<double>(map.row.at(r, c) - truth.row.at(true_r, true_c))};
}

/// At an edge a pixel sees two surfaces. The position of either is right.
struct Judged {
  Error error;
  bool edge = false;
};
Judged judge(const RandomSequence& truth, const PixelMap& map, int r, int c) {
  Judged judged{error_at(truth, map, r, c, r, c)};
  for (int y = std::max(r - truth.edge, 0); y <= std::min(r + truth.edge, kCamera.rows - 1); ++y)
    for (int x = std::max(c - truth.edge, 0); x <= std::min(c + truth.edge, kCamera.cols - 1); ++x) {
      if (truth.layer.at(y, x) == truth.layer.at(r, c)) continue;
      judged.edge = true;
      const Error other = error_at(truth, map, r, c, y, x);
      if (other.size() < judged.error.size()) judged.error = other;
    }
  return judged;
}

bool beyond_border(const RandomSequence& truth, const PixelMap& map, std::size_t i) {
  const float col = truth.col.values()[i], row = truth.row.values()[i];
  return col < -0.5F || row < -0.5F || col > static_cast<float>(map.projector.cols) - 0.5F ||
         row > static_cast<float>(map.projector.rows) - 0.5F;
}

void count_valid(const RandomSequence& truth, std::size_t i, bool valid, Tally& tally) {
  const double limit = kSigmas * static_cast<double>(truth.sigma.values()[i]);
  const auto direct = static_cast<double>(truth.direct.values()[i]);
  if (direct <= limit) return;
  tally.lit.add(valid);
  if (static_cast<double>(truth.fine.values()[i]) > limit) tally.seen.add(valid);
  if (direct * 255 >= 11 && direct * 255 <= 40) tally.dark.add(valid);
}

Tally compare(const RandomSequence& truth, const PixelMap* map) {
  Tally tally;
  for (int r = 0; r < kCamera.rows; ++r)
    for (int c = 0; c < kCamera.cols; ++c) {
      const std::size_t i =
          static_cast<std::size_t>(r) * std::size_t{kCamera.cols} + static_cast<std::size_t>(c);
      const bool valid = map != nullptr && map->mask.values()[i] != 0;
      count_valid(truth, i, valid, tally);
      if (!valid) continue;
      const Judged judged = judge(truth, *map, r, c);
      const bool off = judged.error.size() > kOff;
      tally.off.add(off);
      tally.beyond.add(off && beyond_border(truth, *map, i));
      if (judged.edge) continue;
      tally.inside.add(off);
      const double x = judged.error.col / static_cast<double>(map->col_sigma.values()[i]),
                   y = judged.error.row / static_cast<double>(map->row_sigma.values()[i]);
      tally.far.add(std::abs(x) > kFarSigmas || std::abs(y) > kFarSigmas);
      tally.stated.push_back(x);
      if (map->axes == symrig::CodeAxes::both) tally.stated.push_back(y);
    }
  return tally;
}

void print(const std::string& name, const Tally& t, const std::string& scene) {
  fmt::print("{:<5} {:6.2f} {:6.2f} {:6.2f} {:7.3f} {:7.3f} {:7.3f} {:7.3f} {:6.2f}  {}\n", name,
             t.lit.percent(), t.seen.percent(), t.dark.percent(), t.off.percent(), t.inside.percent(),
             t.beyond.percent(), t.far.percent(), t.ratio(), scene);
  (void)std::fflush(stdout);
}

std::string describe(const RandomGeometry& geometry, const RandomOptics& o) {
  return fmt::format(
      "zoom {:.2f} blur {:.2f} {:.2f} white {:.0f} far {:.2f} facing {:.2f} noise {:.1f} {:.1f} "
      "bits {}",
      geometry.zoom(), o.projector_blur, o.camera_blur, 255 * o.brightest, o.far, o.facing,
      255 * o.read_noise, 255 * std::sqrt(o.shot_slope), o.bits);
}

enum class Kind { whole, quarter, without_complements, columns_only, unchecked, faults };
struct Option {
  std::string_view name;
  Kind kind;
};
constexpr Option kOptions[] = {{"--quarter", Kind::quarter},
                               {"--no-complements", Kind::without_complements},
                               {"--columns", Kind::columns_only},
                               {"--unchecked", Kind::unchecked},
                               {"--faults", Kind::faults}};

/// The column pairs, white and black.
symrig::CodePhotographs columns_of(const symrig::CodePhotographs& all) {
  symrig::CodePhotographs columns{symrig::GrayCode(all.code.projector(), symrig::CodeAxes::columns), {}, {}};
  for (int i = 0; i < all.code.photographs(); ++i) {
    if (i >= 2 * all.code.column_bits() && i < all.code.white()) continue;
    columns.names.push_back(all.names[i]);
    columns.images.push_back(all.image(i));
  }
  return columns;
}

/// As a user without complements would have to make them. Such photographs hide their noise.
void derive_complements(symrig::CodePhotographs& photographs) {
  for (int pair = 0; pair < photographs.code.pairs(); ++pair)
    for (std::size_t i = 0; i < photographs.white().values().size(); ++i)
      photographs.images[2 * pair + 1].values()[i] = photographs.white().values()[i] +
                                                     photographs.black().values()[i] -
                                                     photographs.image(2 * pair).values()[i];
}

Tally run_seed(std::uint64_t seed, Kind kind) {
  Draw draw(seed);
  const RandomGeometry geometry(draw, kCamera, kind == Kind::quarter);
  const RandomOptics optics(draw, kCamera);
  const SequenceCamera camera(kCamera, geometry, optics, draw);
  RandomSequence sequence = camera.photograph(draw);
  if (kind == Kind::without_complements) derive_complements(sequence.photographs);
  if (kind == Kind::columns_only) sequence.photographs = columns_of(sequence.photographs);
  const auto map = symrig::decode(sequence.photographs, {.check_sequence = kind != Kind::unchecked});
  Tally tally = compare(sequence, map.ok() ? &*map : nullptr);
  print(std::to_string(seed), tally,
        describe(geometry, optics) + (map.ok() ? "" : "  refused: " + map.error().line()));
  return tally;
}

/// Plants a fault in the photographs of two pairs. The complement follows its pattern.
using Plant = void (*)(std::vector<symrig::Image<float>>& images, std::size_t one, std::size_t other);
struct Fault {
  const char* name;
  Plant plant;
};
constexpr Fault kFaults[] = {
    {"inverted", [](auto& images, std::size_t one, std::size_t) { std::swap(images[one], images[one + 1]); }},
    {"exchanged",
     [](auto& images, std::size_t one, std::size_t other) {
       std::swap(images[one], images[other]);
       std::swap(images[one + 1], images[other + 1]);
     }},
    {"copied",
     [](auto& images, std::size_t one, std::size_t other) {
       images[one] = images[other];
       images[one + 1] = images[other + 1];
     }},
    {"two photographs exchanged",
     [](auto& images, std::size_t one, std::size_t other) { std::swap(images[one], images[other]); }}};

/// How many wrong sequences are refused: three of each fault a seed, at pairs that the seed draws.
int run_faults(std::uint64_t first, std::uint64_t last) {
  constexpr int kEach = 3;
  std::array<Share, std::size(kFaults)> refused{};
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    Draw draw(seed);
    const RandomGeometry geometry(draw, kCamera, false);
    const RandomOptics optics(draw, kCamera);
    const RandomSequence sequence = SequenceCamera(kCamera, geometry, optics, draw).photograph(draw);
    const auto pairs = static_cast<std::size_t>(sequence.photographs.code.pairs());
    const auto drawn = [&](std::size_t below) {
      return static_cast<std::size_t>(draw.uniform() * static_cast<double>(below));
    };
    for (std::size_t k = 0; k < std::size(kFaults); ++k)
      for (int repeat = 0; repeat < kEach; ++repeat) {
        const std::size_t one = drawn(pairs), other = (one + 1 + drawn(pairs - 1)) % pairs;
        symrig::CodePhotographs wrong = sequence.photographs;
        kFaults[k].plant(wrong.images, 2 * one, 2 * other);
        refused[k].add(!symrig::decode(wrong).ok());
      }
  }
  for (std::size_t k = 0; k < std::size(kFaults); ++k)
    fmt::print("{}: {:.0f} of {:.0f} refused\n", kFaults[k].name, refused[k].part, refused[k].all);
  return 0;
}

int run(std::uint64_t first, std::uint64_t last, Kind kind) {
  if (kind == Kind::faults) return run_faults(first, last);
  fmt::print(
      "valid: % of the lit, of those with stripes, of the lit with 11-40 levels. off: % of the valid, "
      "of those away from edges.\n"
      "beyond: % of the valid that are off and beyond the projector's border. far: % beyond five sigmas. "
      "ratio: actual / stated sigma.\n"
      "{:<5} {:>6} {:>6} {:>6} {:>7} {:>7} {:>7} {:>7} {:>6}\n",
      "seed", "lit", "seen", "dark", "off", "inside", "beyond", "far", "ratio");
  const symrig::Stopwatch watch;
  Tally all;
  std::vector<double> ratios;
  int enough = 0, few_off = 0, honest = 0;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const Tally tally = run_seed(seed, kind);
    all += tally;
    enough += tally.lit.percent() >= 90 ? 1 : 0, few_off += tally.off.percent() <= 0.3 ? 1 : 0;
    honest += std::abs(tally.ratio() - 1) <= 0.2 ? 1 : 0;
    if (!tally.stated.empty()) ratios.push_back(tally.ratio());
  }
  print("all", all, fmt::format("{:.0f} s", watch.seconds()));
  fmt::print(
      "seeds: {} valid of the lit >= 90 %, {} off <= 0.3 %, {} ratio within 20 % (quartiles {:.2f} "
      "{:.2f} {:.2f})\n",
      enough, few_off, honest, symrig::quantile(ratios, 0.25), symrig::quantile(ratios, 0.5),
      symrig::quantile(ratios, 0.75));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const auto* const option =
      argc == 4 ? std::ranges::find(kOptions, std::string_view(argv[3]), &Option::name) : std::end(kOptions);
  const bool known = argc == 3 || option != std::end(kOptions);
  const long first = known ? std::strtol(argv[1], nullptr, 10) : 0,
             last = known ? std::strtol(argv[2], nullptr, 10) : 0;
  if (first < 1 || last < first)
    return std::fprintf(stderr,
                        "usage: benchmark_decode FIRST LAST [--quarter | --no-complements | --columns | "
                        "--unchecked | --faults]\n"),
           2;
  const Kind kind = option != std::end(kOptions) ? option->kind : Kind::whole;
  return run(static_cast<std::uint64_t>(first), static_cast<std::uint64_t>(last), kind);
}
