// SPDX-License-Identifier: GPL-2.0
/* Formats, sizes and frame rates that the camera offers, and the ioctls of its node. */
#include "camera.h"

#include <linux/module.h>
#include <media/v4l2-event.h>
#include <media/v4l2-ioctl.h>

#define MIN_SIZE 8
#define MAX_WIDTH 1920
#define MAX_HEIGHT 1200
#define STEP 2

static const struct {
  u32 fourcc;
  u32 bytes; /* of one pixel */
} formats[] = {
    {V4L2_PIX_FMT_GREY, 1},    {V4L2_PIX_FMT_Y10, 2},     {V4L2_PIX_FMT_Y12, 2},
    {V4L2_PIX_FMT_Y16, 2},     {V4L2_PIX_FMT_SBGGR8, 1},  {V4L2_PIX_FMT_SGBRG8, 1},
    {V4L2_PIX_FMT_SGRBG8, 1},  {V4L2_PIX_FMT_SRGGB8, 1},  {V4L2_PIX_FMT_SBGGR10, 2},
    {V4L2_PIX_FMT_SGBRG10, 2}, {V4L2_PIX_FMT_SGRBG10, 2}, {V4L2_PIX_FMT_SRGGB10, 2},
    {V4L2_PIX_FMT_SBGGR12, 2}, {V4L2_PIX_FMT_SGBRG12, 2}, {V4L2_PIX_FMT_SGRBG12, 2},
    {V4L2_PIX_FMT_SRGGB12, 2}, {V4L2_PIX_FMT_SBGGR16, 2}, {V4L2_PIX_FMT_SGBRG16, 2},
    {V4L2_PIX_FMT_SGRBG16, 2}, {V4L2_PIX_FMT_SRGGB16, 2}, {V4L2_PIX_FMT_YUYV, 2},
};

/* Frames come when they are written; the rate is what the camera claims. Seconds. */
static const struct v4l2_fract shortest = {1, 500}, longest = {10, 1};

static u32 bytes_of(u32 fourcc) {
  size_t i;

  for (i = 0; i < ARRAY_SIZE(formats); i++)
    if (formats[i].fourcc == fourcc) return formats[i].bytes;
  return 0;
}

void camera_fit_format(const struct camera* camera, struct v4l2_pix_format* format) {
  if (!bytes_of(format->pixelformat)) format->pixelformat = formats[0].fourcc;
  format->width = clamp_t(u32, round_down(format->width, STEP), MIN_SIZE, MAX_WIDTH);
  format->height = clamp_t(u32, round_down(format->height, STEP), MIN_SIZE, MAX_HEIGHT);
  format->bytesperline = format->width * bytes_of(format->pixelformat) + camera->padding;
  format->sizeimage = format->bytesperline * format->height;
  format->field = V4L2_FIELD_NONE;
  format->colorspace = format->pixelformat == V4L2_PIX_FMT_YUYV ? V4L2_COLORSPACE_SRGB : V4L2_COLORSPACE_RAW;
  format->priv = 0;
}

static int query_capabilities(struct file* file, void* handle, struct v4l2_capability* capability) {
  strscpy(capability->driver, "testcam", sizeof(capability->driver));
  strscpy(capability->card, "symrig test camera", sizeof(capability->card));
  strscpy(capability->bus_info, "platform:testcam", sizeof(capability->bus_info));
  return 0;
}

static int enumerate_formats(struct file* file, void* handle, struct v4l2_fmtdesc* description) {
  if (description->index >= ARRAY_SIZE(formats)) return -EINVAL;
  description->pixelformat = formats[description->index].fourcc;
  return 0;
}

static int enumerate_sizes(struct file* file, void* handle, struct v4l2_frmsizeenum* size) {
  if (size->index || !bytes_of(size->pixel_format)) return -EINVAL;
  size->type = V4L2_FRMSIZE_TYPE_STEPWISE;
  size->stepwise = (struct v4l2_frmsize_stepwise){MIN_SIZE, MAX_WIDTH, STEP, MIN_SIZE, MAX_HEIGHT, STEP};
  return 0;
}

static bool possible_size(u32 value, u32 most) {
  return value >= MIN_SIZE && value <= most && value % STEP == 0;
}

