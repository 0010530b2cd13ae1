// SPDX-License-Identifier: Apache-2.0
#include "symrig/sim/virtual_rig.hpp"

#include "sim/image_formation.hpp"
#include "symrig/testing/probe_laws.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include <tbb/global_control.h>

namespace symrig::sim::virtual_rig_test {
namespace {
using namespace probe_laws;  // NOLINT(google-build-using-namespace)

std::unique_ptr<VirtualRig> open(const std::string& uri) {
  auto rig = open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << rig.error().line();
  return *std::move(rig);
}

class LawfulRig : public testing::TestWithParam<std::string> {};

TEST_P(LawfulRig, keeps_the_probe_laws) {
  expect_probe_laws(*open(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(
    Rigs, LawfulRig,
    testing::Values("sim:plane?size=40x50&noise=off", "sim:plane?size=40x50", "sim:plane?size=1x1",
                    "sim:gummy?size=1x97", "sim:gummy?size=97x1&noise=off", "sim:vgroove-white?size=2x3",
                    "sim:vgroove-textured?size=61x47&noise=off", "sim:vgroove-textured?size=61x47",
                    "sim:vgroove-mixed?size=61x47&psf=0.08&seed=3", "sim:gummy?size=50x60&channels=3",
                    "sim:occluder?size=40x44&noise=off&channels=3", "sim:mirror?size=48x40",
                    "sim:views2?size=50x45&exposures=3&ratio=6", "sim:vgroove-textured?size=40x40&black=0.02",
                    "sim:plane?size=40x40&exposures=auto", "sim:gummy?size=64x64&indirect=0.01&exposures=6",
                    "sim:plane?size=30x30&exposures=1"));

// Dead pixels are known and invalid; reciprocity needs both ends of a path, so it is asked of the others
// only.
TEST(DeadPixels, keep_the_other_laws) {
  expect_probe_laws(*open("sim:vgroove-textured?size=40x50&dead=0.05"), false);
  expect_probe_laws(*open("sim:vgroove-textured?size=40x50&dead=0.05&noise=off"), false);
}

// Without noise the photograph is T p to the last bit: the same code computes both.
TEST(NoiseOff, shows_the_scene_itself) {
  for (const std::string scene : {"plane", "gummy", "mirror", "vgroove-textured"}) {
    const auto rig = open("sim:" + scene + "?size=33x47&noise=off&channels=3");
    const Pattern pattern = law_pattern(rig->grid(), 5);
    const auto p = measured(*rig, {pattern});
    EXPECT_EQ(p[0].mean, rig->truth().apply(pattern)) << scene;
    EXPECT_EQ(*std::max_element(p[0].variance.values().begin(), p[0].variance.values().end()), 0.F);
    EXPECT_EQ(*std::min_element(p[0].valid.values().begin(), p[0].valid.values().end()), 1);
  }
}

// The scene stays the same to the last bit. Of two draws, independent noise of as many pixels correlates by
// less than 5 / sqrt(pixels): 5 sigma.
TEST(NoiseSeed, draws_other_noise_in_the_same_scene) {
  const std::string uri = "sim:vgroove-textured?size=48x48&seed=3";
  const auto one = open(uri), other = open(uri + "&noise_seed=1"), again = open(uri + "&noise_seed=1");
  const Pattern pattern = law_pattern(one->grid(), 5);
  const auto truth = one->truth().apply(pattern);
  EXPECT_EQ(truth, other->truth().apply(pattern));
  const auto a = measured(*one, {pattern})[0].mean, b = measured(*other, {pattern})[0].mean;
  EXPECT_EQ(b, measured(*again, {pattern})[0].mean);
  double both = 0, first = 0, second = 0;
  for (std::size_t i = 0; i < truth.values().size(); ++i) {
    // Divided by the light's root, which is in proportion to the noise's sigma.
    const double sigma = std::sqrt(static_cast<double>(truth.values()[i]) + 1e-3);
    const double of_one = (a.values()[i] - truth.values()[i]) / sigma;
    const double of_other = (b.values()[i] - truth.values()[i]) / sigma;
    both += of_one * of_other, first += of_one * of_one, second += of_other * of_other;
  }
  EXPECT_GT(first, 0);
  EXPECT_LT(std::abs(both) / std::sqrt(first * second), 5.0 / 48);
}

/// A photograph with no error.
Radiance exact(Image<float> mean) {
  const Grid grid = mean.grid();
  const int channels = mean.channels();
  return {std::move(mean), Image<float>(grid, channels), Image<std::uint8_t>(grid, channels, 1)};
}

// Photographs against the truth: the stated variance explains the deviation, black level and all. The bias of
// the merge is at most 0.02 sigma away from saturation (hdr/merge.hpp); black errors are shared by all
// photographs, hence the wide statistical allowance of 5/√n on the mean of one.
TEST(NoiseCamera, deviates_from_the_scene_as_much_as_it_says) {
  for (const std::string uri :
       {"sim:vgroove-textured?size=96x80", "sim:gummy?size=96x80&seed=2&black=0.01",
        "sim:plane?size=96x80&seed=3", "sim:mirror?size=96x80", "sim:views3?size=96x80&channels=3",
        "sim:gummy?size=96x80&ratio=3&exposures=2"}) {
    const auto rig = open(uri);
    const std::vector<Pattern> patterns{law_pattern(rig->grid(), 1), Pattern(rig->grid(), 1, 1.F)};
    const auto photographs = measured(*rig, patterns);
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      const Radiance truth = exact(rig->truth().apply(patterns[i]));
      const Term terms[] = {{1, &photographs[i]}, {-1, &truth}};
      const Whitened residual = whiten(terms);
      const auto n = static_cast<double>(residual.count);
      EXPECT_NEAR(residual.mean_square, 1, 0.04 + 5 * std::sqrt(2 / n)) << uri << " " << i;
      EXPECT_NEAR(residual.mean, 0, 0.03 + 5 / std::sqrt(n)) << uri << " " << i;
    }
  }
}

// Metering leaves headroom: no pixel of the flood-lit scene saturates the shortest frame, so all are valid.
TEST(NoiseCamera, never_saturates_the_shortest_frame) {
  for (const auto name : scene_names()) {
    const auto rig = open("sim:" + std::string(name) + "?size=60x55&seed=4");
    const auto p = measured(*rig, {Pattern(rig->grid(), 1, 1.F)});
    EXPECT_EQ(*std::min_element(p[0].valid.values().begin(), p[0].valid.values().end()), 1) << name;
  }
}

bool same(const Radiance& a, const Radiance& b) {
  return a.mean == b.mean && a.variance == b.variance && a.valid == b.valid;
}

std::vector<Pattern> some_patterns(Grid grid) {
  std::vector<Pattern> patterns;
  for (std::uint64_t i = 0; i < 21; ++i) patterns.push_back(law_pattern(grid, i));
  return patterns;
}

const std::string kBusy = "sim:vgroove-textured?size=30x41&drift=0.01&flare=0.02&dead=0.01&channels=3";

TEST(Noise, does_not_depend_on_how_patterns_are_batched) {
  const auto whole = open(kBusy);
  const auto patterns = some_patterns(whole->grid());
  const auto at_once = measured(*whole, patterns);
  const auto parts = open(kBusy);
  std::vector<Radiance> piecewise;
  for (std::size_t first = 0, size = 1; first < patterns.size(); first += size, size = size % 5 + 1) {
    const auto last = std::min(first + size, patterns.size());
    for (auto& r : measured(*parts, {patterns.begin() + static_cast<std::ptrdiff_t>(first),
                                     patterns.begin() + static_cast<std::ptrdiff_t>(last)}))
      piecewise.push_back(std::move(r));
  }
  ASSERT_EQ(piecewise.size(), at_once.size());
  for (std::size_t i = 0; i < at_once.size(); ++i) EXPECT_TRUE(same(at_once[i], piecewise[i])) << i;
}

TEST(Noise, does_not_depend_on_the_number_of_threads) {
  const auto patterns = some_patterns({30, 41});
  const auto many = measured(*open(kBusy), patterns);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const auto one = measured(*open(kBusy), patterns);
  for (std::size_t i = 0; i < many.size(); ++i) EXPECT_TRUE(same(many[i], one[i])) << i;
}

TEST(Noise, differs_with_the_seed_and_from_photograph_to_photograph) {
  const auto rig = open("sim:vgroove-white?size=20x20&seed=1");
  const auto other = open("sim:vgroove-white?size=20x20&seed=2");
  const Pattern pattern(rig->grid(), 1, 1.F);
  const auto p = measured(*rig, {pattern, pattern});
  EXPECT_NE(p[0].mean, p[1].mean);
  EXPECT_NE(p[0].mean, measured(*other, {pattern})[0].mean);
}

TEST(Misalign, shifts_the_camera_only) {
  const auto rig = open("sim:gummy?size=30x34&noise=off&misalign=0.3");
  const Pattern pattern = law_pattern(rig->grid(), 2);
  Image<float> expected = rig->truth().apply(pattern);
  shift(expected.grid(), 0.3, expected.plane(0));
  EXPECT_EQ(measured(*rig, {pattern})[0].mean, expected);
}

// The laws that these optics break must be seen to break: 1e-3 is a hundred times the tolerance of the law.
TEST(Reciprocity, is_broken_by_flare_and_misalignment) {
  for (const std::string keys : {"flare=0.05", "misalign=0.4"}) {
    const auto rig = open("sim:vgroove-textured?size=40x40&noise=off&" + keys);
    Pattern a(rig->grid()), b(rig->grid());
    for (int row = 0; row < 40; ++row)
      for (int col = 0; col < 40; ++col)
        ((row * 40 + col) % 3 == 0 ? a : b).at(row, col) = row < 20 ? 1 : 0.5F;
    const auto p = measured(*rig, {a, b});
    EXPECT_GT(std::abs(reciprocity(a, b, p[0], p[1])[0]), 1e-3) << keys;
  }
}

// A probe that states half its variance breaks the laws: residuals come out with a mean square of 2.
TEST(Whiten, notices_an_understated_variance) {
  const auto rig = open("sim:vgroove-textured?size=40x40&exposures=4");
  const Pattern pattern = law_pattern(rig->grid(), 1);
  auto p = measured(*rig, {pattern, pattern});
  for (auto& photograph : p)
    for (float& variance : photograph.variance.values()) variance *= 0.5F;
  const Term repeated[] = {{1, p.data()}, {-1, &p[1]}};
  EXPECT_GT(whiten(repeated).mean_square, 1.5);
}

// Lamp: 1 + drift · n / 1000. The metering frames are numbers 0 to 3, eight black ones and a reference
// follow: 13 is the first photograph, 63 the second reference. Until then nothing is known; after it the line
// through the references is the lamp itself: noise-free readings leave nothing to the slope that is expected.
// 5 % is two and a half times the drift that a lamp is expected to have, so that it is taken for drift, not
// for jumps.
TEST(Drift, changes_the_lamp_until_a_second_reference_tells_it) {
  const auto rig = open("sim:plane?size=8x8&noise=off&drift=-0.05&exposures=4");
  const Pattern flood(rig->grid(), 1, 1.F);
  const auto p = measured(*rig, std::vector<Pattern>(161, flood));
  const float truth = rig->truth().apply(flood).at(3, 3);
  const auto lamp = [](int n) { return 1 - 0.05 * n / 1000; };
  EXPECT_NEAR(p[0].mean.at(3, 3) / truth, lamp(13), 1e-6);
  EXPECT_NEAR(p[49].mean.at(3, 3) / truth, lamp(62), 1e-6);
  for (const std::size_t i : {50U, 99U, 100U, 160U})
    EXPECT_NEAR(p[i].mean.at(3, 3) / truth, lamp(12), 1e-6) << i;
}

/// Light of a photograph over that of another one, and its relative sigma.
std::pair<double, double> light_ratio(const Radiance& photograph, const Image<float>& truth) {
  double seen = 0, variance = 0, expected = 0;
  for (std::size_t i = 0; i < truth.values().size(); ++i) {
    seen += photograph.mean.values()[i];
    variance += photograph.variance.values()[i];
    expected += truth.values()[i];
  }
  return {seen / expected, std::sqrt(variance) / expected};
}

// 1 % over 400 photographs, with camera noise: from the second reference on each photograph has the light of
// the first reference within noise. σ is that of one flood-lit photograph: the photograph's own, the first
// reference's and the line's, which foretells at most one interval ahead: √(1 + 1 + 5) σ at its worst, with
// two references at its base. 5 such sigmas, and 0.03 of one for the merge's bias.
TEST(Drift, is_corrected_to_the_noise_of_the_references) {
  for (const std::string drift : {"0.025", "-0.025", "0"}) {
    const auto rig = open("sim:vgroove-textured?size=48x48&drift=" + drift);
    const Pattern flood(rig->grid(), 1, 1.F);
    const Image<float> truth = rig->truth().apply(flood);
    const auto p = measured(*rig, std::vector<Pattern>(400, flood));
    const double start = 1 + std::stod(drift) * 12 / 1000;
    for (std::size_t i = 50; i < p.size(); ++i) {
      const auto [ratio, sigma] = light_ratio(p[i], truth);
      ASSERT_NEAR(ratio / start, 1, 5 * std::sqrt(7.0) * sigma) << drift << ", photograph " << i;
    }
  }
}

// Dead pixels stay dead: the mask is the same in every photograph, whatever is shown and however dark.
TEST(Dead, pixels_are_invalid_in_every_photograph) {
  for (const std::string share : {"0.001", "0.01"}) {
    const auto rig = open("sim:vgroove-textured?size=64x64&dead=" + share);
    std::vector<Pattern> patterns = some_patterns(rig->grid());
    patterns.emplace_back(rig->grid());          // dark
    patterns.emplace_back(rig->grid(), 1, 1.F);  // flood-lit
    const auto p = measured(*rig, patterns);
    const auto dead = std::ranges::count(p.back().valid.values(), 0);
    EXPECT_NEAR(static_cast<double>(dead), 4096 * std::stod(share), 5 * std::sqrt(4096 * std::stod(share)));
    EXPECT_GE(dead, 1);
    for (const Radiance& photograph : p) {
      EXPECT_EQ(photograph.valid, p.back().valid);
      for (std::size_t i = 0; i < photograph.valid.values().size(); ++i) {
        if (photograph.valid.values()[i] == 0) {
          ASSERT_EQ(photograph.mean.values()[i], 0);
        }
      }
    }
  }
}

TEST(Dead, pixels_are_invalid_and_the_others_are_not) {
  for (const std::string noise : {"off", "camera"}) {
    const auto rig = open("sim:gummy?size=60x60&dead=0.04&channels=3&noise=" + noise);
    const auto p = measured(*rig, {Pattern(rig->grid(), 1, 1.F)});
    int invalid = 0;
    for (const auto valid : p[0].valid.plane(0)) invalid += valid == 0;
    EXPECT_NEAR(invalid, 144, 5 * std::sqrt(144.0));  // binomial, 5 sigmas
    EXPECT_TRUE(
        std::equal(p[0].valid.plane(0).begin(), p[0].valid.plane(0).end(), p[0].valid.plane(2).begin()));
  }
}

// Each photograph waits for a refresh and lasts at least as long as its exposures; 4 frames each, 4 metering
// (the last one saturates, or would with noise) and 8 · 4 black frames before the first, and one reference of
// 4 with it.
TEST(Cost, counts_frames_and_time) {
  for (const std::string noise : {"off", "camera"}) {
    const auto rig = open("sim:vgroove-textured?size=20x20&exposures=4&noise=" + noise);
    const ProbeCost before = rig->cost();
    EXPECT_EQ(before.photographs, 0);
    EXPECT_EQ(before.frames, 4 + 8 * 4);
    EXPECT_GT(before.rig_seconds, 1);
    measured(*rig, std::vector<Pattern>(40, Pattern(rig->grid(), 1, 1.F)));
    const ProbeCost after = rig->cost();
    EXPECT_EQ(after.photographs, 40);
    EXPECT_EQ(after.frames, before.frames + 160 + 4);
    const double each = (after.rig_seconds - before.rig_seconds) / 40;
    EXPECT_GT(each, 0.5);  // the longest exposure alone is 512 times some milliseconds
    EXPECT_LT(each, 5);
    EXPECT_GT(after.simulate_seconds, before.simulate_seconds);
    EXPECT_GT(after.merge_seconds, before.merge_seconds);
  }
}

// The same scene in time: noise or not, the board runs the same kind of program.
TEST(Cost, is_alike_with_and_without_noise) {
  const auto ideal = open("sim:vgroove-textured?size=40x40&exposures=4&noise=off");
  const auto noisy = open("sim:vgroove-textured?size=40x40&exposures=4");
  const std::vector<Pattern> patterns(10, Pattern({40, 40}, 1, 1.F));
  measured(*ideal, patterns);
  measured(*noisy, patterns);
  EXPECT_EQ(ideal->cost().frames, noisy->cost().frames);
  EXPECT_NEAR(ideal->cost().rig_seconds / noisy->cost().rig_seconds, 1, 0.1);
}

// A run of 16 photographs of two minutes lasts half an hour, and its edges are known when it is over. Each
// must be on the host's clock as well as in a short run: a clock that knows its last half minute only would
// put the first ones where others may be too.
TEST(LongRuns, know_their_first_frames_as_well_as_their_last) {
  const auto rig = open("sim:gummy?size=24x24&indirect=1e-4&black=0&exposures=auto");
  Pattern pattern(rig->grid());
  pattern.at(3, 3) = 1;
  const std::vector<Pattern> patterns(16, pattern);
  Expectation weak;
  weak.parts.push_back({{{1e-7, 575}}, 1e-22});
  weak.longest_seconds = 120;
  const double before = rig->cost().rig_seconds;
  const auto p = rig->measure_expected(patterns, std::vector<Expectation>(16, weak));
  ASSERT_TRUE(p.ok()) << p.error().line();
  EXPECT_GT(rig->cost().rig_seconds - before, 16 * 60);
  EXPECT_EQ(rig->rig().trouble().frames[Verdict::ambiguous], 0);
  EXPECT_EQ(rig->rig().trouble().retaken, 0);
}

/// Seconds of a photograph of weak light that is to be known well, after the first ones.
double seconds_each(VirtualRig& rig) {
  const std::vector<Pattern> patterns(8, Pattern(rig.grid()));
  Expectation weak;
  weak.parts.push_back({{{1e-3, 576}}, 2.5e-9});
  double before = 0;
  for (int k = 0; k < 2; ++k) {
    before = rig.cost().rig_seconds;
    EXPECT_TRUE(rig.measure_expected(patterns, std::vector<Expectation>(8, weak)).ok());
  }
  return (rig.cost().rig_seconds - before) / 8;
}

// White gives 1e7 electrons a second, and black a tenth of that: a deviation of 5e-5 then takes 3 s, and 40
// ms without black. Four exposures with the ratio 8 that begin below saturation take 1.3 s.
TEST(BlackLevel, takes_no_longer_than_fixed_exposures_and_is_told) {
  const auto planned = open("sim:gummy?size=24x24&black=0.1"),
             fixed = open("sim:gummy?size=24x24&black=0.1&exposures=4");
  constexpr double kRefresh = 1.0 / 60;  // that a photograph may wait for
  EXPECT_LE(seconds_each(*planned), seconds_each(*fixed) + kRefresh);
  const std::vector<std::string> warnings = planned->rig().trouble().warnings;
  ASSERT_EQ(warnings.size(), 1);
  EXPECT_TRUE(warnings[0].starts_with("the projector's black is ")) << warnings[0];
  EXPECT_TRUE(fixed->rig().trouble().warnings.empty());
  const auto dark = open("sim:gummy?size=24x24");
  EXPECT_LE(seconds_each(*dark), 0.2);
  EXPECT_TRUE(dark->rig().trouble().warnings.empty());
}

TEST(OpenVirtualRig, refuses_what_it_cannot_be) {
  EXPECT_EQ(open_virtual_rig("sim:gumy").error().code, ErrorCode::unknown_name);
  EXPECT_EQ(open_virtual_rig("plane").error().code, ErrorCode::bad_argument);
  EXPECT_EQ(open_virtual_rig("sim:plane?size=9999x9999").error().code, ErrorCode::limit);
  const auto bracket = open_virtual_rig("sim:plane?size=4x4&exposures=8&ratio=64");
  ASSERT_FALSE(bracket.ok());
  EXPECT_EQ(bracket.error().code, ErrorCode::limit) << bracket.error().line();
}

TEST(OpenVirtualRig, tells_what_it_is) {
  const auto rig = open("sim:plane?size=12x10&noise=off&psf=0.1");
  EXPECT_EQ(rig->describe(), "sim:plane?size=12x10&noise=off&psf=0.1");
  EXPECT_EQ(rig->uri().psf, 0.1);
  EXPECT_EQ(rig->truth().grid(), (Grid{12, 10}));
}

}  // namespace
}  // namespace symrig::sim::virtual_rig_test
