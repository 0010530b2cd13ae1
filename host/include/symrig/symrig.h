// SPDX-License-Identifier: Apache-2.0
/* The C interface of libsymrig: run timed programs on a trigger board, capture a scene, relight it.
 *
 * A function that can fail returns 0 for success, or a code of docs/errors.md (100 to 499). With a code it
 * also fills *error, if error is not null. These functions never throw, print or exit.
 *
 * Threads: only one thread may use a handle at a time. There are two exceptions. Any thread may call
 * symrig_board_abort() and symrig_rig_stop(). Several threads may use one tensor at once in functions that
 * take it as const. Different handles are independent.
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
#define SYMRIG_API_VERSION 4
/* The interface version of the library at run time. Stop if it is less than SYMRIG_API_VERSION. */
uint32_t symrig_api_version(void);
/* Version of the library, such as "0.1.0". Do not free it. */
const char* symrig_version(void);

/* The codes. A callback of yours may return them too. */
enum symrig_code {
  SYMRIG_BAD_ARGUMENT = 100,
  SYMRIG_UNKNOWN_NAME = 101,
  SYMRIG_DEVICE_LOST = 200,
  SYMRIG_DEVICE_REFUSED = 201,
  SYMRIG_PROTOCOL = 202,
  SYMRIG_TIMEOUT = 203,
  SYMRIG_FRAME_MISSING = 204,
  SYMRIG_WRONG_LIGHT = 205,
  SYMRIG_NOT_FOUND = 300,
  SYMRIG_IO = 301,
  SYMRIG_BAD_FORMAT = 302,
  SYMRIG_SIZE_MISMATCH = 303,
  SYMRIG_BAD_VALUE = 304,
  SYMRIG_LIMIT = 400,
  SYMRIG_FAULT = 401,
  SYMRIG_INTERRUPTED = 402
};

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

/* The same for many patterns, one after the other in memory. It reads T once for 16 of them, so it is faster.
 * The order of its sums differs, so the last bits may differ from those of symrig_tensor_relight().
 * pattern_count and photograph_count: floats of all patterns, and of all photographs. */
int symrig_tensor_relight_many(const symrig_tensor* tensor, size_t patterns, const float* pattern,
                               size_t pattern_count, float* photograph, size_t photograph_count,
                               symrig_error* error);

/* light = sum over channels c of T_c' picture_c, with T' the transpose of T: <T x, y> = <x, T' y>.
 * pictures: how many there are, each as a photograph; as many lights come back, each as a pattern. */
int symrig_tensor_adjoint(const symrig_tensor* tensor, size_t pictures, const float* picture,
                          size_t picture_count, float* light, size_t light_count, symrig_error* error);

/* The scene as the projector sees it, lit from the camera: T_c' light for each channel c.
 * light: one channel of the camera's rows x columns. picture: rows x columns x channels of the projector. */
int symrig_tensor_dual(const symrig_tensor* tensor, const float* light, size_t light_count, float* picture,
                       size_t picture_count, symrig_error* error);

/* The scene on the camera's own pixels, if the camera has more of them than the projector has cells: the
 * sizes of its patterns and photographs. All are 0 if the scene has none (docs/file-format.md, Camera
 * pixels). */
symrig_shape symrig_camera_shape(const symrig_tensor* tensor);

/* As symrig_tensor_relight_many(), with photographs of the camera's own pixels. Pixels that look beside the
 * projector's picture are 0. Of a camera with a colour mosaic each pixel has three colours: those that it
 * does not see come from the flood-lit scene around it. fails: size_mismatch, bad_value, bad_argument (the
 * scene has none). */
int symrig_camera_relight(const symrig_tensor* tensor, size_t patterns, const float* pattern,
                          size_t pattern_count, float* photograph, size_t photograph_count,
                          symrig_error* error);

/* As symrig_tensor_adjoint(), of pictures of the camera's own pixels. Of a camera with a colour mosaic it
 * takes of each pixel the channel of its own filter only. */
int symrig_camera_adjoint(const symrig_tensor* tensor, size_t pictures, const float* picture,
                          size_t picture_count, float* light, size_t light_count, symrig_error* error);

