// SPDX-License-Identifier: Apache-2.0
/* Captures from C11, of a named rig and of callbacks. usage: test_capi_capture FOLDER */
#include "expect.h"
#include "matrix_for_c.h"
#include "symrig/symrig.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static char folder[512];

/* Each slot is one file of the folder. */
static const char* path_in(int slot, const char* name) {
  static char paths[4][1024];
  snprintf(paths[slot], sizeof paths[slot], "%s/%s", folder, name);
  return paths[slot];
}

/* What the callback of the matrix does besides. */
typedef struct matrix_rig {
  int taken;      /* photographs so far */
  int stop_after; /* 0: never */
  symrig_rig* stop_handle;
} matrix_rig;

static int measure_matrix(symrig_batch* batch, void* user) {
  matrix_rig* rig = user;
  for (size_t k = 0; k < batch->count; ++k) {
    if (rig->stop_after != 0 && rig->taken >= rig->stop_after) {
      if (rig->stop_handle == NULL) return SYMRIG_INTERRUPTED;
      symrig_rig_stop(rig->stop_handle);
    }
    matrix_photograph(batch->patterns + k * kMatrixPixels, batch->mean + k * kMatrixPixels);
    ++rig->taken;
  }
  return 0;
}

static symrig_own_rig own_matrix(matrix_rig* rig) {
  symrig_own_rig own;
  memset(&own, 0, sizeof own);
  own.size = sizeof own;
  own.measure = measure_matrix;
  own.user = rig;
  own.name = "matrix";
  own.rows = kMatrixSide;
  own.columns = kMatrixSide;
  return own;
}

static symrig_rig* rig_of(const symrig_own_rig* own) {
  symrig_rig* rig = NULL;
  symrig_error error;
  EXPECT(symrig_rig_of_callback(own, &rig, &error) == 0);
  return rig;
}

static int exists(const char* path) {
  FILE* file = fopen(path, "rb");
  if (file != NULL) fclose(file);
  return file != NULL;
}

static int count_up(const symrig_capture_progress* at, void* user) {
  int64_t* last = user;
  EXPECT(at->stage != NULL && at->stage[0] != '\0');
  EXPECT(at->done >= *last);
  *last = at->done;
  return 0;
}

static int stop_at_five(const symrig_capture_progress* at, void* user) {
  (void)user;
  return at->done >= 5;
}

/* The photographs that a whole capture takes. */
static int test_same_as_a_probe(void) {
  const char* by_probe = path_in(0, "by_probe.h5");
  const char* by_callback = path_in(1, "by_callback.h5");
  symrig_error error;
  symrig_tensor* tensor = NULL;
  int64_t last = 0;
  matrix_rig state = {0, 0, NULL};
  symrig_own_rig own = own_matrix(&state);
  symrig_rig* rig = rig_of(&own);
  EXPECT(capture_by_probe(by_probe) == 0);
  EXPECT(symrig_rig_shape(rig).pattern_rows == kMatrixSide && symrig_rig_shape(rig).channels == 1);
  EXPECT(symrig_capture(rig, NULL, NULL, count_up, &last, &tensor, &error) == 0);
  EXPECT(last > 20 && last == state.taken);
  EXPECT(symrig_tensor_save(tensor, by_callback, &error) == 0);
  EXPECT(same_tensor(by_probe, by_callback) == 1);
  symrig_tensor_free(tensor);
  symrig_rig_close(rig);
  /* Several patterns at once change nothing. */
  own.together = 7;
  rig = rig_of(&own);
  EXPECT(symrig_capture(rig, NULL, "", NULL, NULL, &tensor, NULL) == 0);
  EXPECT(symrig_tensor_save(tensor, by_callback, &error) == 0);
  EXPECT(same_tensor(by_probe, by_callback) == 1);
  symrig_tensor_free(tensor);
  /* Another tolerance does: the comparison can tell. */
  EXPECT(symrig_capture(rig, NULL, "tolerance=0.2", NULL, NULL, &tensor, &error) == 0);
  EXPECT(symrig_tensor_save(tensor, by_callback, &error) == 0);
  EXPECT(same_tensor(by_probe, by_callback) == 0);
  symrig_tensor_free(tensor);
  symrig_rig_close(rig);
  return (int)last;
}

