// SPDX-License-Identifier: Apache-2.0
// Include before Highway's headers. The sums are arrays of vectors, which targets without a fixed vector
// length do not allow. Machines with such targets also have others (NEON). On x86-64 the kernels exist for
// SSE2, AVX2 and AVX-512: processors between the first two use SSE2, and the longest kernels compile in less
// time.
#pragma once

#define HWY_DISABLED_TARGETS \
  (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SSSE3 | HWY_SSE4)
