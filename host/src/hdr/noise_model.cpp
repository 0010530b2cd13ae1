// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/noise_model.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr double kSaturationSigmas = 5;

/// The largest code of an analog-digital converter. Outside of 1 to 16 bits the model becomes invalid.
double largest_code(int bits) {
  return std::ldexp(1.0, bits) - 1;
}

}  // namespace

NoiseModel::NoiseModel(double full_well, double read_noise, double gain, double pedestal, int bits)
    : full_well_(full_well),
      read_noise_(read_noise),
      gain_(gain),
      pedestal_(pedestal),
      bits_(std::clamp(bits, 0, 17)) {
  const double margin = kSaturationSigmas * gain_ * read_noise_;
  const double code = std::floor(largest_code(bits_) - margin);
  saturation_code_ = std::isfinite(code) ? static_cast<int>(std::clamp(code, 0.0, 65535.0)) : 0;
}

NoiseModel NoiseModel::from_electrons(const Electrons& sensor) {
  const double gain = (largest_code(sensor.bits) - sensor.pedestal) / sensor.full_well;
  return {sensor.full_well, sensor.read_noise, gain, sensor.pedestal, sensor.bits};
}

NoiseModel NoiseModel::from_variance_line(const VarianceLine& line) {
  const double full_well = (largest_code(line.bits) - line.pedestal) / line.slope;
  // offset = gain² read² + 1/12
  const double read_noise = std::sqrt(std::max(0.0, line.offset - 1.0 / 12)) / line.slope;
  return {full_well, read_noise, line.slope, line.pedestal, line.bits};
}

NoiseModel NoiseModel::clipped_at(int code) const {
  NoiseModel clipped = *this;
  clipped.full_well_ = (code - pedestal_) / gain_;
  const double below = std::floor(code - kSaturationSigmas * gain_ * read_noise_);
  clipped.saturation_code_ = std::min(saturation_code_, static_cast<int>(std::clamp(below, 0.0, 65535.0)));
  return clipped;
}

int NoiseModel::clipping_code() const {
  return static_cast<int>(std::lround(std::min(pedestal_ + gain_ * full_well_, largest_code(bits_))));
}

double NoiseModel::floor_variance() const {
  return read_noise_ * read_noise_ + 1 / (12 * gain_ * gain_);
}

double NoiseModel::variance(double electrons) const {
  return std::max(electrons, 0.0) + floor_variance();
}

bool NoiseModel::valid() const {
  const bool finite = std::isfinite(full_well_) && std::isfinite(read_noise_) && std::isfinite(gain_) &&
                      std::isfinite(pedestal_);
  return finite && bits_ >= 1 && bits_ <= 16 && full_well_ > 0 && gain_ > 0 && read_noise_ >= 0 &&
         pedestal_ >= 0 && saturation_code_ > pedestal_;
}

std::string NoiseModel::to_string() const {
  return fmt::format(
      "{} bits, full well {:.6g} e-, read noise {:.6g} e-, gain {:.6g} DN/e-, pedestal {:.6g} DN, saturated "
      "from {} DN",
      bits_, full_well_, read_noise_, gain_, pedestal_, saturation_code_);
}

}  // namespace symrig
