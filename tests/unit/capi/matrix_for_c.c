// SPDX-License-Identifier: Apache-2.0
#include "matrix_for_c.h"

#include <math.h>

static float matrix[kMatrixPixels][kMatrixPixels];

static double entry(int i, int j) {
  const double row = i / kMatrixSide - j / kMatrixSide, column = i % kMatrixSide - j % kMatrixSide;
  const double near = 0.02 / (1.0 + row * row + column * column);
  const double smooth = cos(0.1 * (i % kMatrixSide)) * cos(0.1 * (j % kMatrixSide));
  return near + 2e-4 * (2.0 + smooth) + (i == j ? 0.5 + 0.3 * sin(0.7 * i) : 0.0);
}

void matrix_photograph(const float* pattern, float* mean) {
  if (matrix[0][0] == 0.0F)
    for (int i = 0; i < kMatrixPixels; ++i)
      for (int j = 0; j < kMatrixPixels; ++j) matrix[i][j] = (float)entry(i, j);
  for (int i = 0; i < kMatrixPixels; ++i) {
    double sum = 0;
    for (int j = 0; j < kMatrixPixels; ++j) sum += (double)matrix[i][j] * (double)pattern[j];
    mean[i] = (float)sum;
  }
}
