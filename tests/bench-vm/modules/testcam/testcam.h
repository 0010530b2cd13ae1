// SPDX-License-Identifier: GPL-2.0 WITH Linux-syscall-note
/*
 * The test camera's interface for user space, in addition to V4L2. Data written to /dev/testcam-inject become
 * frames.
 *
 * One write() is one frame: a struct testcam_frame, then exactly sizeimage bytes of pixels in the present
 * format. It returns the number of bytes. It does so also for a frame that was lost because no buffer was
 * queued, as on a real camera. Errors: EMSGSIZE not one frame of the present format; EPIPE not streaming;
 * ENODEV the camera is unplugged.
 */
#ifndef SYMRIG_TESTCAM_H
#define SYMRIG_TESTCAM_H

#include <linux/ioctl.h>
#include <linux/types.h>

#define TESTCAM_DEVICE "/dev/testcam-inject"

struct testcam_frame {
  __u64 stamp_ns; /* CLOCK_MONOTONIC; of the start or the end of the exposure, as the module's parameter says;
                     0: now */
  __u32 skip;     /* sequence numbers to skip before this frame */
  __u32 flags;    /* TESTCAM_... */
};

#define TESTCAM_DAMAGED 1u /* the buffer is delivered with the error flag */

/* The control "Trigger Mode": a number of this driver alone, so look for the name. V4L2_CID_USER_BASE |
 * 0x1f00. */
#define TESTCAM_CID_TRIGGER_MODE 0x00981f00

/* The camera's present settings, for the process that makes its pictures. */
struct testcam_state {
  __u32 width, height; /* pixels */
  __u32 pixelformat;   /* V4L2_PIX_FMT_... */
  __u32 sizeimage;     /* bytes of one frame */
  __u32 streaming;     /* 1 between STREAMON and STREAMOFF */
  __u32 sequence;      /* of the next frame */
  __u32 queued;        /* buffers that wait for a frame */
  __u32 lost;          /* frames that found no buffer since STREAMON */
  __s32 exposure;      /* V4L2_CID_EXPOSURE_ABSOLUTE: units of 100 us */
  __s32 auto_exposure; /* V4L2_CID_EXPOSURE_AUTO */
  __s32 gain;          /* V4L2_CID_GAIN: hundredths, 100 is a factor of 1 */
  __s32 trigger; /* TESTCAM_CID_TRIGGER_MODE: 0 runs free, 1 one frame an edge, 2 exposes as long as the pulse
                  */
  __u32 plugged; /* 0: unplugged */
  __u32 stamp_is_start; /* 1: stamps are of the start of the exposure, 0: of its end */
};

#define TESTCAM_GET_STATE _IOR('T', 0xe0, struct testcam_state)
#define TESTCAM_UNPLUG _IO('T', 0xe1) /* removes the video node; a streaming process gets ENODEV */
#define TESTCAM_PLUG _IO('T', 0xe2)   /* adds it again, see below */
/*
 * The camera comes back with its default settings. It gets another number if a process still has its old node
 * open.
 */

#endif
