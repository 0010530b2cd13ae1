// SPDX-License-Identifier: GPL-2.0
/* Buffers and the frames that fill them. A frame without a buffer is lost, and so is its sequence number. */
#include "camera.h"

#include <linux/module.h>
#include <linux/uaccess.h>
#include <media/videobuf2-vmalloc.h>

struct buffer {
  struct vb2_v4l2_buffer vb; /* must be first, for vb2 */
  struct list_head link;
};

static int queue_setup(struct vb2_queue* queue, unsigned int* buffers, unsigned int* planes,
                       unsigned int sizes[], struct device* devices[]) {
  struct camera* camera = vb2_get_drv_priv(queue);

  if (*planes) return sizes[0] < camera->format.sizeimage ? -EINVAL : 0;
  *planes = 1;
  sizes[0] = camera->format.sizeimage;
  return 0;
}

static int buffer_prepare(struct vb2_buffer* vb) {
  struct camera* camera = vb2_get_drv_priv(vb->vb2_queue);

  if (vb2_plane_size(vb, 0) < camera->format.sizeimage) return -EINVAL;
  vb2_set_plane_payload(vb, 0, camera->format.sizeimage);
  return 0;
}

static void buffer_queue(struct vb2_buffer* vb) {
  struct camera* camera = vb2_get_drv_priv(vb->vb2_queue);
  struct buffer* buffer = container_of(to_vb2_v4l2_buffer(vb), struct buffer, vb);
  unsigned long flags;

  spin_lock_irqsave(&camera->queued_lock, flags);
  list_add_tail(&buffer->link, &camera->queued);
  camera->queued_count++;
  spin_unlock_irqrestore(&camera->queued_lock, flags);
}

/* The buffer that has waited longest, or NULL. */
static struct buffer* next_buffer(struct camera* camera) {
  struct buffer* buffer;
  unsigned long flags;

  spin_lock_irqsave(&camera->queued_lock, flags);
  buffer = list_first_entry_or_null(&camera->queued, struct buffer, link);
  if (buffer) {
    list_del(&buffer->link);
    camera->queued_count--;
  }
  spin_unlock_irqrestore(&camera->queued_lock, flags);
  return buffer;
}

static int start_streaming(struct vb2_queue* queue, unsigned int count) {
  struct camera* camera = vb2_get_drv_priv(queue);

  mutex_lock(&camera->inject);
  camera->sequence = 0;
  camera->lost = 0;
  camera->streaming = true;
  mutex_unlock(&camera->inject);
  return 0;
}

static void stop_streaming(struct vb2_queue* queue) {
  struct camera* camera = vb2_get_drv_priv(queue);
  struct buffer* buffer;

  mutex_lock(&camera->inject); /* whoever fills a buffer hands it in first */
  camera->streaming = false;
  while ((buffer = next_buffer(camera))) vb2_buffer_done(&buffer->vb.vb2_buf, VB2_BUF_STATE_ERROR);
  mutex_unlock(&camera->inject);
}

static const struct vb2_ops queue_operations = {
    .queue_setup = queue_setup,
    .buf_prepare = buffer_prepare,
    .buf_queue = buffer_queue,
    .start_streaming = start_streaming,
    .stop_streaming = stop_streaming,
    .wait_prepare = vb2_ops_wait_prepare,
    .wait_finish = vb2_ops_wait_finish,
};

int camera_init_queue(struct camera* camera) {
  struct vb2_queue* queue = &camera->queue;

  queue->type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  queue->io_modes = VB2_MMAP | VB2_USERPTR | VB2_DMABUF;
  queue->drv_priv = camera;
  queue->buf_struct_size = sizeof(struct buffer);
  queue->ops = &queue_operations;
  queue->mem_ops = &vb2_vmalloc_memops;
  queue->timestamp_flags =
      V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC |
      (camera->stamp_is_start ? V4L2_BUF_FLAG_TSTAMP_SRC_SOE : V4L2_BUF_FLAG_TSTAMP_SRC_EOF);
  queue->min_buffers_needed = 1;
  queue->lock = &camera->lock;
  return vb2_queue_init(queue);
}

/* In pieces: a large frame at once would keep the only processor from the board for a millisecond. */
static bool copy_pixels(char* to, const char __user* from, size_t size) {
  const size_t largest = 32768;

  while (size) {
    size_t piece = min(size, largest);

    if (copy_from_user(to, from, piece)) return false;
    to += piece;
    from += piece;
    size -= piece;
    cond_resched();
  }
  return true;
}

static int fill(struct camera* camera, struct buffer* buffer, const struct testcam_frame* frame,
                const void __user* pixels) {
  struct vb2_buffer* vb = &buffer->vb.vb2_buf;
  bool unreadable = !copy_pixels(vb2_plane_vaddr(vb, 0), pixels, camera->format.sizeimage);

  buffer->vb.sequence = camera->sequence;
  buffer->vb.field = V4L2_FIELD_NONE;
  vb->timestamp = frame->stamp_ns ? frame->stamp_ns : ktime_get_ns();
  vb2_buffer_done(vb,
                  unreadable || (frame->flags & TESTCAM_DAMAGED) ? VB2_BUF_STATE_ERROR : VB2_BUF_STATE_DONE);
  return unreadable ? -EFAULT : 0;
}

/* With camera->inject held. */
static int inject(struct camera* camera, const struct testcam_frame* frame, const void __user* pixels,
                  size_t size) {
  struct buffer* buffer;
  int error = 0;

  if (!camera->streaming) return -EPIPE;
  if (size != camera->format.sizeimage) return -EMSGSIZE;
  camera->sequence += frame->skip;
  buffer = next_buffer(camera);
  if (buffer)
    error = fill(camera, buffer, frame, pixels);
  else
    camera->lost++;
  camera->sequence++;
  return error;
}

int camera_inject(struct camera* camera, const struct testcam_frame* frame, const void __user* pixels,
                  size_t size) {
  int error;

  mutex_lock(&camera->inject);
  error = inject(camera, frame, pixels, size);
  mutex_unlock(&camera->inject);
  return error;
}