/* What is stored, level by level, and how the scene was captured: the JSON of `symrig inspect --json`. */
int symrig_tensor_inspect(const symrig_tensor* tensor, char** json, symrig_error* error);

/* How wrong the scene is, as JSON with the keys of `symrig capture --json` and `symrig evaluate --json`:
 * "estimated_error", "estimated_error_uncertainty" and "estimated_error_not_given" (by the capture; null if
 * it held nothing out), and "held_out" (each kept photograph against its prediction). */
int symrig_tensor_errors(const symrig_tensor* tensor, char** json, symrig_error* error);

/* Writes scene.h5. A file that is there is replaced only by a whole one. fails: not_found, io. */
int symrig_tensor_save(const symrig_tensor* tensor, const char* path, symrig_error* error);

/* ---- rigs ---- */

typedef struct symrig_rig symrig_rig;

/* Opens a rig by its name: "sim:NAME?key=value", "exec:COMMAND", "dense:FILE", or a rig file ("rig.toml").
 * registration: file of `symrig calibrate` if the camera has pixels of its own; null: the rig file's own.
 * fails: unknown_name, bad_argument, not_found, bad_format, and errors of devices. */
int symrig_rig_open(const char* name, const char* registration, symrig_rig** rig, symrig_error* error);

/* Patterns to be shown, and room for their photographs. The library makes it. Later versions may add members
 * at its end. Pictures follow each other; each goes row by row, a photograph channel after channel. */
typedef struct symrig_batch {
  size_t count;          /* patterns: from 1 to symrig_own_rig.together */
  const float* patterns; /* count x rows x columns values from 0 to 1 */
  float* mean;           /* fill it: count x channels x rows x columns, radiance per unit of light.
                            All are NaN before, and a NaN that is left and valid is an error. */
  float* variance;       /* of the mean; 0 before: without noise */
  uint8_t* valid;      /* 1 before; set 0 where a pixel is unusable. Mean and variance then do not matter. */
  double seconds;      /* how long it took on the rig's clock; 0 before: the rig has no clock */
  symrig_error* error; /* you may fill `what` and `hint` if you return an error */
} symrig_batch;

/* Shows the patterns and fills the photographs. Return 0; or SYMRIG_INTERRUPTED to stop the capture; or a
 * code of symrig_code for an error. Another number counts as SYMRIG_DEVICE_LOST.
 * It is called by the thread that captures. It must not use the rig's handle, except to stop. */
typedef int (*symrig_measure)(symrig_batch* batch, void* user);

/* A rig of your own. Set all members to 0 first, then `size`. Later versions may add members at its end;
 * `size` tells the library which ones your program knows, and the others keep their defaults. */
typedef struct symrig_own_rig {
  size_t size;            /* sizeof(symrig_own_rig) */
  symrig_measure measure; /* needed */
  void* user;             /* handed to measure */
  const char* name;       /* one line for reports; null: "callback". A log continues only with this name. */
  int32_t rows, columns;  /* of patterns and of photographs: both have one grid */
  int32_t channels;       /* of photographs, 1 to 64; 0: 1 */
  int32_t view_rows;      /* coaxial views that tile the grid; 0: 1 */
  int32_t view_columns;   /* 0: 1 */
  int32_t together;       /* most patterns of a batch; 0: 1. A log loses at most as many at a kill. */
} symrig_own_rig;

/* Makes a rig of a callback. `own` may be freed afterwards; `user` must live as long as the rig.
 * fails: bad_argument, limit (a batch would be larger than 1 GiB). */
int symrig_rig_of_callback(const symrig_own_rig* own, symrig_rig** rig, symrig_error* error);

/* Closes the devices. No capture may be in progress. */
void symrig_rig_close(symrig_rig* rig);

/* The grids of patterns and photographs. */
symrig_shape symrig_rig_shape(const symrig_rig* rig);

