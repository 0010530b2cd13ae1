// SPDX-License-Identifier: GPL-2.0
/* The camera's video node and its controls. Controls only store their values; the injector applies exposure
 * and gain. */
#include "camera.h"

#include <linux/module.h>
#include <linux/slab.h>
#include <media/v4l2-ioctl.h>

#define AUTO_EXPOSURE_MENU (BIT(V4L2_EXPOSURE_MANUAL) | BIT(V4L2_EXPOSURE_APERTURE_PRIORITY))

static int set_control(struct v4l2_ctrl* control) {
  return 0;
}

static const struct v4l2_ctrl_ops control_operations = {.s_ctrl = set_control};

static const char* const trigger_modes[] = {"Free Run", "External Edge", "External Level", NULL};

static const struct v4l2_ctrl_config trigger_mode = {
    .ops = &control_operations,
    .id = TESTCAM_CID_TRIGGER_MODE,
    .name = "Trigger Mode",
    .type = V4L2_CTRL_TYPE_MENU,
    .max = 2,
    .qmenu = trigger_modes,
};

/* The defaults of a new webcam: automatic, and running free. */
static int add_controls(struct camera* camera) {
  struct v4l2_ctrl_handler* controls = &camera->controls;

  v4l2_ctrl_handler_init(controls, 4);
  camera->auto_exposure = v4l2_ctrl_new_std_menu(controls, &control_operations, V4L2_CID_EXPOSURE_AUTO,
                                                 V4L2_EXPOSURE_APERTURE_PRIORITY, ~AUTO_EXPOSURE_MENU,
                                                 V4L2_EXPOSURE_APERTURE_PRIORITY);
  camera->exposure =
      v4l2_ctrl_new_std(controls, &control_operations, V4L2_CID_EXPOSURE_ABSOLUTE, 1, 10000, 1, 156);
  camera->gain = v4l2_ctrl_new_std(controls, &control_operations, V4L2_CID_GAIN, 100, 1600, 1, 100);
  camera->trigger = v4l2_ctrl_new_custom(controls, &trigger_mode, NULL);
  camera->device.ctrl_handler = controls;
  return controls->error;
}

/* The last user has closed the unregistered node. */
static void release(struct v4l2_device* device) {
  struct camera* camera = container_of(device, struct camera, device);

  v4l2_ctrl_handler_free(&camera->controls);
  v4l2_device_unregister(device);
  kfree(camera);
}

static const struct v4l2_file_operations file_operations = {
    .owner = THIS_MODULE,
    .open = v4l2_fh_open,
    .release = vb2_fop_release,
    .unlocked_ioctl = video_ioctl2,
    .mmap = vb2_fop_mmap,
    .poll = vb2_fop_poll,
};

static void init_node(struct camera* camera) {
  struct video_device* node = &camera->node;

  strscpy(node->name, "testcam", sizeof(node->name));
  node->v4l2_dev = &camera->device;
  node->fops = &file_operations;
  node->ioctl_ops = &camera_ioctls;
  node->release = video_device_release_empty;
  node->queue = &camera->queue;
  node->lock = &camera->lock;
  node->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  video_set_drvdata(node, camera);
}

int camera_register(struct camera* camera) {
  int error;

  mutex_init(&camera->lock);
  mutex_init(&camera->inject);
  spin_lock_init(&camera->queued_lock);
  INIT_LIST_HEAD(&camera->queued);
  camera->interval = (struct v4l2_fract){1, 60};
  camera->format = (struct v4l2_pix_format){.width = 640, .height = 480, .pixelformat = V4L2_PIX_FMT_GREY};
  camera_fit_format(camera, &camera->format);
  strscpy(camera->device.name, "testcam", sizeof(camera->device.name));
  error = v4l2_device_register(NULL, &camera->device);
  if (error) {
    kfree(camera);
    return error;
  }
  camera->device.release = release;
  error = add_controls(camera);
  if (!error) error = camera_init_queue(camera);
  if (!error) {
    init_node(camera);
    error = video_register_device(&camera->node, VFL_TYPE_VIDEO, -1);
  }
  if (error) v4l2_device_put(&camera->device);
  return error;
}

void camera_unregister(struct camera* camera) {
  v4l2_device_disconnect(&camera->device);
  vb2_video_unregister_device(&camera->node);
  v4l2_device_put(&camera->device);
}
