// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/projector/expected_screens.hpp"

#include <csignal>

#include <sys/wait.h>
#include <unistd.h>

namespace symrig::bench_vm::holders_test {
namespace {

/// A child process that owns the display and shows white until it is killed.
class Holder {
 public:
  explicit Holder(const DrmProjectorOptions& options) {
    int ready[2] = {-1, -1};
    EXPECT_EQ(pipe(ready), 0);
    child_ = fork();
    if (child_ == 0) {
      const auto projector = DrmProjector::open(options);
      const bool shown =
          projector && (*projector)->load(std::vector<Pattern>{Pattern((*projector)->grid(), 1, 1.F)}).ok() &&
          (*projector)->show(0).ok();
      const char answer = shown ? 'y' : 'n';
      if (write(ready[1], &answer, 1) == 1) pause();
      _exit(1);
    }
    char answer = 'n';
    EXPECT_EQ(read(ready[0], &answer, 1), 1);
    EXPECT_EQ(answer, 'y');
    close(ready[0]);
    close(ready[1]);
  }
  Holder(const Holder&) = delete;
  Holder& operator=(const Holder&) = delete;
  ~Holder() { die(); }
  void die() {
    if (child_ < 0) return;
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
    child_ = -1;
  }
  pid_t pid() const { return child_; }

 private:
  pid_t child_ = -1;
};

class Holders : public ::testing::TestWithParam<const char*> {
 protected:
  Holders() { options.connector = display.connector; }
  GuestDisplay display = display_of(GetParam());
  DrmProjectorOptions options;
};

TEST_P(Holders, are_named_and_a_killed_one_leaves_the_screen_free) {
  for (int round = 0; round < 3; ++round) {
    Holder holder(options);
    const auto refused = DrmProjector::open(options);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::device_refused);
    EXPECT_NE(refused.error().what.find("bench_projector (" + std::to_string(holder.pid()) + ")"),
              std::string::npos)
        << refused.error().line();
    holder.die();
    const auto projector = open_projector(options);
    ASSERT_TRUE(projector);
  }
}

INSTANTIATE_TEST_SUITE_P(Vkms, Holders, ::testing::Values("BENCH_VKMS"));

}  // namespace
}  // namespace symrig::bench_vm::holders_test
