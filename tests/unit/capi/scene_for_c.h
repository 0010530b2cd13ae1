// SPDX-License-Identifier: Apache-2.0
#ifndef SCENE_FOR_C_H
#define SCENE_FOR_C_H

#ifdef __cplusplus
extern "C" {
#endif

/* Captures a small simulated scene (9 x 11) into `path`; photograph: what the C++ interface says of it under
 * `pattern`, 99 values each. 0: done. */
int make_scene(const char* path, const float* pattern, float* photograph);

/* That scene in colour, with a camera of 3 x 5 pixels and the filters GRBG. pattern: 99 values. photograph: 3
 * x 5 x 3 values of the C++ interface. filters: 1 in the colour that a pixel sees, and 0; 3 x 5 x 3 values.
 * 0: done. */
int make_camera_scene(const char* path, const float* pattern, float* photograph, float* filters);

#ifdef __cplusplus
}
#endif

#endif
