// SPDX-License-Identifier: Apache-2.0
#ifndef MATRIX_FOR_C_H
#define MATRIX_FOR_C_H

#include "symrig/symrig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { kMatrixSide = 32, kMatrixPixels = kMatrixSide * kMatrixSide };

/* mean = T pattern for a symmetric T of 32 x 32 pixels without a zero: direct light, light to near
 * neighbours, and smooth light across the picture. Each sum has one order, so its bits never differ. */
void matrix_photograph(const float* pattern, float* mean);

/* Captures the same T through a C++ Probe, and writes the scene to `path`. 0: done. */
int capture_by_probe(const char* path);

/* Callbacks in C++ that throw an exception. */
int throwing_measure(symrig_batch* batch, void* user);
int throwing_progress(const symrig_capture_progress* at, void* user);

/* Whether two scene files hold the same tensor, bit for bit: 1 or 0. Below 0: one cannot be read, or it is
 * too simple to compare. */
int same_tensor(const char* one, const char* other);

#ifdef __cplusplus
}
#endif

#endif
