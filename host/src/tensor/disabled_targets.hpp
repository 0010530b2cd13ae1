// SPDX-License-Identifier: Apache-2.0
// Before Highway's headers: sums live in arrays of vectors, which targets without a fixed vector length
// cannot have. Their machines have others (NEON) as well.
#pragma once

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
