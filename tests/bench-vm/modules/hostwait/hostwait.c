// SPDX-License-Identifier: GPL-2.0
/* For guests whose idle time passes at once (lane b). While a task waits for a shared folder's answer, which
 * takes time of the host, the idle processor polls. Then virtual time passes by the few instructions of that
 * loop. Without it, the guest's next timer would end the idle time at once, and the one after it: a second of
 * a busy host became a minute, and time-outs of a minute ended. */
#include <linux/kprobes.h>
#include <linux/module.h>

static bool on = true;
module_param(on, bool, 0644);
MODULE_PARM_DESC(on, "waits that begin now are no idle time");

/* What waits, in 9pnet and 9pnet_virtio: a request with its answer, and one whose data is not copied. */
static const char* const waits[] = {"p9_client_rpc", "p9_virtio_zc_request"};
/* More tasks than these do not wait at once in a guest. If they did, they would only not be seen. */
#define MOST_WAITING 64

/* Of the kernel: counts who wants the idle loop to poll. It is not exported, so its address is asked for. */
static void (*poll_when_idle)(bool enable);

/* `on` may change while a task waits. */
struct counted {
  bool yes;
};

static int begin(struct kretprobe_instance* wait, struct pt_regs* registers) {
  struct counted* counted = (struct counted*)wait->data;
  counted->yes = on;
  if (counted->yes) poll_when_idle(true);
  return 0;
}

static int end(struct kretprobe_instance* wait, struct pt_regs* registers) {
  const struct counted* counted = (const struct counted*)wait->data;
  if (counted->yes) poll_when_idle(false);
  return 0;
}

static struct kretprobe probes[ARRAY_SIZE(waits)];

static int find_poll_when_idle(void) {
  struct kprobe probe = {.symbol_name = "cpu_idle_poll_ctrl"};
  const int error = register_kprobe(&probe);
  if (error) return error;
  poll_when_idle = (void (*)(bool))probe.addr;
  unregister_kprobe(&probe);
  return 0;
}

/* It stays for as long as the guest runs: a task that waits would keep the idle loop polling. */
static int __init hostwait_init(void) {
  int error = find_poll_when_idle();
  int k;
  if (error) return error;
  for (k = 0; k < ARRAY_SIZE(waits); ++k) {
    probes[k].kp.symbol_name = waits[k];
    probes[k].entry_handler = begin;
    probes[k].handler = end;
    probes[k].data_size = sizeof(struct counted);
    probes[k].maxactive = MOST_WAITING;
    error = register_kretprobe(&probes[k]);
    if (error) goto undo;
  }
  return 0;
undo:
  while (k-- > 0) unregister_kretprobe(&probes[k]);
  return error;
}

module_init(hostwait_init);
MODULE_DESCRIPTION("Time of the host does not become idle time of the guest");
MODULE_LICENSE("GPL");
