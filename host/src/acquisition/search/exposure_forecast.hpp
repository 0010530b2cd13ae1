// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/coarseness.hpp"
#include "acquisition/search/photographer.hpp"
#include "symrig/hdr/expectation.hpp"

#include <span>
#include <vector>

namespace symrig::acquisition {

/// Foresees nothing: for the first photograph of a capture, the flood-lit one.
class FirstLook final : public Forecaster {
 public:
  std::vector<Expectation> expect(std::span<const LitBlocks> patterns,
                                  std::span<const Preview> /*previews*/) const override {
    return std::vector<Expectation>(patterns.size());
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

  std::vector<Expectation> expect(std::span<const LitBlocks> patterns,
                                  std::span<const Preview> previews) const override;

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

}  // namespace symrig::acquisition
