// SPDX-License-Identifier: Apache-2.0
/* The C interface of libsymrig: run timed programs on a trigger board, relight a measured scene.
 *
 * Every function that can fail returns 0, or the code of docs/errors.md (100 to 499), and then fills *error
 * if that is not null. Nothing is thrown, printed or ended by these functions.
 *
 * Threads: a handle is used by one thread at a time, except symrig_board_abort(), which any thread may call,
 * and symrig_tensor_relight(), which several may call at once on one tensor. Different handles are
 * independent.
 *
 * Texts given in are UTF-8 and need to live only during the call. Texts given out belong to the caller:
 * symrig_free(). Link with the C++ run-time (docs/howto-c.md).
 */
#ifndef SYMRIG_SYMRIG_H
#define SYMRIG_SYMRIG_H

/* NOLINTBEGIN(modernize-use-using,modernize-deprecated-headers): this is C */
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this interface. It grows when functions are added; what is there keeps its meaning. */
#define SYMRIG_API_VERSION 1
/* That of the library at run time: at least the one compiled against, or do not go on. */
uint32_t symrig_api_version(void);
/* Of the library: "0.1.0". Not to be freed. */
const char* symrig_version(void);

typedef struct symrig_error {
  int code;       /* as returned */
  char what[512]; /* the thing and the cause, one line */
  char hint[256]; /* the next step; may be empty */
} symrig_error;

/* "device_lost"; "unknown" if there is no such code. Not to be freed. */
const char* symrig_error_name(int code);

/* Frees a text that a function gave out. Null is fine. */
void symrig_free(char* text);

/* ---- programs ---- */

typedef struct symrig_program symrig_program;

/* Reads a program file in TOML, or a compiled one (symrig compile).
 * fails: not_found, io, bad_format. */
int symrig_program_load(const char* path, symrig_program** program, symrig_error* error);
void symrig_program_free(symrig_program* program);

/* ---- boards ---- */

typedef struct symrig_board symrig_board;

/* Connects to a board: "usb:", "serial:/dev/ttyACM0", "tcp:HOST:PORT", ...; "sim:" is one in virtual time.
 * program: what it will run, for its keep-alive and for the wiring of a simulated rig; may be null (then the
 * keep-alive is 1 s). It may be freed before the board.
 * fails: bad_argument, unknown_name, device_lost, protocol. */
int symrig_board_open(const char* uri, const symrig_program* program, symrig_board** board,
                      symrig_error* error);
/* Aborts a run that is still going on, and disconnects. */
void symrig_board_close(symrig_board* board);

/* Who the board is and what it can do, as JSON: what `--board FILE` takes. */
int symrig_board_info(const symrig_board* board, char** json, symrig_error* error);

/* Outputs to their safe levels at once. Any thread may call it; during symrig_board_run() in another thread
 * it makes that end within 0.2 s with code 402 (interrupted). */
int symrig_board_abort(symrig_board* board, symrig_error* error);
/* Leaves the latched fault of an earlier run. */
int symrig_board_clear_fault(symrig_board* board, symrig_error* error);

/* What the linter says of a program on this board, as JSON: {"ok", "findings": [{"line", "severity", "rule",
 * "what", "alternative"}, ...]}. A program with errors is no failure of this call: see "ok". Compiled
 * programs have been linted before and give no findings. fails: device_refused (compiled for another kind of
 * board). */
int symrig_program_lint(const symrig_program* program, const symrig_board* board, char** json,
                        symrig_error* error);

typedef struct symrig_progress {
  uint64_t patterns;       /* shown so far */
  uint64_t patterns_asked; /* in all; 0 for programs written by hand */
  uint64_t marks;          /* passed so far */
  double elapsed;          /* seconds */
  double expected;         /* seconds */
} symrig_progress;

/* Called several times a second by the thread that runs. 0: go on; anything else: abort. */
typedef int (*symrig_on_progress)(const symrig_progress* progress, void* user);

/* Configures the board, uploads the program, runs it and waits for the end, keeping the board alive.
 * on_progress and receipt may be null. *receipt: docs/receipt.md; given out also with the codes 401 (fault),
 * 402 (interrupted) and 203 (an awaited edge did not come), and set to null with all others.
 * fails: bad_value (the program has errors: lint it), device_refused, device_lost, protocol, timeout, fault,
 * interrupted. */
int symrig_board_run(symrig_board* board, const symrig_program* program, symrig_on_progress on_progress,
                     void* user, char** receipt, symrig_error* error);

/* ---- scenes ---- */

typedef struct symrig_tensor symrig_tensor;

typedef struct symrig_shape {
  int32_t pattern_rows, pattern_columns;       /* of the projector */
  int32_t photograph_rows, photograph_columns; /* of the camera */
  int32_t channels;                            /* of the photograph; patterns have one */
} symrig_shape;

/* Reads scene.h5, as capture and fit write it. fails: not_found, io, bad_format, bad_value. */
int symrig_tensor_load(const char* path, symrig_tensor** tensor, symrig_error* error);
void symrig_tensor_free(symrig_tensor* tensor);
symrig_shape symrig_tensor_shape(const symrig_tensor* tensor);

/* photograph = T pattern: what the camera would see under this light.
 * pattern: rows x columns values, row after row, 1 = full light. photograph: rows x columns x channels
 * values, channel after channel, in the units of the capture. The counts are numbers of floats and must fit
 * the shape. fails: size_mismatch, bad_value (a pattern that is not finite). */
int symrig_tensor_relight(const symrig_tensor* tensor, const float* pattern, size_t pattern_count,
                          float* photograph, size_t photograph_count, symrig_error* error);

#ifdef __cplusplus
}
#endif
/* NOLINTEND(modernize-use-using,modernize-deprecated-headers) */

#endif