static void test_stop_and_resume(int whole) {
  const char* by_probe = path_in(0, "by_probe.h5");
  const char* output = path_in(1, "resumed.h5");
  const char* log = path_in(2, "resumed.h5.log");
  symrig_error error;
  symrig_tensor* tensor = NULL;
  matrix_rig state = {0, 10, NULL};
  symrig_own_rig own = own_matrix(&state);
  symrig_rig* rig = rig_of(&own);
  remove(output);
  remove(log);
  EXPECT(symrig_capture(rig, output, NULL, NULL, NULL, &tensor, &error) == SYMRIG_INTERRUPTED);
  EXPECT(tensor == NULL && strstr(error.what, "callback stopped the capture") != NULL);
  EXPECT(strstr(error.hint, "keeps 10 photographs") != NULL && strstr(error.hint, "resume") != NULL);
  EXPECT(exists(log) && !exists(output));
  state.stop_after = 0;
  EXPECT(symrig_capture(rig, output, NULL, NULL, NULL, NULL, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(strstr(error.what, "resumed.h5.log") != NULL && state.taken == 10);
  /* The progress stops it later, then the handle. Both keep what is there. */
  EXPECT(symrig_capture(rig, output, "resume=on", stop_at_five, NULL, NULL, &error) == SYMRIG_INTERRUPTED);
  state.stop_after = 14;
  state.stop_handle = rig;
  EXPECT(symrig_capture(rig, output, "resume=on", NULL, NULL, NULL, &error) == SYMRIG_INTERRUPTED);
  EXPECT(exists(log) && state.taken > 10 && state.taken < whole);
  symrig_rig_close(rig);
  /* The log of another rig is no log of this one. */
  state.stop_after = 0;
  state.stop_handle = NULL;
  own.name = "another";
  rig = rig_of(&own);
  EXPECT(symrig_capture(rig, output, "resume=on", NULL, NULL, NULL, &error) == SYMRIG_BAD_FORMAT);
  symrig_rig_close(rig);
  own.name = "matrix";
  rig = rig_of(&own);
  EXPECT(symrig_capture(rig, output, "resume=on\nkeep_log=on", NULL, NULL, &tensor, &error) == 0);
  EXPECT(state.taken == whole); /* no photograph was taken twice */
  EXPECT(exists(log));
  EXPECT(same_tensor(by_probe, output) == 1);
  symrig_tensor_free(tensor);
  symrig_rig_close(rig);
  remove(log);
}

/* Callbacks of a small rig that do one thing wrong each, at their third photograph. */
enum fault {
  kReturns7,
  kReturnsAndTells,
  kFillsNothing,
  kInfinity,
  kNegativeVariance,
  kValid2,
  kNegativeSeconds,
  kNoEndOfText
};

typedef struct faulty_rig {
  enum fault fault;
  int taken;
} faulty_rig;

static int measure_badly(symrig_batch* batch, void* user) {
  faulty_rig* rig = user;
  const int now = ++rig->taken == 3;
  for (int i = 0; i < 16; ++i)
    if (!now || rig->fault != kFillsNothing) batch->mean[i] = batch->patterns[i];
  if (!now) return 0;
  switch (rig->fault) {
    case kReturns7:
      return 7;
    case kReturnsAndTells:
      strcpy(batch->error->what, "the lamp is\ncold");
      strcpy(batch->error->hint, "wait a minute");
      return SYMRIG_TIMEOUT;
    case kNoEndOfText:
      memset(batch->error, 'x', sizeof *batch->error);
      return SYMRIG_FAULT;
    case kInfinity:
      batch->mean[5] = INFINITY;
      return 0;
    case kNegativeVariance:
      batch->variance[15] = -1.0F;
      return 0;
    case kValid2:
      batch->valid[0] = 2;
      return 0;
    case kNegativeSeconds:
      batch->seconds = -1.0;
      return 0;
    case kFillsNothing:
      return 0;
  }
  return 0;
}

static void expect_fault(enum fault fault, int code, const char* words) {
  symrig_error error;
  symrig_tensor* tensor = NULL;
  faulty_rig state = {fault, 0};
  symrig_own_rig own;
  memset(&own, 0, sizeof own);
  own.size = sizeof own;
  own.measure = measure_badly;
  own.user = &state;
  own.rows = 4;
  own.columns = 4;
  symrig_rig* rig = rig_of(&own);
  const int returned = symrig_capture(rig, NULL, NULL, NULL, NULL, &tensor, &error);
  EXPECT(returned == code);
  EXPECT(returned == error.code && tensor == NULL);
  EXPECT(strstr(error.what, words) != NULL);
  if (returned != code || strstr(error.what, words) == NULL)
    fprintf(stderr, "fault %d: %d %s\n", (int)fault, returned, error.what);
  EXPECT(state.taken == 3);
  symrig_rig_close(rig);
}

static void test_faults_of_a_callback(void) {
  expect_fault(kReturns7, SYMRIG_DEVICE_LOST, "returned 7");
  expect_fault(kReturnsAndTells, SYMRIG_TIMEOUT, "the lamp is cold");
  expect_fault(kNoEndOfText, SYMRIG_FAULT, "xxx");
  expect_fault(kFillsNothing, SYMRIG_BAD_VALUE, "the mean nan at row 0, column 0");
  expect_fault(kInfinity, SYMRIG_BAD_VALUE, "the mean inf at row 1, column 1");
  expect_fault(kNegativeVariance, SYMRIG_BAD_VALUE, "the variance -1 at row 3, column 3");
  expect_fault(kValid2, SYMRIG_BAD_VALUE, "valid 2");
  expect_fault(kNegativeSeconds, SYMRIG_BAD_VALUE, "-1 seconds");
}

static void expect_refused(symrig_own_rig own, int code) {
  symrig_error error;
  symrig_rig* rig = NULL;
  EXPECT(symrig_rig_of_callback(&own, &rig, &error) == code);
  EXPECT(rig == NULL && error.code == code && error.what[0] != '\0');
}

static void test_refused_rigs(void) {
  matrix_rig state = {0, 0, NULL};
  const symrig_own_rig good = own_matrix(&state);
  symrig_own_rig own = good;
  symrig_rig* rig = NULL;
  symrig_error error;
  own.size = 0;
  expect_refused(own, SYMRIG_BAD_ARGUMENT);
  own.size = sizeof own + 8; /* of a newer version */
  expect_refused(own, SYMRIG_BAD_ARGUMENT);
  own = good;
  own.measure = NULL;
  expect_refused(own, SYMRIG_BAD_ARGUMENT);
  own = good;
  own.rows = 0;
  expect_refused(own, SYMRIG_BAD_ARGUMENT);
  own.rows = -3;
  expect_refused(own, SYMRIG_BAD_ARGUMENT);
  own.rows = INT32_MAX;
  own.columns = INT32_MAX;
  expect_refused(own, SYMRIG_BAD_ARGUMENT);
  own = good;
  own.channels = 65;
  expect_refused(own, SYMRIG_BAD_ARGUMENT);
  own = good;
  own.together = -1;
  expect_refused(own, SYMRIG_BAD_ARGUMENT);
  own.together = 1 << 20; /* 2^20 batches of 13 KB */
  expect_refused(own, SYMRIG_LIMIT);
  own = good;
  own.view_columns = 33; /* more views than columns */
  expect_refused(own, SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_rig_of_callback(NULL, &rig, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_rig_of_callback(&good, NULL, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_rig_open(NULL, NULL, &rig, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_rig_open("nowhere.toml", NULL, &rig, &error) == SYMRIG_NOT_FOUND && rig == NULL);
  EXPECT(symrig_rig_open("simm:gummy", NULL, &rig, &error) == SYMRIG_UNKNOWN_NAME && rig == NULL);
  EXPECT(symrig_capture(NULL, NULL, NULL, NULL, NULL, NULL, &error) == SYMRIG_BAD_ARGUMENT);
  symrig_rig_close(NULL);
  symrig_rig_stop(NULL);
  EXPECT(symrig_rig_shape(NULL).pattern_rows == 0);
}

/* options, the code, words of the message */
static void expect_option(symrig_rig* rig, const char* options, int code, const char* words) {
  symrig_error error;
  symrig_tensor* tensor = NULL;
  EXPECT(symrig_capture(rig, NULL, options, NULL, NULL, &tensor, &error) == code);
  EXPECT(tensor == NULL && (strstr(error.what, words) != NULL || strstr(error.hint, words) != NULL));
  if (strstr(error.what, words) == NULL && strstr(error.hint, words) == NULL)
    fprintf(stderr, "%s: %s; %s\n", options, error.what, error.hint);
}

static void test_options(void) {
  symrig_error error;
  symrig_rig* rig = NULL;
  matrix_rig state = {0, 0, NULL};
  const symrig_own_rig own = own_matrix(&state);
  rig = rig_of(&own);
  expect_option(rig, "tolerence=0.1", SYMRIG_UNKNOWN_NAME, "did you mean 'tolerance'");
  /* All keys, as symrig.h lists them. */
  expect_option(rig, "nothing-like-it=1", SYMRIG_UNKNOWN_NAME,
                "algorithm, tolerance, max_patterns, max_seconds, target_error, photograph_seconds, polish, "
                "split, dual_threshold, dual_subtracts, check_axis, unchecked, log, resume, keep_log");
  expect_option(rig, "tolerance", SYMRIG_BAD_ARGUMENT, "has no value");
  expect_option(rig, "tolerance=much", SYMRIG_BAD_ARGUMENT, "tolerance cannot be 'much'");
  expect_option(rig, "tolerance=", SYMRIG_BAD_ARGUMENT, "tolerance cannot be ''");
  expect_option(rig, "tolerance=2", SYMRIG_BAD_ARGUMENT, "tolerance");
  expect_option(rig, "polish=1.5", SYMRIG_BAD_ARGUMENT, "whole number");
  expect_option(rig, " polish=1\t polish=1", SYMRIG_BAD_ARGUMENT, "given twice");
  expect_option(rig, "resume=yes", SYMRIG_BAD_ARGUMENT, "give on or off");
  expect_option(rig, "max_patterns=0", SYMRIG_BAD_ARGUMENT, "max_patterns 0");
  expect_option(rig, "algorithm=best", SYMRIG_UNKNOWN_NAME, "best");
  expect_option(rig, "split=best", SYMRIG_UNKNOWN_NAME, "best");
  expect_option(rig, "dual_threshold=0.1", SYMRIG_BAD_ARGUMENT, "dual_threshold");
  EXPECT(state.taken == 0); /* all of that before the first photograph */
  EXPECT(symrig_capture(rig, path_in(0, "wrong.json"), NULL, NULL, NULL, NULL, &error) ==
         SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_capture(rig, path_in(0, "no/folder.h5"), NULL, NULL, NULL, NULL, &error) == SYMRIG_NOT_FOUND);
  symrig_rig_close(rig);
}

static int measure_inside(symrig_batch* batch, void* user) {
  symrig_error error;
  symrig_tensor* tensor = NULL;
  symrig_rig** rig = user;
  EXPECT(symrig_capture(*rig, NULL, NULL, NULL, NULL, &tensor, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_rig_measure(*rig, 1, batch->patterns, kMatrixPixels, batch->mean, NULL, NULL, kMatrixPixels,
                            &error) == SYMRIG_BAD_ARGUMENT);
  return SYMRIG_DEVICE_REFUSED;
}

static void test_a_rig_in_use(void) {
  symrig_error error;
  symrig_rig* rig = NULL;
  symrig_tensor* tensor = NULL;
  matrix_rig state = {0, 0, NULL};
  symrig_own_rig own = own_matrix(&state);
  own.measure = measure_inside;
  own.user = &rig;
  rig = rig_of(&own);
  EXPECT(symrig_capture(rig, NULL, NULL, NULL, NULL, &tensor, &error) == SYMRIG_DEVICE_REFUSED);
  symrig_rig_close(rig);
}

static void test_callbacks_that_throw(void) {
  symrig_error error;
  symrig_tensor* tensor = NULL;
  matrix_rig state = {0, 0, NULL};
  symrig_own_rig own = own_matrix(&state);
  symrig_rig* rig = rig_of(&own);
  EXPECT(symrig_capture(rig, NULL, NULL, throwing_progress, NULL, &tensor, &error) == SYMRIG_INTERRUPTED);
  EXPECT(tensor == NULL && error.code == SYMRIG_INTERRUPTED);
  symrig_rig_close(rig);
  own.measure = throwing_measure;
  rig = rig_of(&own);
  EXPECT(symrig_capture(rig, NULL, NULL, NULL, NULL, &tensor, &error) == SYMRIG_FAULT);
  EXPECT(tensor == NULL && strstr(error.what, "threw an exception") != NULL);
  symrig_rig_close(rig);
}

static double dot(const float* a, const float* b, int count) {
  double sum = 0;
  for (int k = 0; k < count; ++k) sum += (double)a[k] * (double)b[k];
  return sum;
}

/* T of channel c is (c + 1) times a matrix of 4 x 4 pixels whose first row also sees the last pixel. */
static int measure_colour(symrig_batch* batch, void* user) {
  (void)user;
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < 16; ++i) {
      const float other = i == 0 ? batch->patterns[15] : i == 15 ? batch->patterns[0] : 0.0F;
      batch->mean[c * 16 + i] = (float)(c + 1) * (batch->patterns[i] + 0.5F * other);
    }
  batch->seconds = 2.0;
  return 0;
}

static void test_a_tensor(void) {
  float light[3 * 16], many[3 * 48], one[48], picture[48], back[16], dual[48];
  symrig_error error;
  symrig_tensor* tensor = NULL;
  char* json = NULL;
  symrig_own_rig own;
  memset(&own, 0, sizeof own);
  own.size = sizeof own;
  own.measure = measure_colour;
  own.rows = 4;
  own.columns = 4;
  own.channels = 3;
  symrig_rig* rig = rig_of(&own);
  EXPECT(symrig_capture(rig, NULL, NULL, NULL, NULL, &tensor, &error) == 0);
  if (tensor == NULL) return;
  for (int k = 0; k < 48; ++k) {
    light[k] = (float)(k % 5) - 1.0F;
    picture[k] = (float)(k % 7) - 2.0F;
  }
  EXPECT(symrig_tensor_relight_many(tensor, 3, light, 48, many, 144, &error) == 0);
  for (int p = 0; p < 3; ++p) {
    EXPECT(symrig_tensor_relight(tensor, light + p * 16, 16, one, 48, &error) == 0);
    for (int k = 0; k < 48; ++k) EXPECT(fabsf(one[k] - many[p * 48 + k]) <= 1e-5F);
  }
  /* Sums of 16-bit factors and 32-bit sums: 2^-10 of sums below 100. */
  EXPECT(symrig_tensor_adjoint(tensor, 1, picture, 48, back, 16, &error) == 0);
  EXPECT(fabs(dot(many, picture, 48) - dot(light, back, 16)) < 0.1);
  EXPECT(fabs(dot(light, back, 16)) > 1.0);
  EXPECT(symrig_tensor_dual(tensor, light, 16, dual, 48, &error) == 0);
  for (int k = 0; k < 48; ++k) EXPECT(fabsf(dual[k] - many[k]) <= 0.01F); /* T is symmetric */
  EXPECT(fabsf(dual[32] - 3.0F * (light[0] + 0.5F * light[15])) <= 0.01F);
  EXPECT(symrig_tensor_relight_many(tensor, 0, light, 0, many, 0, &error) == 0);
  EXPECT(symrig_tensor_relight_many(tensor, 3, light, 47, many, 144, &error) == SYMRIG_SIZE_MISMATCH);
  EXPECT(symrig_tensor_relight_many(tensor, 3, light, 48, many, 143, &error) == SYMRIG_SIZE_MISMATCH);
  EXPECT(symrig_tensor_relight_many(tensor, 3, NULL, 48, many, 144, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_tensor_adjoint(tensor, 2, picture, 48, back, 16, &error) == SYMRIG_SIZE_MISMATCH);
  EXPECT(symrig_tensor_adjoint(tensor, SIZE_MAX, picture, 48, back, 16, &error) == SYMRIG_SIZE_MISMATCH);
  EXPECT(symrig_tensor_dual(tensor, light, 48, dual, 48, &error) == SYMRIG_SIZE_MISMATCH);
  light[7] = NAN;
  EXPECT(symrig_tensor_dual(tensor, light, 16, dual, 48, &error) == SYMRIG_BAD_VALUE);
  EXPECT(symrig_tensor_inspect(tensor, &json, &error) == 0);
  EXPECT(strstr(json, "\"leaves_per_level\"") != NULL && strstr(json, "\"scene\": \"callback\"") != NULL);
  EXPECT(strstr(json, "symrig_capture() of C") != NULL);
  symrig_free(json);
  EXPECT(symrig_tensor_save(tensor, path_in(0, "no/folder.h5"), &error) == SYMRIG_NOT_FOUND);
  EXPECT(symrig_tensor_save(tensor, NULL, &error) == SYMRIG_BAD_ARGUMENT);
  symrig_tensor_free(tensor);
  symrig_rig_close(rig);
}

/* Every pixel is noisy, and one of the red ones is unusable. */
static int measure_noisy_colour(symrig_batch* batch, void* user) {
  const int failed = measure_colour(batch, user);
  for (int k = 0; k < 48; ++k) batch->variance[k] = 0.25F;
  batch->valid[5] = 0;
  return failed;
}

static void test_photographs(void) {
  float patterns[2 * 16] = {0}, mean[2 * 48], variance[2 * 48];
  uint8_t valid[2 * 48];
  symrig_error error;
  symrig_own_rig own;
  memset(&own, 0, sizeof own);
  own.size = sizeof own;
  own.measure = measure_noisy_colour;
  own.rows = 4;
  own.columns = 4;
  own.channels = 3;
  symrig_rig* rig = rig_of(&own);
  patterns[0] = 0.5F;
  patterns[16 + 3] = 1.0F;
  EXPECT(symrig_rig_measure(rig, 2, patterns, 32, mean, variance, valid, 96, &error) == 0);
  for (int c = 0; c < 3; ++c) {
    const float channel = (float)(c + 1);
    EXPECT(mean[c * 16] == 0.5F * channel && mean[c * 16 + 15] == 0.25F * channel);
    EXPECT(mean[48 + c * 16 + 3] == channel && mean[48 + c * 16] == 0.0F);
  }
  for (int k = 0; k < 96; ++k) {
    EXPECT(valid[k] == (k % 48 == 5 ? 0 : 1));
    EXPECT(valid[k] == 0 || variance[k] == 0.25F); /* where it is not valid, no variance is known */
  }
  EXPECT(symrig_rig_measure(rig, 1, patterns, 16, mean, NULL, NULL, 48, &error) == 0);
  EXPECT(symrig_rig_measure(rig, 0, patterns, 0, mean, NULL, NULL, 0, &error) == 0);
  EXPECT(symrig_rig_measure(rig, 2, patterns, 31, mean, NULL, NULL, 96, &error) == SYMRIG_SIZE_MISMATCH);
  EXPECT(symrig_rig_measure(rig, 2, patterns, 32, mean, NULL, NULL, 95, &error) == SYMRIG_SIZE_MISMATCH);
  EXPECT(strstr(error.what, "photograph has 95 values, not 2 x 48") != NULL);
  EXPECT(symrig_rig_measure(rig, SIZE_MAX, patterns, 32, mean, NULL, NULL, 96, &error) ==
         SYMRIG_SIZE_MISMATCH);
  EXPECT(symrig_rig_measure(NULL, 1, patterns, 16, mean, NULL, NULL, 48, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_rig_measure(rig, 1, NULL, 16, mean, NULL, NULL, 48, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_rig_measure(rig, 1, patterns, 16, NULL, NULL, NULL, 48, &error) == SYMRIG_BAD_ARGUMENT);
  patterns[1] = 2.0F; /* more light than the projector has */
  EXPECT(symrig_rig_measure(rig, 1, patterns, 16, mean, NULL, NULL, 48, &error) == SYMRIG_BAD_VALUE);
  symrig_rig_close(rig);
}

static double frobenius_in(const char* json) {
  const char* at = json == NULL ? NULL : strstr(json, "\"error\"");
  at = at == NULL ? NULL : strstr(at, "\"frobenius\": ");
  return at == NULL ? NAN : strtod(at + strlen("\"frobenius\": "), NULL);
}

static void test_errors_against_rigs(void) {
  symrig_error error;
  symrig_tensor* tensor = NULL;
  char* json = NULL;
  matrix_rig state = {0, 0, NULL};
  symrig_own_rig own = own_matrix(&state);
  symrig_rig* rig = rig_of(&own);
  EXPECT(symrig_capture(rig, NULL, "tolerance=1e-6", NULL, NULL, &tensor, &error) == 0);
  state.taken = 0;
  EXPECT(symrig_rig_errors(rig, tensor, NULL, NULL, &json, &error) == 0);
  EXPECT(state.taken > 0); /* new photographs */
  /* Leaves that pass a tolerance of 1e-6, and factors of 16 bits: 2^-11 a factor. */
  EXPECT(frobenius_in(json) < 0.01);
  EXPECT(json != NULL && strstr(json, "\"rig\": \"matrix\"") != NULL &&
         strstr(json, "\"confidence\"") != NULL);
  symrig_free(json);
  EXPECT(symrig_rig_errors(rig, tensor, stop_at_five, NULL, &json, &error) == SYMRIG_INTERRUPTED);
  EXPECT(json == NULL);
  symrig_rig_close(rig);

  /* The truth of a simulated rig, without a photograph; and a rig of another size. */
  EXPECT(symrig_rig_open("sim:gummy?size=8x8", NULL, &rig, &error) == 0);
  EXPECT(symrig_rig_errors(rig, tensor, NULL, NULL, &json, &error) == SYMRIG_SIZE_MISMATCH);
  symrig_tensor_free(tensor);
  EXPECT(symrig_capture(rig, NULL, "max_patterns=20", NULL, NULL, &tensor, &error) == 0);
  EXPECT(symrig_rig_errors(rig, tensor, NULL, NULL, &json, &error) == 0);
  const double coarse = frobenius_in(json);
  symrig_free(json);
  symrig_tensor_free(tensor);
  EXPECT(symrig_capture(rig, NULL, NULL, NULL, NULL, &tensor, &error) == 0);
  EXPECT(symrig_rig_errors(rig, tensor, NULL, NULL, &json, &error) == 0);
  EXPECT(frobenius_in(json) < coarse);
  symrig_free(json);
  EXPECT(symrig_rig_errors(NULL, tensor, NULL, NULL, &json, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_rig_errors(rig, NULL, NULL, NULL, &json, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(symrig_rig_errors(rig, tensor, NULL, NULL, NULL, &error) == SYMRIG_BAD_ARGUMENT);
  symrig_tensor_free(tensor);
  symrig_rig_close(rig);
}

static void test_a_named_rig(void) {
  symrig_error error;
  symrig_rig* rig = NULL;
  symrig_tensor* tensor = NULL;
  char* json = NULL;
  const char* output = path_in(0, "named.h5");
  EXPECT(symrig_rig_open("sim:gummy?size=16x20", NULL, &rig, &error) == 0);
  if (rig == NULL) return;
  EXPECT(symrig_rig_shape(rig).photograph_columns == 20);
  EXPECT(symrig_capture(rig, output, "max_patterns=60 log=off", NULL, NULL, NULL, &error) == 0);
  symrig_rig_close(rig);
  EXPECT(symrig_tensor_load(output, &tensor, &error) == 0);
  EXPECT(symrig_tensor_errors(tensor, &json, &error) == 0);
  EXPECT(json != NULL && strstr(json, "\"frobenius\": 0.") != NULL &&
         strstr(json, "\"lit_pixels\": ") != NULL);
  EXPECT(json != NULL && strstr(json, "\"confidence\"") != NULL);
  symrig_free(json);
  symrig_tensor_free(tensor);
}

int main(int count, char** words) {
  if (count != 2) return 2;
  snprintf(folder, sizeof folder, "%s", words[1]);
  test_stop_and_resume(test_same_as_a_probe());
  test_faults_of_a_callback();
  test_refused_rigs();
  test_options();
  test_a_rig_in_use();
  test_callbacks_that_throw();
  test_a_tensor();
  test_photographs();
  test_errors_against_rigs();
  test_a_named_rig();
  return failures == 0 ? 0 : 1;
}
