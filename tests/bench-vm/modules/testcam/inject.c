// SPDX-License-Identifier: GPL-2.0
/* /dev/testcam-inject: write() sends frames, ioctl() reads the camera's settings, plugs and unplugs. See
 * testcam.h. */
#include "camera.h"

#include <linux/fs.h>
#include <linux/miscdevice.h>
#include <linux/module.h>
#include <linux/uaccess.h>

static ssize_t inject_write(struct file* file, const char __user* from, size_t size, loff_t* offset) {
  struct testcam_frame frame;
  struct camera* camera;
  int error;

  if (size < sizeof(frame)) return -EMSGSIZE;
  if (copy_from_user(&frame, from, sizeof(frame))) return -EFAULT;
  camera = camera_get();
  if (!camera) return -ENODEV;
  error = camera_inject(camera, &frame, from + sizeof(frame), size - sizeof(frame));
  camera_put();
  return error ? error : (ssize_t)size;
}

static void read_state(struct camera* camera, struct testcam_state* state) {
  unsigned long flags;

  mutex_lock(&camera->lock);
  mutex_lock(&camera->inject);
  state->width = camera->format.width;
  state->height = camera->format.height;
  state->pixelformat = camera->format.pixelformat;
  state->sizeimage = camera->format.sizeimage;
  state->streaming = camera->streaming;
  state->sequence = camera->sequence;
  state->lost = camera->lost;
  state->stamp_is_start = camera->stamp_is_start;
  spin_lock_irqsave(&camera->queued_lock, flags);
  state->queued = camera->queued_count;
  spin_unlock_irqrestore(&camera->queued_lock, flags);
  mutex_unlock(&camera->inject);
  mutex_unlock(&camera->lock);
  state->exposure = v4l2_ctrl_g_ctrl(camera->exposure);
  state->auto_exposure = v4l2_ctrl_g_ctrl(camera->auto_exposure);
  state->gain = v4l2_ctrl_g_ctrl(camera->gain);
  state->trigger = v4l2_ctrl_g_ctrl(camera->trigger);
  state->plugged = 1;
}

/* Unplugged: all zero. */
static long get_state(void __user* to) {
  struct testcam_state state = {};
  struct camera* camera = camera_get();

  if (camera) {
    read_state(camera, &state);
    camera_put();
  }
  return copy_to_user(to, &state, sizeof(state)) ? -EFAULT : 0;
}

static long inject_ioctl(struct file* file, unsigned int request, unsigned long argument) {
  switch (request) {
    case TESTCAM_GET_STATE:
      return get_state((void __user*)argument);
    case TESTCAM_UNPLUG:
      return camera_unplug();
    case TESTCAM_PLUG:
      return camera_plug();
    default:
      return -ENOTTY;
  }
}

static const struct file_operations inject_operations = {
    .owner = THIS_MODULE,
    .write = inject_write,
    .unlocked_ioctl = inject_ioctl,
    .llseek = noop_llseek,
};

struct miscdevice inject_device = {
    .minor = MISC_DYNAMIC_MINOR,
    .name = "testcam-inject",
    .fops = &inject_operations,
};
