// SPDX-License-Identifier: Apache-2.0
/* Captures a matrix of its own through a callback, relights it, and compares with the matrix.
 * usage: capture_matrix SCENE.h5 */
#include <symrig/symrig.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { kRows = 16, kColumns = 16, kPixels = kRows * kColumns };

static float matrix[kPixels][kPixels]; /* row: pixel of the camera, column: pixel of the projector */

/* Direct light, and light that spreads over the whole picture. */
static void fill_matrix(void) {
  for (int i = 0; i < kPixels; ++i)
    for (int j = 0; j < kPixels; ++j) {
      const float rows = (float)(i / kColumns - j / kColumns), columns = (float)(i % kColumns - j % kColumns);
      matrix[i][j] = (i == j ? 0.6F : 0.0F) + 0.002F * expf(-(rows * rows + columns * columns) / 80.0F);
    }
}

static void photograph(const float* pattern, float* mean) {
  for (int i = 0; i < kPixels; ++i) {
    mean[i] = 0;
    for (int j = 0; j < kPixels; ++j) mean[i] += matrix[i][j] * pattern[j];
  }
}

/* Your devices stand here: show each pattern, and fill mean and variance of its photograph. */
static int measure(symrig_batch* batch, void* user) {
  (void)user;
  for (size_t k = 0; k < batch->count; ++k)
    photograph(batch->patterns + k * kPixels, batch->mean + k * kPixels); /* variance stays 0: no noise */
  return 0;
}

static int on_progress(const symrig_capture_progress* at, void* user) {
  (void)user;
  fprintf(stderr, "\r%s: %lld photographs", at->stage, (long long)at->done);
  return 0; /* go on */
}

static int explain(const char* doing, const symrig_error* error) {
  fprintf(stderr, "\n%s: %s: %s; %s\n", doing, symrig_error_name(error->code), error->what, error->hint);
  return 1;
}

/* The RMS error of the picture under the light of the upper half, as a share of its RMS. */
static int compare(const symrig_tensor* tensor) {
  float pattern[kPixels] = {0}, seen[kPixels], relit[kPixels];
  double wrong = 0, all = 0;
  symrig_error error;
  for (int k = 0; k < kPixels / 2; ++k) pattern[k] = 1.0F;
  if (symrig_tensor_relight(tensor, pattern, kPixels, relit, kPixels, &error) != 0)
    return explain("relight", &error);
  photograph(pattern, seen);
  for (int k = 0; k < kPixels; ++k) {
    wrong += pow((double)relit[k] - (double)seen[k], 2);
    all += pow((double)seen[k], 2);
  }
  printf("\nrelit with an error of %.2g %%\n", 100 * sqrt(wrong / all));
  return 0;
}

int main(int count, char** words) {
  if (count != 2 || symrig_api_version() < SYMRIG_API_VERSION) return 2;
  symrig_error error;
  symrig_rig* rig = NULL;
  symrig_tensor* tensor = NULL;
  symrig_own_rig own;
  memset(&own, 0, sizeof own);
  own.size = sizeof own;
  own.measure = measure;
  own.name = "my matrix";
  own.rows = kRows;
  own.columns = kColumns;
  fill_matrix();
  if (symrig_rig_of_callback(&own, &rig, &error) != 0) return explain("rig", &error);
  int failed = 0;
  if (symrig_capture(rig, words[1], "resume=on", on_progress, NULL, &tensor, &error) != 0)
    failed = explain("capture", &error);
  if (!failed) failed = compare(tensor);
  symrig_tensor_free(tensor);
  symrig_rig_close(rig);
  return failed;
}
