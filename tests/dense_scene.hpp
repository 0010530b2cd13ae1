// SPDX-License-Identifier: Apache-2.0
// Small scenes whose T is a plain matrix: the slow oracle that tests compare with.
#pragma once

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/base/statistics.hpp"

#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace symrig::tests {

/// T as an n × n matrix (raster order), one channel.
class DenseTransport {
 public:
  DenseTransport(Grid grid, const std::function<double(int i, int j)>& entry)
      : grid_(grid), n_(static_cast<std::size_t>(grid.size())), t_(n_ * n_) {
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t j = 0; j < n_; ++j) t_[i * n_ + j] = entry(static_cast<int>(i), static_cast<int>(j));
  }

  Grid grid() const { return grid_; }
  double at(int i, int j) const { return t_[static_cast<std::size_t>(i) * n_ + static_cast<std::size_t>(j)]; }
  Image<float> apply(const Image<float>& p) const {
    Image<float> y(grid_);
    for (std::size_t i = 0; i < n_; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < n_; ++j) sum += t_[i * n_ + j] * static_cast<double>(p.values()[j]);
      y.values()[i] = static_cast<float>(sum);
    }
    return y;
  }
  /// Σ_j |T_ij| |p_j|: the scale of rounding in (T p)_i.
  Image<float> magnitude(const Image<float>& p) const {
    Image<float> y(grid_);
    for (std::size_t i = 0; i < n_; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < n_; ++j)
        sum += std::abs(t_[i * n_ + j] * static_cast<double>(p.values()[j]));
      y.values()[i] = static_cast<float>(sum);
    }
    return y;
  }
  TrueTransport truth() const {
    return [this](const Image<float>& p) -> Result<Image<float>> { return apply(p); };
  }

 private:
  Grid grid_;
  std::size_t n_;
  std::vector<double> t_;
};

/// A probe that answers exactly, or with Gaussian noise of a stated variance, and lets a test look at every
/// pattern.
class DenseProbe : public Probe {
 public:
  explicit DenseProbe(const DenseTransport& transport, double sigma = 0)
      : transport_(transport), sigma_(sigma) {}

  Grid grid() const override { return transport_.grid(); }
  int channels() const override { return 1; }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    std::vector<Radiance> answers;
    for (const Pattern& pattern : patterns) {
      if (watch) watch(pattern);
      Radiance answer{transport_.apply(pattern), Image<float>(grid(), 1, static_cast<float>(sigma_ * sigma_)),
                      Image<std::uint8_t>(grid(), 1, std::uint8_t{1})};
      if (sigma_ > 0)
        for (float& v : answer.mean.values()) v += static_cast<float>(sigma_ * gaussian());
      if (spoil) spoil(answer);
      answers.push_back(std::move(answer));
      ++photographs_;
    }
    return answers;
  }
  ProbeCost cost() const override { return {photographs_, photographs_, 0, 0, 0}; }
  std::string describe() const override { return "dense " + to_string(grid()); }

  std::function<void(const Pattern&)> watch;
  std::function<void(Radiance&)> spoil;

 private:
  double gaussian() {  // Box and Muller
    return std::sqrt(-2 * std::log(1 - random_.uniform())) * std::cos(6.283185307179586 * random_.uniform());
  }

  const DenseTransport& transport_;
  double sigma_;
  Random random_{1234};
  std::int64_t photographs_ = 0;
};

/// Two textured half-planes that see each other through a smooth kernel, plus direct light: data-sparse,
/// symmetric, positive.
inline DenseTransport facing_planes(Grid grid, double indirect = 0.2) {
  const auto albedo = [](int i) { return 0.3 + 0.7 * Random(static_cast<std::uint64_t>(i) + 17).uniform(); };
  const double crease = 0.47 * grid.cols;
  const double scale = indirect / static_cast<double>(grid.size());
  return {grid, [=](int i, int j) {
            const double direct = i == j ? albedo(i) : 0;
            const double xi = i % grid.cols + 0.5 - crease, xj = j % grid.cols + 0.5 - crease;
            if (xi * xj > 0) return direct;
            const int rows = i / grid.cols - j / grid.cols;
            const double dy = rows / static_cast<double>(grid.rows);
            const double dx = (std::abs(xi) + std::abs(xj)) / grid.cols;
            return direct + scale * albedo(i) * albedo(j) / (0.05 + dx * dx + dy * dy);
          }};
}

}  // namespace symrig::tests
