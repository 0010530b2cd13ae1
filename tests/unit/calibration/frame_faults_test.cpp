// SPDX-License-Identifier: Apache-2.0
// One table: what can be wrong with frames of a camera × the commands that read them (`merge`, `calibrate
// --sensor`).
#include "faulty_photographs.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "unit/hdr/simulated_sensor.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

namespace symrig::frame_faults_test {
namespace {

/// What is wrong with the frames that `merge` and `calibrate --sensor` read.
struct FrameFault {
  const char* name;
  std::function<void(SensorPhotographs&)> bracket, sensor;  ///< empty: it does not apply
  /// What a refusal or a warning must say, any of these.
  std::vector<std::string> causes = {};
  bool moved = false;
};

void PrintTo(const FrameFault& fault, std::ostream* out) {
  *out << fault.name;
}

using Codes = SensorPhotographs::Codes;

constexpr Grid kFrame{64, 64};

double shade(int i) {
  return static_cast<double>(1 + i * 389 % 997) / 997;
}

double row_of(std::size_t pixel) {
  const std::size_t row = pixel / static_cast<std::size_t>(kFrame.cols);
  return static_cast<double>(row);
}

/// Light of each colour of a mosaic, as a share.
double no_filter(int /*pixel*/) {
  return 1;
}
double colour_filter(int pixel) {
  return (pixel / kFrame.cols + pixel) % 2 == 0 ? 0.5 : 1;
}

double steady(int /*frame*/) {
  return 1;
}
double flickering(int frame) {
  return 1 + 0.2 * std::sin(2.1 * frame);
}
double fading(int frame) {
  return 1 - 0.06 * frame;
}

/// Frames of a linear camera of 12 bits: 6 dark ones, 5 levels of even light, 4 exposures of a scene.
/// lamp: of frame n of the lit ones.
SensorPhotographs good_frames(double (*filter)(int) = no_filter, double (*lamp)(int) = steady) {
  const NoiseModel noise = NoiseModel::from_electrons({});
  test::Random random(31);
  int lit = 0;
  const auto frame = [&](const std::function<double(int)>& light) {
    Codes codes;
    for (int i = 0; i < kFrame.size(); ++i)
      codes.push_back(test::sample(noise, filter(i) * lamp(lit) * light(i) * noise.full_well(), random));
    ++lit;
    return codes;
  };
  SensorPhotographs all;
  all.grid = kFrame;
  all.bits = 12;
  for (int k = 0; k < 6; ++k) all.dark.push_back(frame([](int) { return 0.0; }));
  lit = 0;
  for (const double level : {0.1, 0.25, 0.4, 0.55, 0.7}) {
    SensorPhotographs::Codes first = frame([=](int) { return level; });
    all.flat.push_back({std::move(first), frame([=](int) { return level; })});
  }
  lit = 0;
  for (int k = 0; k < 4; ++k)
    all.bracket.push_back({frame([=](int i) { return 0.12 * shade(i) * (1 << k); }),
                           std::chrono::milliseconds(5 << k), fmt::format("{}.png", k)});
  return all;
}

void change_codes(SensorPhotographs& all, const std::function<double(double)>& code) {
  const auto change = [&](Codes& codes) {
    for (auto& one : codes) one = static_cast<std::uint16_t>(std::lround(std::clamp(code(one), 0.0, 4095.0)));
  };
  for (Codes& one : all.dark) change(one);
  for (auto& level : all.flat)
    for (Codes& one : level) change(one);
  for (auto& still : all.bracket) change(still.codes);
}

/// Each code becomes a weighted sum of itself and of its neighbours in the row.
void filter_flats(SensorPhotographs& all, double middle) {
  for (auto& level : all.flat)
    for (Codes& codes : level) {
      const Codes old = codes;
      for (std::size_t i = 1; i + 1 < codes.size(); ++i)
        codes[i] = static_cast<std::uint16_t>(
            std::lround(middle * old[i] + (1 - middle) / 2 * (old[i - 1] + old[i + 1])));
    }
}

/// The codes of exposure k become those of another one.
void rearrange(SensorPhotographs& all, const std::vector<std::size_t>& from) {
  std::vector<Codes> codes;
  codes.reserve(from.size());
  for (const std::size_t k : from) codes.push_back(all.bracket[k].codes);
  for (std::size_t k = 0; k < codes.size(); ++k) all.bracket[k].codes = codes[k];
}

std::vector<FrameFault> frame_faults() {
  using S = SensorPhotographs;
  const auto clip = [](double at) {
    return [=](S& all) { change_codes(all, [=](double v) { return std::min(v, at); }); };
  };
  const auto gamma = [](S& all) {
    change_codes(all, [](double v) { return 4095 * std::pow(v / 4095, 1 / 2.2); });
  };
  const auto stuck = [](S& all) {
    for (Codes& one : all.dark) one[700] = 4095;
    for (auto& level : all.flat)
      for (Codes& one : level) one[700] = 4095;
    for (auto& still : all.bracket) still.codes[700] = 4095;
  };
  const auto dead_row = [](S& all) {
    for (auto& level : all.flat)
      for (Codes& one : level) std::fill(one.begin() + 640, one.begin() + 704, std::uint16_t{64});
    for (auto& still : all.bracket)
      std::fill(still.codes.begin() + 640, still.codes.begin() + 704, std::uint16_t{64});
  };
  const auto doubled_frame = [](S& all) {
    for (auto& level : all.flat) level[1] = level[0];
  };
  const auto moved = [](S& all) {
    for (std::size_t k = 2; k < 4; ++k)
      std::rotate(all.bracket[k].codes.begin(), all.bracket[k].codes.begin() + std::ptrdiff_t{64} * 5 + 9,
                  all.bracket[k].codes.end());
  };
  const auto part_moved = [](S& all) {
    for (std::size_t k = 2; k < 4; ++k) {
      Codes& codes = all.bracket[k].codes;
      std::rotate(codes.begin() + 512, codes.begin() + 512 + 9, codes.begin() + 1024);
    }
  };
  const auto flicker = [](S& all) { all = good_frames(no_filter, flickering); };
  const auto drift = [](S& all) { all = good_frames(no_filter, fading); };
  const auto one_level = [](S& all) {
    test::Random random(9);
    for (auto& level : all.flat)
      for (Codes& one : level)
        for (auto& v : one)
          v = test::sample(NoiseModel::from_electrons({}), 0.5 * NoiseModel::from_electrons({}).full_well(),
                           random);
  };
  const auto exchanged_folders = [](S& all) {
    const auto dark_codes = all.dark;
    all.dark.clear();
    for (const auto& level : all.flat) all.dark.insert(all.dark.end(), level.begin(), level.end());
    all.flat.clear();
    for (std::size_t k = 0; k + 1 < dark_codes.size(); k += 2)
      all.flat.push_back({dark_codes[k], dark_codes[k + 1]});
  };
  const auto lit_dark = [](S& all) {
    test::Random random(11);
    for (std::size_t k = 2; k < all.dark.size(); ++k)
      for (auto& v : all.dark[k])
        v = test::sample(NoiseModel::from_electrons({}), 0.2 * NoiseModel::from_electrons({}).full_well(),
                         random);
  };
  const auto bands = [](S& all) {
    for (std::size_t k = 0; k < all.bracket.size(); ++k)
      for (std::size_t i = 0; i < all.bracket[k].codes.size(); ++i)
        all.bracket[k].codes[i] = static_cast<std::uint16_t>(std::lround(std::clamp(
            all.bracket[k].codes[i] * (1 + 0.25 * std::sin(0.4 * row_of(i) + 2.0 * static_cast<double>(k))),
            0.0, 4095.0)));
  };
  const auto cut_black = [](S& all) { change_codes(all, [](double v) { return v - 62; }); };
  const auto mosaic = [](S& all) { all = good_frames(colour_filter); };
  const auto dark = [](S& all) {
    for (auto& level : all.flat)
      for (std::size_t k = 0; k < level.size(); ++k) level[k] = all.dark[k];
    for (std::size_t k = 0; k < all.bracket.size(); ++k) all.bracket[k].codes = all.dark[k];
  };
  return {
      {"good", [](S&) {}, [](S&) {}},
      {"dark", dark, dark, {"no flat level", "dark"}},
      {"doubled frame", {}, doubled_frame, {"taken twice"}},
      {"moved", moved, {}, {"moved or changed"}, true},
      {"a part moved", part_moved, {}, {"moved or changed"}, true},
      {"flicker", flicker, flicker, {"times by its exposure"}},
      {"drift", drift, drift, {"times by its exposure"}},
      {"one level", {}, one_level, {"automatic exposure", "level"}},
      {"dark frames for flat ones", {}, exchanged_folders, {"dark"}},
      {"room light in dark frames", {}, lit_dark, {"dark"}},
      {"gamma", gamma, {}, {"times by its exposure"}},
      {"bands", bands, {}, {"differ in bands"}},
      {"cut black", cut_black, {}, {"times by its exposure"}},
      {"a level that saturates",
       {},
       [](S& all) {
         all.flat.push_back({Codes(kFrame.size(), 4095), Codes(kFrame.size(), 4095)});
       }},
      {"mosaic as grey", mosaic, {}},
      {"clipped at 3000", clip(3000), clip(3000), {"clips at code 3000"}},
      {"late",
       [](S& all) {
         rearrange(all, {3, 0, 1, 2});
       },
       {},
       {"one late"}},
      {"doubled",
       [](S& all) {
         rearrange(all, {0, 1, 1, 2});
       },
       {},
       {"doubled"}},
      {"reversed",
       [](S& all) {
         rearrange(all, {3, 2, 1, 0});
       },
       {},
       {"reverse order"}},
      {"exchanged",
       [](S& all) {
         rearrange(all, {0, 2, 1, 3});
       },
       {},
       {"exchanged"}},
      {"automatic exposure",
       [](S& all) {
         const S other = good_frames();
         test::Random random(5);
         for (auto& still : all.bracket)
           for (std::size_t i = 0; i < still.codes.size(); ++i)
             still.codes[i] =
                 static_cast<std::uint16_t>(other.bracket[2].codes[i] + std::lround(3 * random.normal()));
       },
       {},
       {"automatic exposure"}},
      {"gamma", {}, gamma, {"gamma"}},
      {"sharpened", {}, [](S& all) { filter_flats(all, 2); }, {"sharpened"}},
      {"denoised, JPEG", {}, [](S& all) { filter_flats(all, 0.5); }, {"denoised or JPEG"}},
      {"bands",
       {},
       [](S& all) {
         for (auto& level : all.flat)
           for (std::size_t k = 0; k < level.size(); ++k)
             for (std::size_t i = 0; i < level[k].size(); ++i)
               level[k][i] = static_cast<std::uint16_t>(std::lround(
                   level[k][i] * (1 + 0.05 * std::sin(0.4 * row_of(i) + 2.0 * static_cast<double>(k)))));
       },
       {"bands"}},
      {"stuck pixel", stuck, stuck},
      {"dead row", dead_row, dead_row},
      {"cut black",
       {},
       [](S& all) { change_codes(all, [](double v) { return v - 62; }); },
       {"cut at code 0"}},
      {"mosaic as grey", {}, mosaic},
  };
}

class FrameFaults : public testing::TestWithParam<FrameFault> {};

/// The scene's shades to a twentieth where pixels are valid: 1 % of photon noise, at five sigmas.
TEST_P(FrameFaults, are_named_or_do_no_harm_to_a_bracket) {
  const FrameFault& fault = GetParam();
  if (!fault.bracket) return;  // it does not apply
  SensorPhotographs all = good_frames();
  fault.bracket(all);
  KnownCamera known;
  known.sensor.emplace();
  known.sensor->noise = NoiseModel::from_electrons({});
  const auto merged = merge_bracket(all, known);
  if (!merged) {
    test::expect_named(fault, "merge", merged.error().line());
    return;
  }
  if (!merged->warnings.empty())
    test::expect_named(fault, "merge", fmt::format("{}", fmt::join(merged->warnings, "; ")));
  const auto filter = std::string(fault.name) == "mosaic as grey" ? colour_filter : no_filter;
  double wrong = 0;
  for (int i = 0; i < kFrame.size(); ++i) {
    if (merged->radiance.valid.values()[i] == 0 || shade(i) < 0.3) continue;
    const double truth = filter(i) * 0.12 * shade(i) * known.sensor->noise.full_well() / 5e-3;
    wrong += std::abs(static_cast<double>(merged->radiance.mean.values()[i]) / truth - 1) > 0.1 ? 1 : 0;
  }
  EXPECT_LE(wrong, 64) << fault.name;  // a dead row
}

/// Gain and read noise to five of the sigmas that are stated.
TEST_P(FrameFaults, are_named_or_do_no_harm_to_a_sensor) {
  const FrameFault& fault = GetParam();
  if (!fault.sensor) return;  // it does not apply
  SensorPhotographs all = good_frames();
  all.bracket.clear();
  fault.sensor(all);
  const auto found = examine_sensor(all);
  if (!found) {
    test::expect_named(fault, "sensor", found.error().line());
    return;
  }
  const NoiseModel noise = NoiseModel::from_electrons({});
  EXPECT_NEAR(found->sensor->noise.gain() / noise.gain(), 1, 5 * found->sensor->gain_sigma) << fault.name;
  EXPECT_NEAR(found->sensor->noise.read_noise() / noise.read_noise(), 1, 5 * found->sensor->read_noise_sigma)
      << fault.name;
}
INSTANTIATE_TEST_SUITE_P(Frames, FrameFaults, testing::ValuesIn(frame_faults()));

}  // namespace
}  // namespace symrig::frame_faults_test
