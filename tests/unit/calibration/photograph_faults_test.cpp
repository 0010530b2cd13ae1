// SPDX-License-Identifier: Apache-2.0
// One table: what can be wrong with photographs × the commands that read them. A command gives the right
// result, or it refuses and names this cause first or second, of at most three. And good photographs of many
// kinds.
#include "faulty_photographs.hpp"
#include "scratch.hpp"
#include "symrig/calibration/first_bounce.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::photograph_faults_test {
namespace {

using test::Bench;
using test::change_each;
using test::compressed;
using test::looked_up;
using test::overlap;
using test::Photographs;
using test::reorder;
using test::scale;
using test::sharpened;
using test::turn;

struct Fault {
  const char* name;
  std::function<void(Photographs&)> light;
  std::function<void(CodePhotographs&)> codes;
  /// What a refusal must say, any of these. Empty: there is no refusal.
  std::vector<std::string> causes;
  bool moved = false;
};

void PrintTo(const Fault& fault, std::ostream* out) {
  *out << fault.name;
}

Fault of_light(const char* name, std::vector<std::string> causes, std::function<void(Photographs&)> light) {
  return {name, std::move(light), {}, std::move(causes)};
}
Fault of_codes(const char* name, std::vector<std::string> causes,
               std::function<void(CodePhotographs&)> codes) {
  return {name, {}, std::move(codes), std::move(causes)};
}

std::vector<Fault> orders() {
  std::vector<Fault> all{
      of_light("late", {"one late"},
               [](Photographs& p) { reorder(p, [&](int k) { return k == 0 ? p.count() - 1 : k - 1; }); }),
      of_light("reversed", {"reverse order"},
               [](Photographs& p) { reorder(p, [&](int k) { return p.count() - 1 - k; }); }),
      of_light("counter began again", {"begins with 15.png"},
               [](Photographs& p) { reorder(p, [&](int k) { return (k + 7) % p.count(); }); }),
      of_light("patterns before complements", {"all patterns come before all complements"},
               [](Photographs& p) {
                 const int half = p.code.pairs();
                 reorder(p, [&](int k) { return k < half ? 2 * k : k < 2 * half ? 2 * (k - half) + 1 : k; });
               }),
      of_light("finest first", {"finest stripes come first"},
               [](Photographs& p) {
                 reorder(p, [](int k) {
                   return k < 10 ? 8 - k / 2 * 2 + k % 2 : k < 20 ? 28 - k / 2 * 2 + k % 2 : k;
                 });
               }),
      of_light("rows first", {"rows come before the columns"},
               [](Photographs& p) { reorder(p, [](int k) { return k < 20 ? (k + 10) % 20 : k; }); }),
      of_light("white and black first", {"white and black come first"},
               [](Photographs& p) { reorder(p, [](int k) { return k < 2 ? 20 + k : k - 2; }); }),
      of_light("white and black exchanged", {"white"},
               [](Photographs& p) { std::swap(p.light[20], p.light[21]); }),
      of_light("complements first", {"complement comes before"},
               [](Photographs& p) { reorder(p, [](int k) { return k < 20 ? k ^ 1 : k; }); }),
      of_light("inverted", {"inverted"}, [](Photographs& p) { reorder(p, [](int k) { return k ^ 1; }); }),
  };
  for (const int j : {0, 3, 8, 15, 19}) {
    all.push_back(of_light("doubled", {fmt::format("{:02}.png is {:02}.png once more", j + 1, j), "one late"},
                           [=](Photographs& p) { reorder(p, [&](int k) { return k <= j ? k : k - 1; }); }));
    all.push_back(of_light("lost", {"missing"}, [=](Photographs& p) {
      reorder(p, [&](int k) { return k < j ? k : std::min(k + 1, p.count() - 1); });
    }));
  }
  for (const std::size_t pair : {0, 1, 4, 5, 6, 9})
    all.push_back(of_light("swapped pair", {fmt::format("{:02}.png and {:02}.png", 2 * pair, 2 * pair + 1)},
                           [=](Photographs& p) { std::swap(p.light[2 * pair], p.light[2 * pair + 1]); }));
  return all;
}

std::vector<Fault> rigs() {
  std::vector<Fault> all{
      of_light("dark", {"not brighter", "no pixel is brighter"},
               [](Photographs& p) { scale(p, [](int, int) { return 0.0; }); }),
      of_light("lamp off", {"not brighter", "no pixel is brighter"},
               [](Photographs& p) { p.light.assign(p.light.size(), p.light.back()); }),
      of_light("full wells", {"saturated"},
               [](Photographs& p) {
                 p.bench.exposure = 1.6, p.bench.noise = 0.0006;  // after the wells are full: of reading
                 for (auto& light : p.light) change_each(light, [](double v) { return std::min(v, 0.5); });
               }),
      of_codes("clipped below the largest code", {"saturated"},
               [](CodePhotographs& p) {
                 for (auto& i : p.images) change_each(i, [](double v) { return std::min(1.6 * v, 0.6); });
               }),
      of_codes("clipped", {"saturated"},
               [](CodePhotographs& p) {
                 for (auto& i : p.images) change_each(i, [](double v) { return std::min(2 * v, 1.0); });
               }),
      of_light("mirrored", {"mirrored"},
               [](Photographs& p) {
                 turn(p, {60, 80}, [](int r, int c) { return std::pair(r, 79 - c); });
               }),
      of_light("upside down in a mirror", {"mirrored"},
               [](Photographs& p) {
                 turn(p, {60, 80}, [](int r, int c) { return std::pair(59 - r, c); });
               }),
      of_light("upside down", {},
               [](Photographs& p) {
                 turn(p, {60, 80}, [](int r, int c) { return std::pair(59 - r, 79 - c); });
               }),
      of_light("on its side", {},
               [](Photographs& p) {
                 turn(p, {80, 60}, [](int r, int c) { return std::pair(59 - c, r); });
               }),
      of_light("transposed", {"transposed"},
               [](Photographs& p) {
                 turn(p, {80, 60}, [](int r, int c) { return std::pair(c, r); });
               }),
      of_light("flicker", {"flickers"},
               [](Photographs& p) {
                 std::uint64_t n = 77;
                 std::vector<double> g(p.light.size());
                 for (double& one : g) one = 1 + 0.2 * test::normal(n);
                 scale(p, [&](int, int k) { return g[k]; });
               }),
      of_light("automatic exposure", {"automatic"},
               [](Photographs& p) {
                 for (auto& light : p.light) {
                   double sum = 0;
                   for (const float v : light.values()) sum += static_cast<double>(v);
                   const double gain =
                       std::clamp(0.25 * static_cast<double>(p.bench.camera.size()) / sum, 0.3, 3.0);
                   change_each(light, [=](double v) { return gain * v; });
                 }
               }),
      of_light("ambient in all", {},
               [](Photographs& p) {
                 for (auto& light : p.light) change_each(light, [](double v) { return v + 0.2; });
               }),
      of_light("ambient not in black", {"room light"},
               [](Photographs& p) {
                 for (int k = 0; k < 21; ++k) change_each(p.light[k], [](double v) { return v + 0.2; });
               }),
      of_light("ambient in patterns", {"room light"},
               [](Photographs& p) {
                 for (int k = 0; k < 20; ++k) change_each(p.light[k], [](double v) { return v + 0.2; });
               }),
      of_light("ambient from 9 on", {"room light", "exposure or lamp has changed"},
               [](Photographs& p) {
                 for (int k = 9; k < 22; ++k) change_each(p.light[k], [](double v) { return v + 0.2; });
               }),
      of_light("stuck pixel", {},
               [](Photographs& p) {
                 for (auto& light : p.light) light.at(30, 40) = 2;
               }),
      of_light("dead row", {},
               [](Photographs& p) { scale(p, [](int r, int) { return r == 30 ? 0.0 : 1.0; }); }),
      of_codes("shifted black", {"black level"},
               [](CodePhotographs& p) {
                 for (std::size_t k = 1; k < p.images.size(); k += 3)
                   change_each(p.images[k], [](double v) { return v + 0.08; });
               }),
      of_codes("cut black", {},
               [](CodePhotographs& p) {
                 for (auto& i : p.images) change_each(i, [](double v) { return std::max(v - 0.03, 0.0); });
               }),
      of_codes("compressed", {"compressed"},
               [](CodePhotographs& p) {
                 for (auto& i : p.images) i = compressed(i);
               }),
      of_light("mosaic", {},
               [](Photographs& p) {
                 for (auto& light : p.light)
                   for (int r = 0; r < 60; ++r)
                     for (int c = 0; c < 80; ++c)
                       light.at(r, c) *= r % 2 == 0 && c % 2 == 0   ? 0.4F
                                         : r % 2 != 0 && c % 2 != 0 ? 0.3F
                                                                    : 1.0F;
               }),
      of_light("sharpened", {"sharpened"},
               [](Photographs& p) {
                 for (auto& light : p.light) light = sharpened(light);
               }),
      of_light("object moved", {"has moved or changed"},
               [](Photographs& p) {
                 for (int k = 9; k < 22; ++k)
                   for (int r = 10; r < 30; ++r)
                     for (int c = 10; c < 35; ++c) p.light[k].at(r, c) *= 0.4F;
               }),
  };
  all.back().moved = true;
  for (const double power : {1.3, 1.8, 2.2})
    all.push_back(of_codes("gamma", {"gamma"}, [=](CodePhotographs& p) {
      for (auto& i : p.images)
        change_each(i, [=](double v) { return std::round(255 * std::pow(v, 1 / power)) / 255; });
    }));
  for (const double by : {0.15, 0.4})
    all.push_back(of_light("bands", {"bands"}, [=](Photographs& p) {
      scale(p, [=](int r, int k) { return 1 + by * std::sin(0.35 * r + 2.4 * k); });
    }));
  for (const double share : {0.1, 0.25, 0.45})
    all.push_back(
        of_light("overlap", {"overlap"}, [=](Photographs& p) { overlap(p, [=](int) { return share; }); }));
  all.push_back(of_light("overlap by rows", {"overlap"}, [](Photographs& p) {
    overlap(p, [](int r) { return std::max(0.0, 0.5 - r / 60.0); });
  }));
  for (const double by : {0.1, 0.3, 0.6})
    all.push_back(of_light("drift", {"drift", "lamp"},
                           [=](Photographs& p) { scale(p, [=](int, int k) { return 1 - by * k / 21; }); }));
  for (const int first : {5, 12})
    for (const int by : {1, 3, 7}) {
      all.push_back(of_light("moved", {"moved"}, [=](Photographs& p) {
        for (int k = first; k < p.count(); ++k)
          p.light[k] = looked_up(p.light[k], p.bench.camera,
                                 [=](int r, int c) { return std::pair(r + by / 2, c + by); });
      }));
      all.back().moved = true;
    }
  return all;
}

/// Positions are known to 0.75 pixels or better (DecodePolicy::largest_sigma): one in a hundred may be off by
/// twice that, and at the depth edges the truth itself jumps.
void expect_right(const Photographs& truth, const PixelMap& map, const std::string& name) {
  double decoded = 0, wrong = 0, inside = 0;
  for (std::size_t i = 0; i < map.mask.values().size(); ++i) {
    const float col = truth.col.values()[i], row = truth.row.values()[i];
    inside += col > 0 && row > 0 && col < 31 && row < 23 ? 1 : 0;
    if (map.mask.values()[i] == 0) continue;
    decoded += 1;
    wrong += std::abs(map.col.values()[i] - col) > 1.5F || std::abs(map.row.values()[i] - row) > 1.5F ? 1 : 0;
  }
  EXPECT_GT(decoded, 0.5 * (1 - truth.bench.dark_part) * inside) << name;
  EXPECT_LE(wrong, 0.01 * decoded + 10) << name;
}

/// What the scene looks like under all light, without the room's: to a twentieth of its mean. The sum of the
/// bias of noise (below 1 %) and of pixels at the depth edges, which have two footprints.
void expect_right(const Photographs& truth, const FirstBounceFit& fit, const std::string& name) {
  const auto seen = fit.tensor.apply(Pattern(truth.bench.projector, 1, 1.0F));
  ASSERT_TRUE(seen.ok());
  double squares = 0, mean = 0;
  const auto white = truth.light[20].values(), black = truth.light[21].values();
  for (std::size_t i = 0; i < seen->values().size(); ++i) {
    const double light = 0.75 * truth.bench.exposure * static_cast<double>(white[i] - black[i]);
    squares += std::pow(static_cast<double>(seen->values()[i]) - light, 2);
    mean += light;
  }
  const auto n = static_cast<double>(seen->values().size());
  EXPECT_LT(std::sqrt(squares / n) / (mean / n), 0.05) << name;
}

class PhotographFaults : public testing::TestWithParam<Fault> {};

TEST_P(PhotographFaults, are_named_or_do_no_harm) {
  const Fault& fault = GetParam();
  static const Photographs good = test::photograph({});
  Photographs all = good;
  if (fault.light) fault.light(all);
  CodePhotographs codes = test::coded(all);
  if (fault.codes) fault.codes(codes);
  if (const auto checked = check_gray_code(codes); !checked) {
    test::expect_named(fault, "calibrate", checked.error().line());
    return;
  }
  const auto map = decode(codes);
  if (map)
    expect_right(all, *map, std::string("calibrate, ") + fault.name);
  else
    test::expect_named(fault, "calibrate", map.error().line());
  const auto fit = fit_first_bounce(codes);
  if (fit)
    expect_right(all, *fit, std::string("fit, ") + fault.name);
  else
    test::expect_named(fault, "fit", fit.error().line());
}
INSTANTIATE_TEST_SUITE_P(Orders, PhotographFaults, testing::ValuesIn(orders()));
INSTANTIATE_TEST_SUITE_P(Rigs, PhotographFaults, testing::ValuesIn(rigs()));

// Dim and bright, of few bits, low contrast, another black level, much room light, a dark scene, a mirror.
TEST(GoodPhotographs, are_not_refused) {
  std::vector<Bench> benches;
  for (const double exposure : {0.1, 0.3, 1.0})
    for (const double ambient : {0.0, 0.02, 0.3})
      for (const double dark : {0.0, 0.6, 0.8})
        for (const int bits : {8, 12})
          benches.push_back({.exposure = exposure,
                             .ambient = ambient,
                             .black_level = ambient == 0 ? 0.06 : 0.01,
                             .noise = 0.002,
                             .dark_part = dark,
                             .bits = bits,
                             .seed = benches.size() + 1});
  for (const Bench& bench : benches) {
    Photographs all = test::photograph(bench);
    const bool mirrored = bench.seed % 5 == 0;
    if (mirrored) turn(all, bench.camera, [](int r, int c) { return std::pair(r, 79 - c); });
    const std::string name = fmt::format("exposure {} ambient {} dark {} bits {}", bench.exposure,
                                         bench.ambient, bench.dark_part, bench.bits);
    const CodePhotographs codes = test::coded(all);
    const auto map = decode(codes, {.mirrored = mirrored});
    ASSERT_TRUE(map.ok()) << name << ": " << map.error().line();
    expect_right(all, *map, name);
    if (bench.seed % 9 != 1) continue;
    FitOptions options;
    options.decode.mirrored = mirrored;
    const auto fit = fit_first_bounce(codes, options);
    EXPECT_TRUE(fit.ok()) << name << ": " << fit.error().line();
  }
}

/// Patterns, white and black.
std::vector<Image<float>> without_complements(const Photographs& all) {
  const CodePhotographs codes = test::coded(all);
  std::vector<Image<float>> images;
  for (int k = 0; k < codes.code.photographs(); ++k)
    if (k % 2 == 0 || k > codes.code.white()) images.push_back(codes.image(k));
  return images;
}

TEST(PhotographsWithoutComplements, faults_are_named) {
  using Images = std::vector<Image<float>>;
  struct Partial {
    const char* name;
    std::function<void(Images&)> change;
    std::vector<std::string> causes;
    bool moved = false;
  };
  const std::vector<Partial> faults{
      {"dark",
       [](Images& all) { std::fill(all.begin(), all.end() - 1, all.back()); },
       {"not brighter", "no pixel is brighter"}},
      {"reversed", [](Images& all) { std::ranges::reverse(all); }, {"the order is", "check the order"}},
      {"late", [](Images& all) { std::rotate(all.begin(), all.end() - 1, all.end()); }, {"one late"}},
      {"inverted",
       [](Images& all) {
         for (std::size_t k = 0; k + 2 < all.size(); ++k)
           for (std::size_t i = 0; i < all[k].values().size(); ++i)
             all[k].values()[i] =
                 all[all.size() - 2].values()[i] + all.back().values()[i] - all[k].values()[i];
         std::swap(all[all.size() - 2], all.back());
       },
       {"black for white"}},
      {"mirrored",
       [](Images& all) {
         for (auto& one : all)
           one = looked_up(one, one.grid(), [](int r, int c) { return std::pair(r, 79 - c); });
       },
       {"mirrored"}},
      {"moved",
       [](Images& all) {
         for (int k = 0; k < 4; ++k)
           all[k] = looked_up(all[k], all[k].grid(), [](int r, int c) { return std::pair(r + 3, c + 5); });
       },
       {"moved"},
       true},
  };
  const Photographs good = test::photograph({});
  for (const Partial& fault : faults) {
    std::vector<Image<float>> images = without_complements(good);
    fault.change(images);
    std::vector<std::string> names;
    for (std::size_t k = 0; k < images.size(); ++k) names.push_back(fmt::format("{:02}.png", k));
    const auto codes = arrange_code_photographs(good.bench.projector, std::move(images), std::move(names));
    ASSERT_TRUE(codes.ok()) << codes.error().line();
    const auto checked = check_gray_code(*codes);
    if (!checked) {
      test::expect_named(fault, "calibrate", checked.error().line());
      continue;
    }
    const auto map = decode(*codes);
    if (map)
      ADD_FAILURE() << fault.name << " is not refused";
    else
      test::expect_named(fault, "calibrate", map.error().line());
  }
}

/// The photographs as files.
class Folder : public testing::Test {
 protected:
  /// Writes photograph k under this name.
  void write(const std::function<std::string(int)>& name) {
    const CodePhotographs codes = test::coded(good_);
    for (int k = 0; k < codes.code.photographs(); ++k)
      ASSERT_TRUE(write_image(scratch_ / name(k), codes.image(k)).ok());
  }
  Result<PixelMap> decoded() const {
    return decode_gray_code(scratch_.folder(), {.projector = good_.bench.projector}, {});
  }

