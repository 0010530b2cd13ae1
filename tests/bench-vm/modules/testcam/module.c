// SPDX-License-Identifier: GPL-2.0
/* The module: at most one camera, which can be unplugged and plugged in again; its video node; and the device
 * whose writer makes its frames. */
#include "camera.h"

#include <linux/fs.h>
#include <linux/miscdevice.h>
#include <linux/module.h>
#include <linux/rwsem.h>
#include <linux/slab.h>
#include <linux/uaccess.h>
#include <media/v4l2-ioctl.h>

/* The camera's video node and its controls. Controls only store their values; the injector applies exposure
 * and gain. */

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

/* Frees the camera if it fails; after it, camera_unregister() does. */
static int camera_register(struct camera* camera) {
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

static void camera_unregister(struct camera* camera) {
  v4l2_device_disconnect(&camera->device);
  vb2_video_unregister_device(&camera->node);
  v4l2_device_put(&camera->device);
}

static bool stamp_of_start = true;
module_param(stamp_of_start, bool, 0644);
MODULE_PARM_DESC(stamp_of_start,
                 "stamps are of the start of the exposure (1) or of its end (0); read at each plug");

static uint padding;
module_param(padding, uint, 0644);
MODULE_PARM_DESC(padding, "bytes between two lines of a frame, 0 to 256; read at each plug");

static DECLARE_RWSEM(plug);
static struct camera* current_camera; /* NULL: unplugged */

/* The camera that is plugged in, or NULL; it stays plugged in until camera_put(). */
static struct camera* camera_get(void) {
  down_read(&plug);
  if (!current_camera) up_read(&plug);
  return current_camera;
}

static void camera_put(void) {
  up_read(&plug);
}

static int camera_plug(void) {
  struct camera* camera;
  int error = -EBUSY;

  down_write(&plug);
  if (current_camera) goto done;
  error = -ENOMEM;
  camera = kzalloc(sizeof(*camera), GFP_KERNEL);
  if (!camera) goto done;
  camera->stamp_is_start = stamp_of_start;
  camera->padding = min(padding, 256u);
  error = camera_register(camera);
  if (!error) current_camera = camera;
done:
  up_write(&plug);
  return error;
}

static int camera_unplug(void) {
  struct camera* camera;

  down_write(&plug);
  camera = current_camera;
  current_camera = NULL;
  if (camera) camera_unregister(camera);
  up_write(&plug);
  return camera ? 0 : -ENODEV;
}

/* /dev/testcam-inject: write() sends frames, ioctl() reads the camera's settings, plugs and unplugs. See
 * testcam.h. */

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

static struct miscdevice inject_device = {
    .minor = MISC_DYNAMIC_MINOR,
    .name = "testcam-inject",
    .fops = &inject_operations,
};

static int __init testcam_init(void) {
  int error = camera_plug();

  if (error) return error;
  error = misc_register(&inject_device);
  if (error) camera_unplug();
  return error;
}

static void __exit testcam_exit(void) {
  misc_deregister(&inject_device);
  camera_unplug();
}

module_init(testcam_init);
module_exit(testcam_exit);
MODULE_LICENSE("GPL");
MODULE_DESCRIPTION("Test camera whose frames are written by a process");
