// SPDX-License-Identifier: GPL-2.0
/* The module: at most one camera, which can be unplugged and plugged in again. */
#include "camera.h"

#include <linux/miscdevice.h>
#include <linux/module.h>
#include <linux/rwsem.h>
#include <linux/slab.h>

static bool stamp_of_start = true;
module_param(stamp_of_start, bool, 0644);
MODULE_PARM_DESC(stamp_of_start,
                 "stamps are of the start of the exposure (1) or of its end (0); read at each plug");

static uint padding;
module_param(padding, uint, 0644);
MODULE_PARM_DESC(padding, "bytes between two lines of a frame, 0 to 256; read at each plug");

static DECLARE_RWSEM(plug);
static struct camera* current_camera; /* NULL: unplugged */

struct camera* camera_get(void) {
  down_read(&plug);
  if (!current_camera) up_read(&plug);
  return current_camera;
}

void camera_put(void) {
  up_read(&plug);
}

int camera_plug(void) {
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

int camera_unplug(void) {
  struct camera* camera;

  down_write(&plug);
  camera = current_camera;
  current_camera = NULL;
  if (camera) camera_unregister(camera);
  up_write(&plug);
  return camera ? 0 : -ENODEV;
}

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
