// SPDX-License-Identifier: Apache-2.0
/* The C interface as a C11 program sees it. usage: test_capi FOLDER */
#include "expect.h"
#include "scene_for_c.h"
#include "symrig/symrig.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum {
  kBadArgument = 100,
  kBadValue = 304,
  kBadFormat = 302,
  kNotFound = 300,
  kSizeMismatch = 303,
  kInterrupted = 402,
  kTimeout = 203
};

static char folder[512];

static const char* path_of(const char* name) {
  static char path[1024];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  return path;
}

static symrig_program* load_text(const char* name, const char* text) {
  symrig_error error;
  symrig_program* program = NULL;
  FILE* file = fopen(path_of(name), "w");
  if (file == NULL) return NULL;
  fputs(text, file);
  fclose(file);
  EXPECT(symrig_program_load(path_of(name), &program, &error) == 0);
  return program;
}

static int count_calls(const symrig_progress* at, void* user) {
  EXPECT(at->patterns <= at->patterns_asked);
  EXPECT(at->patterns_asked == 8);
  ++*(int*)user;
  return 0;
}

static int stop_at_once(const symrig_progress* at, void* user) {
  (void)at;
  (void)user;
  return 1;
}

static void test_versions(void) {
  EXPECT(symrig_api_version() == SYMRIG_API_VERSION);
  EXPECT(strncmp(symrig_version(), "0.", 2) == 0);
  EXPECT(strcmp(symrig_error_name(200), "device_lost") == 0);
  symrig_free(NULL);
  symrig_board_close(NULL);
  symrig_program_free(NULL);
  symrig_tensor_free(NULL);
}

static void test_run(void) {
  symrig_error error;
  symrig_program* program = NULL;
  symrig_board* board = NULL;
  char* json = NULL;
  int calls = 0;
  EXPECT(symrig_program_load(SYMRIG_EXAMPLES "/hdr-scan.toml", &program, &error) == 0);
  EXPECT(symrig_board_open("sim:", program, &board, &error) == 0);
  EXPECT(symrig_board_info(board, &json, &error) == 0);
  EXPECT(json != NULL && strstr(json, "\"camera_trigger\"") != NULL);
  symrig_free(json);
  EXPECT(symrig_program_lint(program, board, &json, &error) == 0);
  EXPECT(json != NULL && strstr(json, "\"ok\":true") != NULL);
  symrig_free(json);
  EXPECT(symrig_board_run(board, program, count_calls, &calls, &json, &error) == 0);
  EXPECT(calls > 2);
  EXPECT(json != NULL && strstr(json, "\"end\":\"completed\"") != NULL);
  EXPECT(json != NULL && strstr(json, "\"exact\":true") != NULL);
  EXPECT(json != NULL && strstr(json, "40 frames for 40 exposures") != NULL);
  symrig_free(json);
  /* Again on the same board, without callback or receipt. */
  EXPECT(symrig_board_run(board, program, NULL, NULL, NULL, NULL) == 0);
  /* Aborted by the callback: the receipt is there all the same. */
  EXPECT(symrig_board_run(board, program, stop_at_once, NULL, &json, &error) == kInterrupted);
  EXPECT(error.code == kInterrupted);
  EXPECT(json != NULL && strstr(json, "\"interrupted\":true") != NULL);
  symrig_free(json);
  EXPECT(symrig_board_abort(board, &error) == 0);
  EXPECT(symrig_board_run(board, program, NULL, NULL, NULL, &error) == 0);
  symrig_board_close(board);
  symrig_program_free(program);
}

static void test_faults(void) {
  symrig_error error;
  symrig_board* board = NULL;
  symrig_program* program = NULL;
  char* json = NULL;
  EXPECT(symrig_program_load("nowhere.toml", &program, &error) == kNotFound);
  EXPECT(program == NULL && error.code == kNotFound && strstr(error.what, "nowhere.toml") != NULL);
  EXPECT(symrig_program_load(NULL, &program, &error) == kBadArgument);
  EXPECT(symrig_program_load("nowhere.toml", NULL, NULL) == kBadArgument);
  EXPECT(symrig_board_open("nothing:", NULL, &board, &error) == kBadArgument);
  EXPECT(board == NULL && error.what[0] != '\0');
  EXPECT(symrig_board_open("sim:", NULL, &board, &error) == 0);
  program = load_text("broken.toml", "symrig = 1\n[program]\npatterns = 2\nbracket = [\"1 us\"]\n");
  EXPECT(symrig_program_lint(program, board, &json, &error) == 0);
  EXPECT(json != NULL && strstr(json, "\"ok\":false") != NULL && strstr(json, "camera.min_exposure") != NULL);
  symrig_free(json);
  EXPECT(symrig_board_run(board, program, NULL, NULL, &json, &error) == kBadValue);
  EXPECT(json == NULL && strstr(error.what, "camera.min_exposure") != NULL);
  symrig_program_free(program);
  program = load_text("waits.toml",
                      "symrig = 1\n[program]\nsteps = [{ hold = \"1 ms\" }, { wait = \"camera_strobe\", "
                      "timeout = \"1 ms\" }]\n");
  EXPECT(symrig_board_run(board, program, NULL, NULL, &json, &error) == kTimeout);
  EXPECT(json != NULL && strstr(json, "\"end\":\"wait_timeout\"") != NULL);
  symrig_free(json);
  symrig_program_free(program);
  symrig_board_close(board);
}

