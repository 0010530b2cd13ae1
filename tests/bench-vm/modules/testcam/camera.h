// SPDX-License-Identifier: GPL-2.0
/*
 * One test camera, from plug to the last close. After an unplug it exists as long as a process has its node
 * open.
 *
 * Locks, in the order of taking: plug (module.c) before lock before inject. queued_lock is innermost.
 */
#ifndef SYMRIG_TESTCAM_CAMERA_H
#define SYMRIG_TESTCAM_CAMERA_H

#include "testcam.h"

#include <linux/list.h>
#include <linux/mutex.h>
#include <linux/spinlock.h>
#include <media/v4l2-ctrls.h>
#include <media/v4l2-device.h>
#include <media/videobuf2-v4l2.h>

struct camera {
  struct v4l2_device device;
  struct video_device node;
  struct vb2_queue queue;
  struct mutex lock; /* every ioctl of the node, and the queue */

  struct v4l2_ctrl_handler controls;
  struct v4l2_ctrl *exposure, *auto_exposure, *gain, *trigger;
  struct v4l2_pix_format format; /* changes only while no buffers are allocated */
  struct v4l2_fract interval;
  bool stamp_is_start;
  unsigned int padding; /* bytes after each line */

  struct mutex inject; /* one frame at a time, and none while streaming stops */
  bool streaming;
  u32 sequence, lost;

  spinlock_t queued_lock;
  struct list_head queued; /* buffers that wait for a frame */
  u32 queued_count;
};

/* format.c */
extern const struct v4l2_ioctl_ops camera_ioctls;
void camera_fit_format(const struct camera* camera,
                       struct v4l2_pix_format* format); /* the nearest possible one */

/* stream.c */
int camera_init_queue(struct camera* camera);
int camera_inject(struct camera* camera, const struct testcam_frame* frame, const void __user* pixels,
                  size_t size);

#endif