static int enumerate_intervals(struct file* file, void* handle, struct v4l2_frmivalenum* interval) {
  if (interval->index || !bytes_of(interval->pixel_format)) return -EINVAL;
  if (!possible_size(interval->width, MAX_WIDTH) || !possible_size(interval->height, MAX_HEIGHT))
    return -EINVAL;
  interval->type = V4L2_FRMIVAL_TYPE_CONTINUOUS;
  interval->stepwise.min = shortest;
  interval->stepwise.max = longest;
  interval->stepwise.step = (struct v4l2_fract){1, 1};
  return 0;
}

static int get_format(struct file* file, void* handle, struct v4l2_format* format) {
  struct camera* camera = video_drvdata(file);

  format->fmt.pix = camera->format;
  return 0;
}

static int try_format(struct file* file, void* handle, struct v4l2_format* format) {
  camera_fit_format(video_drvdata(file), &format->fmt.pix);
  return 0;
}

static int set_format(struct file* file, void* handle, struct v4l2_format* format) {
  struct camera* camera = video_drvdata(file);

  if (vb2_is_busy(&camera->queue)) return -EBUSY;
  camera_fit_format(camera, &format->fmt.pix);
  camera->format = format->fmt.pix;
  return 0;
}

static int enumerate_inputs(struct file* file, void* handle, struct v4l2_input* input) {
  if (input->index) return -EINVAL;
  input->type = V4L2_INPUT_TYPE_CAMERA;
  strscpy(input->name, "Camera 0", sizeof(input->name));
  return 0;
}

static int get_input(struct file* file, void* handle, unsigned int* input) {
  *input = 0;
  return 0;
}

static int set_input(struct file* file, void* handle, unsigned int input) {
  return input ? -EINVAL : 0;
}

static int get_interval(struct file* file, void* handle, struct v4l2_streamparm* parameters) {
  struct camera* camera = video_drvdata(file);
  struct v4l2_captureparm* capture = &parameters->parm.capture;

  if (parameters->type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return -EINVAL;
  memset(capture, 0, sizeof(*capture));
  capture->capability = V4L2_CAP_TIMEPERFRAME;
  capture->timeperframe = camera->interval;
  return 0;
}

static bool shorter(struct v4l2_fract a, struct v4l2_fract b) {
  return (u64)a.numerator * b.denominator < (u64)b.numerator * a.denominator;
}

static int set_interval(struct file* file, void* handle, struct v4l2_streamparm* parameters) {
  struct camera* camera = video_drvdata(file);
  struct v4l2_fract wanted = parameters->parm.capture.timeperframe;

  if (parameters->type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return -EINVAL;
  if (!wanted.numerator || !wanted.denominator) wanted = (struct v4l2_fract){1, 60};
  if (shorter(wanted, shortest)) wanted = shortest;
  if (shorter(longest, wanted)) wanted = longest;
  camera->interval = wanted;
  return get_interval(file, handle, parameters);
}

const struct v4l2_ioctl_ops camera_ioctls = {
    .vidioc_querycap = query_capabilities,
    .vidioc_enum_fmt_vid_cap = enumerate_formats,
    .vidioc_enum_framesizes = enumerate_sizes,
    .vidioc_enum_frameintervals = enumerate_intervals,
    .vidioc_g_fmt_vid_cap = get_format,
    .vidioc_try_fmt_vid_cap = try_format,
    .vidioc_s_fmt_vid_cap = set_format,
    .vidioc_enum_input = enumerate_inputs,
    .vidioc_g_input = get_input,
    .vidioc_s_input = set_input,
    .vidioc_g_parm = get_interval,
    .vidioc_s_parm = set_interval,
    .vidioc_reqbufs = vb2_ioctl_reqbufs,
    .vidioc_create_bufs = vb2_ioctl_create_bufs,
    .vidioc_prepare_buf = vb2_ioctl_prepare_buf,
    .vidioc_querybuf = vb2_ioctl_querybuf,
    .vidioc_qbuf = vb2_ioctl_qbuf,
    .vidioc_dqbuf = vb2_ioctl_dqbuf,
    .vidioc_expbuf = vb2_ioctl_expbuf,
    .vidioc_streamon = vb2_ioctl_streamon,
    .vidioc_streamoff = vb2_ioctl_streamoff,
    .vidioc_subscribe_event = v4l2_ctrl_subscribe_event,
    .vidioc_unsubscribe_event = v4l2_event_unsubscribe,
    .vidioc_log_status = v4l2_ctrl_log_status,
};
