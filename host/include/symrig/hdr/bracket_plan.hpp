// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/hdr/noise_model.hpp"

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace symrig {

/// The number of pixels (in all channels) with about the same radiance.
struct ExpectedLight {
  double radiance = 0;
  double pixels = 0;
};

/// A part of the pixels of a photograph, such as the lit ones, and its wanted noise.
struct ExpectedPart {
  std::vector<ExpectedLight> lights;
  /// The wanted mean square noise of these pixels [radiance²]. Errors of a transport are norms, so the sum of
  /// squares counts, not the worst pixel.
  double noise = 0;
};

/// The expected light of a photograph and its wanted noise. A rig uses it to choose the exposures. Radiance
/// per unit of projector light.
struct Expectation {
  /// None: the first look at the flood-lit scene. Nothing but the rig's own metering foresees it.
  std::vector<ExpectedPart> parts;
  /// The longest allowed sum of the exposures of this photograph [s]. It has priority over the wanted noise.
  double longest_seconds = 10;
  /// The longest that the photograph may take, with readouts and waits of its frames [s]: what a budget of
  /// seconds leaves for it. It has priority over longest_seconds. One frame is taken in any case.
  double most_seconds = std::numeric_limits<double>::infinity();
  /// The same of all photographs of the dark projector that it may have to wait for.
  double black_seconds = std::numeric_limits<double>::infinity();
  /// Steps by which a budget of seconds has raised the wanted noise.
  std::int32_t coarser_steps = 0;

  /// What a log keeps of the budget: a capture with another one wants another photograph of the same pattern.
  /// coarser_steps; from kHeldShort on, also that most_seconds ended the exposures, and how long it was.
  std::int32_t budget_note(bool held_short) const;
  static constexpr std::int32_t kHeldShort = 32, kLastNote = 255;
};

/// Budgets that are nearly the same want the same photographs, so most_seconds are whole steps of an eighth
/// of an octave, from 1 ms to 67 hours. The longest such time of at most `seconds`, or 1 ms.
double whole_most_seconds(double seconds);

/// A histogram of radiances, four bins an octave from 2⁻⁶⁰ to 2²⁰; darker values count as 0.
class LightHistogram {
 public:
  LightHistogram() : counts_(kBins) {}

  void add(float radiance) { counts_[bin_of(radiance)] += 1; }
  void add(float radiance, double pixels) { counts_[bin_of(radiance)] += pixels; }
  void add(const LightHistogram& other);
  double pixels() const;
  double mean_square() const;
  /// The bins with pixels. A bin's radiance is its upper end.
  std::vector<ExpectedLight> lights() const;

 private:
  static constexpr std::size_t kBins = 4 * 80 + 1;
  static std::size_t bin_of(float radiance);
  static double upper_end(std::size_t bin);

  std::vector<double> counts_;
};

/// The limits of the devices and the cost of a frame.
struct ExposureRules {
  Nanoseconds min_exposure{20'000};
  Nanoseconds max_exposure{30'000'000'000};
  /// Exposures must be whole multiples of it (multi-bit patterns made by pulses); 0: any exposure is allowed.
  Nanoseconds whole_periods{0};
  /// The cost of a frame besides its exposure: readout, transfer, memory, merging.
  Nanoseconds each_frame{500'000'000};
  /// What a frame takes besides that and its exposure: it waits for the projector. Only
  /// Expectation::most_seconds counts it.
  Nanoseconds each_wait{0};
  int most_frames = 64;
  /// The plan uses a frame only for pixels up to saturation / headroom.
  double headroom = 1.25;
};

/// How radiance becomes electrons in the sensor.
struct LightPath {
  double scale = 1;  ///< radiance of one electron per second
  double black = 0;  ///< radiance of the dark projector; it fills the well like other light
};

struct BracketPlan {
  std::vector<Nanoseconds> exposures;  ///< shortest first
  /// Mean square noise of the worst part / the wanted noise: at most 1 if the plan meets it.
  double noise = 0;
  /// Expectation::most_seconds kept it from the wanted noise.
  bool held_short = false;
};

/// Information [s²/e⁻²] of one exposure of t seconds about a rate: t² / Var, 0 if it saturates.
double exposure_information(const NoiseModel& noise, double rate, double seconds, double headroom);

/// Finds the bracket of least cost Σ (t_k + each_frame) whose merge has, in every part of the photograph,
///   Σ_lights pixels / Σ_k information_k  ≤  noise · Σ_lights pixels
/// A pixel that saturates in every frame counts with the square of its radiance. Brackets of up to three
/// exposures are searched exhaustively, with exposures √2 apart. More exposures, and repeats, are added one
/// by one: always the one that reduces the noise most for its cost. If longest_seconds ends this first,
/// BracketPlan::noise is above 1. Departs from [Hasinoff10], which maximises the worst SNR in a given time:
/// here the noise is given, and the time is minimised. fails: bad_argument (nothing expected, rules that no
/// exposure meets, a noise model that is not valid).
Result<BracketPlan> plan_bracket(const Expectation& expected, const LightPath& path, const NoiseModel& noise,
                                 const ExposureRules& rules);

/// How much the light of an exposure varies under a pulsed light (colour wheel, PWM). If the exposure is not
/// a whole number of periods, the collected light depends on when the shutter opens.
struct BeatForecast {
  double periods = 0;  ///< exposure / period
  /// (largest − smallest) / mean of the collected light, for a light that is on for `duty` of its period.
  double spread = 0;
  Nanoseconds nearest_whole{0};  ///< at least one period
  /// True if the spread is larger than `share`.
  bool beats(double share = 0.01) const { return spread > share; }
  /// "exposure 1.60 ms is 0.096 periods of 16.67 ms: its light may vary by 200 %; 16.67 ms is whole"
  std::string to_string(Nanoseconds exposure, Nanoseconds period) const;
};

/// The light collected in n + f periods (0 ≤ f < 1) of a light that is on for a share d of each lies between
/// n d + max(0, f + d − 1) and n d + min(f, d). An exposure within 0.1 % of a period of a whole number of
/// them counts as whole.  fails: bad_argument (exposure or period not above 0, duty not in (0, 1]).
Result<BeatForecast> forecast_beat(Nanoseconds exposure, Nanoseconds period, double duty = 0.5);

}  // namespace symrig
