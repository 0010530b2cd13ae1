// SPDX-License-Identifier: Apache-2.0
// Compiled for every instruction set that Highway knows and chosen at run time.
#include "acquisition/refine/polish_jacobian.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "acquisition/refine/polish_kernels.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace symrig::acquisition::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::CappedTag<float, tensor::kBatch>;

// Lanes are added up once a pixel, not once a batch: that costs more than the products of a batch.
void collapse(const PhotographTerm* terms, std::size_t count, float* to, std::size_t n) {
  const Lanes d;
  for (std::size_t i = 0; i < n; ++i) {
    auto sum = hn::Zero(d);
    for (std::size_t t = 0; t < count; ++t)
      for (std::size_t part = 0; part < tensor::kBatch; part += hn::Lanes(d))
        sum = hn::MulAdd(hn::LoadU(d, terms[t].samples + i * tensor::kBatch + part),
                         hn::LoadU(d, terms[t].weight.data() + part), sum);
    to[i] += hn::GetLane(hn::SumOfLanes(d, sum));
  }
}

}  // namespace symrig::acquisition::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace symrig::acquisition {

HWY_EXPORT(collapse);

void collapse(std::span<const PhotographTerm> terms, float* to, std::size_t n) {
  HWY_DYNAMIC_DISPATCH(collapse)(terms.data(), terms.size(), to, n);
}

}  // namespace symrig::acquisition
#endif  // HWY_ONCE
