// SPDX-License-Identifier: Apache-2.0
#include "rig/lamp.hpp"

#include <algorithm>
#include <cmath>

namespace symrig {
namespace {

constexpr std::size_t kWindow = 8;    // references that the line is fitted to
constexpr std::int64_t kLongest = 8;  // times `every`, between references of a stable lamp
constexpr double kSignificant = 3;    // sigmas
constexpr double kLit = 5;            // sigmas of the sum of a photograph
constexpr double kJump = 5;           // sigmas
constexpr double kTrusted = 0.1;      // the largest change that is predicted
/// Rounding error of a sum of floats. Keeps the weights finite if there is no noise.
constexpr double kRounding = 1e-14;

}  // namespace

std::int64_t LampLog::until_due(std::int64_t shown) const {
  if (!first_) return 0;
  return std::max<std::int64_t>(0, last_ + 1 + interval_ - shown);
}

LampLog::Reading LampLog::compare(std::int64_t shown, const Radiance& flood) const {
  double first = 0, now = 0, variance = 0;
  for (std::size_t i = 0; i < flood.mean.values().size(); ++i) {
    if (flood.valid.values()[i] == 0 || first_->valid.values()[i] == 0) continue;
    first += first_->mean.values()[i];
    now += flood.mean.values()[i];
    variance += flood.variance.values()[i];
  }
  const bool lit = now > kLit * std::sqrt(variance);
  const bool was_lit = first > kLit * std::sqrt(variance);
  if (!lit || !was_lit) return {static_cast<double>(shown), was_lit ? 0.0 : 1.0, 1};
  return {static_cast<double>(shown), now / first, variance / (first * first) + kRounding};
}

/// true: the difference is too large for the expected drift and the errors of line and reading.
bool LampLog::jumped(const Reading& reading) const {
  if (readings_.empty()) return false;
  const LampLevel foretold = level_at(static_cast<std::int64_t>(reading.shown));
  const double drift = drift_ / 1000 * (reading.shown - readings_.back().shown);
  const double variance = reading.variance + foretold.sigma * foretold.sigma + drift * drift;
  return std::abs(reading.level - foretold.value) > kJump * std::sqrt(variance);
}

bool LampLog::observe(std::int64_t shown, const Radiance& flood) {
  last_ = shown;
  if (!first_) first_ = flood;
  const Reading reading = compare(shown, flood);
  if (jumped(reading)) {
    readings_.clear();
    interval_ = every_;
  }
  readings_.push_back(reading);
  if (readings_.size() > kWindow) readings_.pop_front();
  fit();
  space_out();
  return readings_.back().level > 0;
}

/// min over a, b of Σ (y − a − b x)² / Var[y] + (b / τ)², x relative to the last reading.
void LampLog::fit() {
  const double tau = drift_ / 1000;
  double w = 0, wx = 0, wxx = tau > 0 ? 1 / (tau * tau) : 0, wy = 0, wxy = 0;
  for (const Reading& reading : readings_) {
    const double weight = 1 / reading.variance, x = reading.shown - readings_.back().shown;
    w += weight;
    wx += weight * x;
    wxx += weight * x * x;
    wy += weight * reading.level;
    wxy += weight * x * reading.level;
  }
  const double determinant = w * wxx - wx * wx;
  if (!(determinant > 0)) return;
  line_ = {(wxx * wy - wx * wxy) / determinant, (w * wxy - wx * wy) / determinant, wxx / determinant,
           -wx / determinant, w / determinant};
}

/// If the oldest and the newest reference agree, references become rarer.
void LampLog::space_out() {
  if (readings_.size() < 2) return;
  const Reading &before = readings_.front(), &now = readings_.back();
  const double sigma = std::sqrt(before.variance + now.variance);
  const bool drifts = std::abs(now.level - before.level) > kSignificant * sigma;
  interval_ = drifts ? every_ : std::min<std::int64_t>(2 * interval_, kLongest * every_);
}

LampLevel LampLog::level_at(std::int64_t shown) const {
  if (readings_.empty()) return {};
  const double x = static_cast<double>(shown) - readings_.back().shown;
  const double change = std::clamp(line_.slope * x, -kTrusted * line_.level, kTrusted * line_.level);
  return {line_.level + change, std::sqrt(line_.var_level + 2 * line_.cov * x + line_.var_slope * x * x)};
}

}  // namespace symrig
