// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/dark_excess.hpp"

namespace symrig::acquisition {

DarkExcess::DarkExcess(std::span<const Checks::Residual> residuals, std::span<const double> flood_squared) {
  const std::size_t pixels = residuals[0].photograph.pattern.size();
  before_.resize(pixels + 1);
  lit_before_.assign(residuals.size(), std::vector<double>(pixels + 1));
  for (std::size_t t = 0; t < pixels; ++t) {
    Comparison sum = before_[t];
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const TreePhotograph& p = residuals[k].photograph;
      lit_before_[k][t + 1] = lit_before_[k][t] + static_cast<double>(p.pattern[t]);
      if (p.pattern[t] != 0) continue;
      for (std::size_t channel = 0; channel < flood_squared.size(); ++channel) {
        const std::size_t at = channel * pixels + t;
        if (p.valid[at] == 0 || flood_squared[channel] <= 0) continue;
        const double e = residuals[k].residual[at];
        const double y = p.mean[at];
        sum += {e * e / flood_squared[channel], y * y / flood_squared[channel],
                static_cast<double>(p.variance[at]) / flood_squared[channel], 1};
      }
    }
    before_[t + 1] = sum;
  }
}

Comparison DarkExcess::of(std::int32_t begin, std::int32_t end) const {
  const Comparison& a = before_[begin];
  const Comparison& b = before_[end];
  return {b.misfit - a.misfit, b.signal - a.signal, b.noise - a.noise, b.samples - a.samples};
}

double DarkExcess::lit(std::size_t check, std::int32_t begin, std::int32_t end) const {
  return lit_before_[check][end] - lit_before_[check][begin];
}

}  // namespace symrig::acquisition
