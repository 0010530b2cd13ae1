// SPDX-License-Identifier: Apache-2.0
/* The C interface of libsymrig: run timed programs on a trigger board, relight a measured scene.
 *
 * A function that can fail returns 0 for success, or a code of docs/errors.md (100 to 499). With a code it
 * also fills *error, if error is not null. These functions never throw, print or exit.
 *
 * Threads: only one thread may use a handle at a time. There are two exceptions. Any thread may call
 * symrig_board_abort(). Several threads may call symrig_tensor_relight() at once on one tensor. Different
 * handles are independent.
 *
 * Input texts are UTF-8; they must be valid only during the call. The caller owns output texts and frees them
 * with symrig_free(). Link with the C++ run-time (docs/howto-c.md).
 */
#ifndef SYMRIG_SYMRIG_H
#define SYMRIG_SYMRIG_H

/* NOLINTBEGIN(modernize-use-using,modernize-deprecated-headers): this is C */
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this interface. It increases when functions are added; existing ones keep their meaning. */
#define SYMRIG_API_VERSION 1
/* The interface version of the library at run time. Stop if it is less than SYMRIG_API_VERSION. */
uint32_t symrig_api_version(void);
/* Version of the library, such as "0.1.0". Do not free it. */
const char* symrig_version(void);

typedef struct symrig_error {
  int code;       /* the returned code */
  char what[512]; /* the thing and the cause, one line */
  char hint[256]; /* the next step; may be empty */
} symrig_error;

/* Name of a code, such as "device_lost"; "unknown" if there is no such code. Do not free it. */
const char* symrig_error_name(int code);

/* Frees an output text. Null is allowed. */
void symrig_free(char* text);

/* ---- programs ---- */

typedef struct symrig_program symrig_program;

/* Reads a program file in TOML, or a compiled one (symrig compile).
 * fails: not_found, io, bad_format. */
int symrig_program_load(const char* path, symrig_program** program, symrig_error* error);
void symrig_program_free(symrig_program* program);

/* ---- boards ---- */

typedef struct symrig_board symrig_board;

/* Connects to a board: "usb:", "serial:/dev/ttyACM0", "tcp:HOST:PORT", ...; "sim:" is a board in virtual
 * time.
 * program: the program that it will run. It gives the keep-alive, and the wiring of a simulated rig. It may
 * be null (then the keep-alive is 1 s). It may be freed before the board.
 * fails: bad_argument, unknown_name, device_lost, protocol. */
int symrig_board_open(const char* uri, const symrig_program* program, symrig_board** board,
                      symrig_error* error);
/* Aborts a run in progress, and disconnects. */
void symrig_board_close(symrig_board* board);

/* Identity and abilities of the board, as JSON in the format of `--board FILE`. */
int symrig_board_info(const symrig_board* board, char** json, symrig_error* error);

/* Sets the outputs to their safe levels at once. Any thread may call it. A symrig_board_run() in another
 * thread then ends within 0.2 s with code 402 (interrupted). */
int symrig_board_abort(symrig_board* board, symrig_error* error);
/* Clears a fault that an earlier run has latched. */
int symrig_board_clear_fault(symrig_board* board, symrig_error* error);

/* The linter's findings for a program on this board, as JSON: {"ok", "findings": [{"line", "severity",
 * "rule", "what", "alternative"}, ...]}. This call succeeds even if the program has errors: see "ok".
 * Compiled programs were linted before, so they give no findings.
 * fails: device_refused (compiled for another kind of board). */
int symrig_program_lint(const symrig_program* program, const symrig_board* board, char** json,
                        symrig_error* error);

typedef struct symrig_progress {
  uint64_t patterns;       /* shown so far */
  uint64_t patterns_asked; /* total; 0 for programs written step by step */
  uint64_t marks;          /* passed so far */
  double elapsed;          /* seconds */
  double expected;         /* seconds */
} symrig_progress;

/* Called several times a second by the thread that runs. Return 0 to continue, another value to abort. */
typedef int (*symrig_on_progress)(const symrig_progress* progress, void* user);

/* Configures the board, uploads the program, runs it, waits for the end, and keeps the board alive meanwhile.
 * on_progress and receipt may be null. *receipt: see docs/receipt.md. The codes 401 (fault), 402
 * (interrupted) and 203 (an awaited edge did not come) also give a receipt; all other codes set it to null.
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

/* Reads a scene.h5 of capture or fit. fails: not_found, io, bad_format, bad_value. */
int symrig_tensor_load(const char* path, symrig_tensor** tensor, symrig_error* error);
void symrig_tensor_free(symrig_tensor* tensor);
symrig_shape symrig_tensor_shape(const symrig_tensor* tensor);

/* photograph = T pattern: what the camera would see under this light.
 * pattern: rows x columns values, row after row, 1 = full light. photograph: rows x columns x channels
 * values, channel after channel, in the units of the capture. The counts are numbers of floats; they must
 * match the shape. fails: size_mismatch, bad_value (a pattern that is not finite). */
int symrig_tensor_relight(const symrig_tensor* tensor, const float* pattern, size_t pattern_count,
                          float* photograph, size_t photograph_count, symrig_error* error);

#ifdef __cplusplus
}
#endif
/* NOLINTEND(modernize-use-using,modernize-deprecated-headers) */

#endif
