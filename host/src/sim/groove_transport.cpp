// SPDX-License-Identifier: Apache-2.0
#include "sim/groove_transport.hpp"

#include <utility>

namespace symrig::sim {

GrooveTransport::GrooveTransport(std::shared_ptr<const Exchange> exchange, std::vector<float> albedo,
                                 double indirect)
    : exchange_(std::move(exchange)), albedo_(std::move(albedo)), indirect_(static_cast<float>(indirect)) {}

void GrooveTransport::apply(std::span<const float> x, std::span<float> y) const {
  const std::size_t n = albedo_.size();
  std::vector<float> leaving(n);  // (R F)^k R x
  std::vector<float> arriving(n);
  for (std::size_t i = 0; i < n; ++i) leaving[i] = static_cast<float>(kForeshortening) * albedo_[i] * x[i];
  std::copy(leaving.begin(), leaving.end(), y.begin());
  for (int bounce = 0; bounce < kBounces && indirect_ > 0; ++bounce) {
    exchange_->apply(leaving, arriving);
    for (std::size_t i = 0; i < n; ++i) {
      leaving[i] = albedo_[i] * arriving[i];
      y[i] += indirect_ * leaving[i];
    }
  }
}

}  // namespace symrig::sim
