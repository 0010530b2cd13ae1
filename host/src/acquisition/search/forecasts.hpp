// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/search_facts.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/hdr/bracket_plan.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// A level of the search while its photographs are taken.
struct LevelPlan {
  int level = 0;
  std::int64_t planned = 0;          ///< photographs of this level
  std::int64_t before = 0;           ///< photographs of the level before
  std::int64_t taken = 0;            ///< photographs when this level is done
  double direct_share = 0;           ///< of all photographs: flood-lit ones at the end
  std::span<const double> children;  ///< of a block of each level that can be searched: 4, fewer near pixels
};

/// LevelPlan::children of a tree.
std::vector<double> children_per_block(const BlockTree& tree);

/// Photographs after this level. The tests of the level above decide how many a level needs, but successive
/// levels are alike. Captures of all simulated scenes from 24x40 to 128x128, tolerances from 1e-5 to 3e-3:
/// a level took 0.7 to 2.2 times the photographs of the level before, and all later levels 0.9 to 1.7 times
/// in the mean. The result is unknown where blocks share no photographs, because then nothing bounds the next
/// level. It is unknown in level 0 too, after which scenes of direct light end.
UnitsToCome forecast_later(const LevelPlan& plan);

/// Photographs of this level and all later ones, if level 2 takes `second` times as many as level 1 and each
/// later one `growth` times as many as the one before, as far as its blocks have children to light.
double photographs_if_growing(const LevelPlan& plan, double second, double growth);

/// Photographs of this level and all later ones, if each level grows as much as the forecast allows.
double most_photographs(const LevelPlan& plan);

/// Foresees nothing: for the first photograph of a capture, the flood-lit one.
class FirstLook final : public Forecaster {
 public:
  std::vector<Expectation> expect(std::span<const LitBlocks> patterns, std::span<const Preview> /*previews*/,
                                  SecondsEach most) const override {
    return std::vector<Expectation>(
        patterns.size(),
        Expectation{.parts = {}, .most_seconds = most.photograph, .black_seconds = most.black});
  }
};

/// What photographs are expected to show, and how well they must be known.
///   lit pixels    the previewed light, at most the flood-lit radiance (T ≥ 0: no pattern gives a pixel more)
///   dark pixels   known light, and a quarter to four times the previewed light of unknown transport;
///                 without a preview, anything from sigma to the flood-lit radiance
/// Both are cut into parts by radiance, and each part must be known to
///   noise = sigma² + (relative · RMS of the part's light)²
class ExposureForecast final : public Forecaster {
 public:
  /// flood: the flood-lit photograph. sigma: what a pixel is known to well enough, whatever it shows.
  ExposureForecast(const BlockTree& tree, const ExposureGoal& goal, const Radiance& flood, double sigma);

  /// From now on, pixels are known well enough with more noise.
  void coarsen(Coarseness coarseness) { coarseness_ = coarseness; }

  std::vector<Expectation> expect(std::span<const LitBlocks> patterns, std::span<const Preview> previews,
                                  SecondsEach most) const override;

 private:
  Expectation expect_one(const LitBlocks& pattern, const Preview* preview) const;
  void add_parts(const LightHistogram& histogram, double relative, double octaves,
                 Expectation& expected) const;

  const BlockTree& tree_;
  ExposureGoal goal_;
  TreePhotograph flood_;
  double sigma_;  // without coarseness
  Coarseness coarseness_ = {};
  LightHistogram anything_;  // what dark pixels may show where nothing is foreseen
};

/// What a search has spent when it begins.
struct SpentBefore {
  std::int64_t photographs = 0;
  double rig_seconds = 0;
  double seconds_each = 0;  ///< of a check photograph
};

/// What a whole capture will take, by the light between pixels that the check photographs show. checks: none
/// of their light is known yet. Scenes with more such light have more leaves:
///   photographs = 3.7 N^(1/4) (I / τ)^(1/3)
/// N: pixels; I: RMS over the pixels of the light from all other pixels, as a share of F; τ: tolerance.
/// Found on 28 scenes (`random` 1 to 20 and eight named ones), 32x32 to 128x128, τ from 1.5e-4 to 3e-3
/// (docs/research/error-per-second.md has how often it is right). The search's photographs take as long as
/// the checks: they too have some pixels lit.
CaptureForecast forecast_capture(const SearchFacts& facts, Checks& checks, const KnownTransport& nothing,
                                 const SpentBefore& spent);

}  // namespace symrig::acquisition
