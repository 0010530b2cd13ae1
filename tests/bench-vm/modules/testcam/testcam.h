// SPDX-License-Identifier: GPL-2.0 WITH Linux-syscall-note
/*
 * The test camera as user space sees it beside V4L2: what is written to /dev/testcam-inject becomes frames.
 *
 * One write() is one frame: a struct testcam_frame and then exactly as many bytes of pixels as the format
 * that is set (sizeimage). It returns the number of bytes, also for a frame that was lost because no buffer
 * was queued, as on a real camera. Errors: EMSGSIZE not one frame of the format that is set; EPIPE nobody
 * streams; ENODEV the camera is unplugged.
 */
#ifndef SYMRIG_TESTCAM_H
#define SYMRIG_TESTCAM_H

#include <linux/ioctl.h>
#include <linux/types.h>

#define TESTCAM_DEVICE "/dev/testcam-inject"

struct testcam_frame {
  __u64 stamp_ns; /* CLOCK_MONOTONIC; of the start or the end of the exposure, as the module's parameter says;
                     0: now */
  __u32 skip;     /* so many sequence numbers are lost before this frame */
  __u32 flags;    /* TESTCAM_... */
};

#define TESTCAM_DAMAGED 1u /* the buffer is handed out marked as in error */

/* The control "Trigger Mode": a number of this driver alone, so look for the name. V4L2_CID_USER_BASE |
 * 0x1f00. */
#define TESTCAM_CID_TRIGGER_MODE 0x00981f00

/* What the camera is set to, for the process that makes its pictures. */
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
#define TESTCAM_UNPLUG _IO('T', 0xe1) /* the video node goes away, whoever streams gets ENODEV */
#define TESTCAM_PLUG _IO('T', 0xe2)   /* and comes back, see below */
/*
 * As a camera that had no power it comes back with its defaults, and as any camera under another number if
 * somebody still has its old node open.
 */

#endif
