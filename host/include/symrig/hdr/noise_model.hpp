// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace symrig {

/// The relation between light and one raw sample of a linear sensor, with its noise.
///
///   code = pedestal + gain · (electrons + read) , rounded, clipped to [0, 2^bits − 1]
///   Var[electrons + read] = electrons + read_noise² + 1/(12 gain²)      shot ⊕ read ⊕ quantisation
///
/// electrons: collected photoelectrons [e⁻], clipped at full_well; gain [DN/e⁻]; pedestal [DN]; read_noise
/// [e⁻ rms].
class NoiseModel {
 public:
  /// A sensor described in electrons. The gain makes the full well the largest code.
  struct Electrons {
    double full_well = 20'000;  ///< [e⁻]
    double read_noise = 6;      ///< [e⁻ rms]
    int bits = 12;
    double pedestal = 64;  ///< [DN]; several read_noise · gain, so that no dark sample is clipped at code 0
  };
  static NoiseModel from_electrons(const Electrons& sensor);

  /// The straight line fitted to a photon transfer curve: Var[code] = offset + slope · (code − pedestal)
  /// [DN²]. The slope is the gain, the offset contains read noise and quantisation, and the full well is the
  /// largest code.
  struct VarianceLine {
    double offset = 1;  ///< [DN²]
    double slope = 1;   ///< [DN]
    int bits = 12;
    double pedestal = 64;  ///< [DN]
  };
  static NoiseModel from_variance_line(const VarianceLine& line);

  /// The numbers of another model, which came over a wire. Check valid() first.
  static NoiseModel from_numbers(double full_well, double read_noise, double gain, double pedestal,
                                 int bits) {
    return {full_well, read_noise, gain, pedestal, bits};
  }

  /// The same sensor, but light clips at a lower code than the largest one (white level). Changes full well
  /// and saturation.
  NoiseModel clipped_at(int code) const;

  double full_well() const { return full_well_; }    ///< [e⁻]
  double read_noise() const { return read_noise_; }  ///< [e⁻ rms]
  double gain() const { return gain_; }              ///< [DN/e⁻]
  double pedestal() const { return pedestal_; }      ///< [DN]
  int bits() const { return bits_; }
  int max_code() const { return (1 << bits_) - 1; }
  /// The code at which light clips: pedestal + gain · full well.
  int clipping_code() const;

  /// Codes at or above this one are saturated. It is five read-noise sigmas below the clipping point, so that
  /// a full pixel with negative read noise does not count as a measurement.
  int saturation_code() const { return saturation_code_; }

  /// Variance of one sample without its shot noise [e⁻²]: read_noise² + 1/(12 gain²).
  double floor_variance() const;
  /// Variance of one sample [e⁻²] at this many electrons (below zero counts as zero).
  double variance(double electrons) const;

  /// True if the model is usable: 1..16 bits, positive gain and full well, saturation above the pedestal.
  bool valid() const;
  /// "12 bits, full well 20000 e-, read noise 6 e-, gain 0.20155 DN/e-, pedestal 64 DN, saturated from 4088
  /// DN"
  std::string to_string() const;

  bool operator==(const NoiseModel&) const = default;

 private:
  NoiseModel(double full_well, double read_noise, double gain, double pedestal, int bits);

  double full_well_, read_noise_, gain_, pedestal_;
  int bits_;
  int saturation_code_;
};

}  // namespace symrig
