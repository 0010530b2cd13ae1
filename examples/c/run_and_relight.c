// SPDX-License-Identifier: Apache-2.0
/* Runs a program on a board and writes the receipt; then shows a scene under half of its light.
 * usage: run_and_relight URI PROGRAM RECEIPT SCENE */
#include <symrig/symrig.h>

#include <stdio.h>
#include <stdlib.h>

static int explain(const char* doing, const symrig_error* error) {
  fprintf(stderr, "%s: %s: %s; %s\n", doing, symrig_error_name(error->code), error->what, error->hint);
  return 1;
}

static int on_progress(const symrig_progress* at, void* user) {
  (void)user;
  fprintf(stderr, "\r%llu of %llu patterns", (unsigned long long)at->patterns,
          (unsigned long long)at->patterns_asked);
  return 0; /* go on */
}

static int run(const char* uri, const char* path, const char* receipt_path) {
  symrig_error error;
  symrig_program* program = NULL;
  symrig_board* board = NULL;
  char* receipt = NULL;
  int failed = 0;
  if (symrig_program_load(path, &program, &error) != 0) return explain("program", &error);
  if (symrig_board_open(uri, program, &board, &error) != 0) {
    failed = explain("board", &error);
  } else if (symrig_board_run(board, program, on_progress, NULL, &receipt, &error) != 0) {
    failed = explain("run", &error);
  }
  if (receipt != NULL) { /* there too after a fault or an abort */
    FILE* file = fopen(receipt_path, "w");
    if (file == NULL || fputs(receipt, file) < 0 || fclose(file) != 0) failed = 1;
  }
  symrig_free(receipt);
  symrig_board_close(board);
  symrig_program_free(program);
  return failed;
}

static int relight(const char* path) {
  symrig_error error;
  symrig_tensor* tensor = NULL;
  if (symrig_tensor_load(path, &tensor, &error) != 0) return explain("scene", &error);
  const symrig_shape shape = symrig_tensor_shape(tensor);
  const size_t lights = (size_t)shape.pattern_rows * (size_t)shape.pattern_columns;
  const size_t pixels =
      (size_t)shape.photograph_rows * (size_t)shape.photograph_columns * (size_t)shape.channels;
  float* pattern = calloc(lights, sizeof *pattern);
  float* photograph = calloc(pixels, sizeof *photograph);
  int failed = pattern == NULL || photograph == NULL;
  for (size_t k = 0; !failed && k < lights / 2; ++k) pattern[k] = 1.0F; /* the upper half */
  if (!failed && symrig_tensor_relight(tensor, pattern, lights, photograph, pixels, &error) != 0)
    failed = explain("relight", &error);
  double sum = 0;
  for (size_t k = 0; !failed && k < pixels; ++k) sum += photograph[k];
  if (!failed) printf("%d x %d pixels, sum %.9g\n", shape.photograph_rows, shape.photograph_columns, sum);
  free(photograph);
  free(pattern);
  symrig_tensor_free(tensor);
  return failed;
}

int main(int count, char** words) {
  if (count != 5 || symrig_api_version() < SYMRIG_API_VERSION) return 2;
  return run(words[1], words[2], words[3]) || relight(words[4]);
}