/* Shows patterns and gives their photographs, without a capture. Pictures follow each other; each goes row by
 * row, a photograph channel after channel.
 * pattern: patterns x rows x columns values from 0 to 1 (symrig_rig_shape()). mean: room for patterns x
 * channels x photograph rows x photograph columns values, radiance per unit of light. variance (of the mean;
 * 0: without noise) and valid (0: unusable) have as many values, and may be null. photograph_count: values
 * that there is room for in each.
 * fails: size_mismatch, bad_value (a pattern), bad_argument (the rig is in use), interrupted, errors of
 * devices. The photographs are undefined then. */
int symrig_rig_measure(symrig_rig* rig, size_t patterns, const float* pattern, size_t pattern_count,
                       float* mean, float* variance, uint8_t* valid, size_t photograph_count,
                       symrig_error* error);

/* Ends the call that is in progress on this rig with code 402 (interrupted), after the photographs that are
 * being taken. Any thread and any signal handler may call it. */
void symrig_rig_stop(symrig_rig* rig);

typedef struct symrig_capture_progress {
  const char* stage; /* such as "level 3"; valid during the call */
  int64_t done;      /* photographs taken */
  int64_t expected;  /* photographs expected by the end of the stage; 0: not known */
} symrig_capture_progress;

/* Called at the beginning, after photographs, and while the computer works on them, by the thread that
 * captures. Return 0 to continue, another value to stop. */
typedef int (*symrig_on_capture)(const symrig_capture_progress* progress, void* user);

/* Measures the light transport of the scene in front of a rig, as `symrig capture` does.
 *
 * output: scene.h5 to write; null: the tensor is only given out, and there is no log. Until the scene is
 * written, output.log keeps the photographs. A later call with the option resume=on continues from them.
 *
 * options: pairs key=value with blanks or line feeds between them, such as "tolerance=0.01 max_patterns=500".
 * Null or "": the defaults. They are a text because a text has no layout: later versions add keys, and
 * programs stay valid. What is left out has the algorithm's own default, so no value must stand for "none".
 *
 *   algorithm=NAME        symrig, paper, dual, brute
 *   tolerance=X           share of the flood-lit RMS; a smaller one needs more patterns
 *   max_patterns=N        stop after this many photographs
 *   max_seconds=S         stop after this many seconds on the rig's clock
 *   target_error=E        stop when the estimated error plus its uncertainty is below this share
 *   photograph_seconds=S  longest total exposure of one photograph, if exposures are planned
 *   polish=N              most steps of the final refit
 *   split=ORDER           order of several views
 *   dual_threshold=X      of the algorithm dual
 *   dual_subtracts=on     of the algorithm dual
 *   check_axis=on         first check with 8 photographs that camera and projector pixels coincide
 *   unchecked=on          do not ask whether the first photographs contradict their patterns
 *   log=off               keep no log
 *   resume=on             continue an interrupted capture from its log, if there is one
 *   keep_log=on           do not delete the log at the end
 *   cells=on              leave out the camera's own pixels (docs/file-format.md, Camera pixels)
 *   fit_seconds=S         most computing seconds for these; with too few, the log stays for a later call
 *
 * on_progress may be null. tensor may be null if output is not.
 * fails: bad_argument (options; a log is in the way; the rig is in use), unknown_name, interrupted (the log
 * keeps the photographs), limit, bad_value, bad_format (the log of another capture), io, errors of devices,
 * and what measure() returned. */
int symrig_capture(symrig_rig* rig, const char* output, const char* options, symrig_on_capture on_progress,
                   void* user, symrig_tensor** tensor, symrig_error* error);

/* The errors of a tensor against a rig, as JSON: "rig", "error" and "error_uncertainty" of
 * `symrig evaluate --json`, and "error_ideal" of a bench. A simulated rig that was opened by its name tells
 * its true transport; any other rig takes new photographs. on_progress (it may be null) is called as by
 * symrig_capture().
 * fails: size_mismatch (the rig of another scene), bad_argument (the rig is in use), interrupted, and as
 * symrig_rig_measure(). */
int symrig_rig_errors(symrig_rig* rig, const symrig_tensor* tensor, symrig_on_capture on_progress, void* user,
                      char** json, symrig_error* error);

#ifdef __cplusplus
}
#endif
/* NOLINTEND(modernize-use-using,modernize-deprecated-headers) */

#endif