  const Photographs good_ = test::photograph({});
  test::Scratch scratch_;
};

// macOS writes ._NAME beside each file on some drives.
TEST_F(Folder, a_counter_that_begins_again_and_hidden_files_do_no_harm) {
  for (const int first : {0, 1}) {
    write([=](int k) { return fmt::format("IMG_{:04}.png", k < 10 ? 9990 + k : k - 10 + first); });
    std::ofstream(scratch_ / "._IMG_9990.png") << "Mac OS X";
    const auto map = decoded();
    ASSERT_TRUE(map.ok()) << map.error().line();
    expect_right(good_, *map, "a counter that begins again");
    for (const auto& file : std::filesystem::directory_iterator(scratch_.folder()))
      std::filesystem::remove(file.path());
  }
}

TEST_F(Folder, one_that_was_taken_twice_is_named) {
  write([](int k) { return fmt::format("{:02}.png", k < 8 ? k : k + 1); });
  std::filesystem::copy_file(scratch_ / "07.png", scratch_ / "08.png");
  const auto map = decoded();
  ASSERT_FALSE(map.ok());
  EXPECT_NE(map.error().line().find("08.png shows the same as 07.png: it was taken twice"), std::string::npos)
      << map.error().line();
}

}  // namespace
}  // namespace symrig::photograph_faults_test