static void test_relight(void) {
  enum { kPixels = 99 };
  float pattern[kPixels], expected[kPixels], photograph[kPixels];
  symrig_error error;
  symrig_tensor* tensor = NULL;
  for (int k = 0; k < kPixels; ++k) pattern[k] = (float)(k % 7) / 7.0F;
  EXPECT(make_scene(path_of("scene.h5"), pattern, expected) == 0);
  EXPECT(symrig_tensor_load(path_of("scene.h5"), &tensor, &error) == 0);
  if (tensor == NULL) return;
  const symrig_shape shape = symrig_tensor_shape(tensor);
  EXPECT(shape.pattern_rows == 9 && shape.pattern_columns == 11 && shape.channels == 1);
  EXPECT(shape.photograph_rows == 9 && shape.photograph_columns == 11);
  EXPECT(symrig_tensor_relight(tensor, pattern, kPixels, photograph, kPixels, &error) == 0);
  for (int k = 0; k < kPixels; ++k) EXPECT(photograph[k] == expected[k] && photograph[k] > 0.0F);
  EXPECT(symrig_tensor_relight(tensor, pattern, kPixels - 1, photograph, kPixels, &error) == kSizeMismatch);
  EXPECT(symrig_tensor_relight(tensor, pattern, kPixels, photograph, 1, &error) == kSizeMismatch);
  pattern[3] = NAN;
  EXPECT(symrig_tensor_relight(tensor, pattern, kPixels, photograph, kPixels, &error) == kBadValue);
  symrig_tensor_free(tensor);
  EXPECT(symrig_tensor_load(path_of("broken.toml"), &tensor, &error) == kBadFormat);
  EXPECT(tensor == NULL);
}

/* A mosaic: relit pictures have all colours, the adjoint is of the pixels' own. */
static void test_camera(void) {
  enum { kCells = 99, kValues = 45 };
  float pattern[2 * kCells], expected[kValues], filters[kValues] = {0}, photograph[2 * kValues],
                                                light[kCells];
  symrig_error error;
  symrig_tensor* tensor = NULL;
  for (int k = 0; k < kCells; ++k) {
    pattern[k] = (float)(k % 5) / 5.0F;
    pattern[k + kCells] = 1.0F;
  }
  EXPECT(symrig_tensor_load(path_of("scene.h5"), &tensor, &error) == 0);
  EXPECT(symrig_camera_shape(tensor).photograph_rows == 0 && symrig_camera_shape(NULL).channels == 0);
  EXPECT(symrig_camera_relight(tensor, 1, pattern, kCells, photograph, kValues, &error) ==
         SYMRIG_BAD_ARGUMENT);
  EXPECT(strstr(error.what, "no pixels of the camera") != NULL);
  symrig_tensor_free(tensor);
  EXPECT(symrig_camera_relight(NULL, 1, pattern, kCells, photograph, kValues, &error) == SYMRIG_BAD_ARGUMENT);
  EXPECT(strstr(error.what, "tensor is null") != NULL);
  EXPECT(make_camera_scene(path_of("scene.h5"), pattern, expected, filters) == 0);
  EXPECT(symrig_tensor_load(path_of("scene.h5"), &tensor, &error) == 0);
  if (tensor == NULL) return;
  const symrig_shape shape = symrig_camera_shape(tensor);
  EXPECT(shape.pattern_rows == 9 && shape.pattern_columns == 11 && shape.channels == 3);
  EXPECT(shape.photograph_rows == 3 && shape.photograph_columns == 5);
  EXPECT(symrig_camera_relight(tensor, 2, pattern, 2 * kCells, photograph, 2 * kValues, &error) == 0);
  double sum = 0, back = 0, all = 0;
  for (int k = 0; k < kValues; ++k) {
    EXPECT(fabsf(photograph[k] - expected[k]) <= 1e-5F * fabsf(expected[k]));
    EXPECT(photograph[k] != 0.0F || k % 15 == 14); /* the last pixel has no row */
    sum += (double)photograph[k] * filters[k] * (k + 1);
    all += filters[k];
    filters[k] *= (float)(k + 1);
  }
  EXPECT(all == 14);
  EXPECT(symrig_camera_adjoint(tensor, 1, filters, kValues, light, kCells, &error) == 0);
  for (int k = 0; k < kCells; ++k) back += (double)light[k] * pattern[k];
  EXPECT(fabs(sum) > 1.0 && fabs(back - sum) <= 1e-5 * fabs(sum)); /* <T x, y> = <x, T' y> */
  EXPECT(symrig_camera_relight(tensor, 1, pattern, kCells - 1, photograph, kValues, &error) == kSizeMismatch);
  EXPECT(symrig_camera_adjoint(tensor, 1, filters, 15, light, kCells, &error) == kSizeMismatch);
  pattern[3] = NAN;
  EXPECT(symrig_camera_relight(tensor, 1, pattern, kCells, photograph, kValues, &error) == kBadValue);
  symrig_tensor_free(tensor);
}

int main(int count, char** words) {
  if (count != 2) return 2;
  snprintf(folder, sizeof folder, "%s", words[1]);
  test_versions();
  test_run();
  test_faults();
  test_relight();
  test_camera();
  return failures == 0 ? 0 : 1;
}
