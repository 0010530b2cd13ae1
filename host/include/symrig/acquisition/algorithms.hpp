// SPDX-License-Identifier: Apache-2.0
// The algorithms that acquire T, in one table, and the numbers that they run with.
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace symrig {

class Probe;
struct CaptureSettings;
struct CaptureResult;

/// How T is acquired.
enum class Algorithm : std::uint8_t {
  symrig,  ///< the paper's with noise-aware tests and the concentration guard (default)
  paper,   ///< [Garg06 §5.2] as published
  dual,    ///< [Sen05] as the paper's §6.1 describes it
  brute,   ///< one pattern a pixel
};

/// When a node is a leaf. F = RMS of the flood-lit photograph; n = samples compared.
struct RankRule {
  double signal_fraction = 0.02;  ///< τ_R: squared misfit allowed as a share (squared) of the squared signal
  double flood_fraction = 3e-4;   ///< τ_A: RMS misfit allowed as a share of F (absolute tolerance)
  double empty_fraction = 3e-4;   ///< τ_E: a node whose RMS is below this share of F is *empty*
  double noise_sigmas = 0;  ///< k: misfit allowed on top, expected noise V (1 + k √(2/n)); 0 = no noise term
  double concentration =
      1;  ///< g: no leaf if one child pair carries more than this share of the energy; 1 = off
};

/// How the search saves photographs, and how it checks itself. Nodes that are expected to pass the rank test
/// are accepted without a test. Idle colours test as many of them as fit: these tests show how good the
/// expectation is.
struct Economy {
  /// ρ: how much of a parent's misfit in a child pair is expected in the child itself. The search starts with
  /// this value and learns the scene's own. 0: every unknown node is tested [Garg06 §5.2].
  double decay = 0;
  /// κ, κ_max: the largest misfit that a parent at level l may have in a child that is accepted untested:
  /// min(κ 2^l, κ_max) τ_A F. So no untested leaf misses by more, unless refinement makes the misfit grow.
  double risk = 2.5;
  double largest_risk = 12;
  /// A child pair that carries more than this share of its parent's energy on both sides is always tested.
  double dominance = 0.45;
  /// Expected misfit over signal for the children of a diagonal node, whose signal is all there is to go by.
  double diagonal_spread = 3;
  /// A block is not lit while it is looked at, even where its transport to itself is known. The shot noise
  /// and the remaining error of its direct light would hide what comes from elsewhere.
  bool look_in_the_dark = false;
  /// Leaf images that are mostly noise are shrunk towards what can be seen of them
  /// (acquisition/search/placement.hpp).
  bool shrink_noise = false;
  /// Holds out six photographs whose patterns are independent of blocks. They estimate the errors. They end
  /// the search of a scene that is all direct light. They find leaves that are wrong although their own
  /// photographs fit.
  bool checks = false;
  /// Further held-out photographs, taken in the end while the estimated errors are unsure, as a share of
  /// those taken by then.
  double check_share = 0;
  /// Photographs spent on the noise of the direct light in the end, as a share of those taken by then.
  double direct_share = 0;
  /// Gauss-Newton steps that refit everything stored to all photographs in the end.
  int polish = 0;
  /// Polish takes fewer steps where the host is expected to need more than this share of the rig's seconds
  /// for them: more light would then give the same error sooner. 0, or a rig without a clock: no limit.
  double polish_share = 0;
  /// The largest rank of a leaf. Leaves are found one by one and have rank 1. In the end neighbours are
  /// merged into leaves of higher rank, where that saves memory and adds at most 2 % to what a leaf may miss.
  int rank = 1;
};

/// One algorithm. A new one is a function `run`, declared in host/src/acquisition/algorithms.hpp, and one
/// entry of the table in algorithms.cpp.
struct AlgorithmInfo {
  Algorithm algorithm = Algorithm::symrig;
  std::string_view name = {};
  std::string_view description = {};     ///< a few words, for the help of commands
  RankRule rule = {};                    ///< default
  Economy economy = {};                  ///< default
  std::optional<double> tolerance = {};  ///< default; none: it measures each pixel
  /// It searches a hierarchy of blocks. Budgets, polish and planned exposures have no effect on others.
  bool hierarchical = false;
  /// It never takes more photographs than brute force, which can take over at any moment.
  bool yields_to_brute_force = false;
  bool splits_views = false;    ///< CaptureOptions::split has an effect
  bool reference = false;       ///< benchmarks compare the other algorithms with it
  double finest_factor = 0.25;  ///< benchmarks use no tolerance below this many times the default
  /// Runs it. Others call capture(), which checks the settings first.
  Result<CaptureResult> (*run)(Probe& probe, const CaptureSettings& settings) = nullptr;
};

/// All algorithms, the default first.
std::span<const AlgorithmInfo> algorithms();
const AlgorithmInfo& algorithm_info(Algorithm algorithm);

std::string_view name(Algorithm algorithm);
/// fails: unknown_name (with all that are known, and the nearest).
Result<Algorithm> parse_algorithm(std::string_view text);
/// All algorithms, the default first.
std::span<const std::string_view> algorithm_names();

/// The rule and the economy that an algorithm runs with by default.
RankRule default_rule(Algorithm algorithm);
Economy default_economy(Algorithm algorithm);
/// The tolerance that an algorithm runs with by default; none for brute force.
std::optional<double> default_tolerance(Algorithm algorithm);

}  // namespace symrig
