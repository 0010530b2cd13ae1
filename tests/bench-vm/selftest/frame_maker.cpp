// SPDX-License-Identifier: Apache-2.0
// Feeds the test camera for as long as it runs: noise-free frames of whatever format somebody streams, as
// fast as buffers come.
#include "bench-vm/selftest/guest.hpp"
#include "bench-vm/selftest/testcam_client.hpp"

namespace {
constexpr std::int64_t kPause = 2'000'000;  // ns, between two looks whether a buffer waits
}

int main() {
  const symrig::bench_vm::Injector injector;
  std::vector<std::byte> pixels;
  for (;;) {
    const testcam_state state = injector.state();
    pixels.resize(state.sizeimage, std::byte{0x55});
    if (state.streaming == 0 || state.queued == 0 || injector.frame({}, pixels) != 0)
      symrig::bench_vm::sleep_until(symrig::bench_vm::now_ns() + kPause);
  }
}
