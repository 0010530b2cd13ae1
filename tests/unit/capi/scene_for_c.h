// SPDX-License-Identifier: Apache-2.0
#ifndef SCENE_FOR_C_H
#define SCENE_FOR_C_H

#ifdef __cplusplus
extern "C" {
#endif

/* Captures a small simulated scene (9 x 11) into `path`; photograph: what the C++ interface says of it under
 * `pattern`, 99 values each. 0: done. */
int make_scene(const char* path, const float* pattern, float* photograph);

#ifdef __cplusplus
}
#endif

#endif
