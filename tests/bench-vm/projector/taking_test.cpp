// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/projector/expected_screens.hpp"

#include <csignal>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

namespace symrig::bench_vm::taking_test {
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

// The screen is restored: afterwards it shows what it showed before (the kernel's console).

class Restore : public ::testing::TestWithParam<std::pair<const char*, bool>> {};

TEST_P(Restore, the_console_comes_back_in_its_mode) {
  const GuestDisplay display = display_of(GetParam().first);
  const auto before = read_screen(display.card);
  ASSERT_TRUE(before.ok()) << before.error().line();
  DrmProjectorOptions options;
  options.connector = display.connector;
  options.mode = "640x480@60";
  options.legacy = GetParam().second;
  {
    const auto projector = open_projector(options);
    ASSERT_TRUE(projector);
    const auto during = read_screen(display.card);
    ASSERT_TRUE(during.ok()) << during.error().line();
    EXPECT_EQ(during->cols, 640);
    EXPECT_EQ(differing_pixels(*during, expected_screen(Pattern(projector->grid()), {}, projector->screen())),
              0U)
        << "black until the first pattern";
  }
  const auto after = read_screen(display.card);
  ASSERT_TRUE(after.ok()) << after.error().line();
  EXPECT_EQ(after->framebuffer, before->framebuffer);
  EXPECT_EQ(after->cols, before->cols);
  EXPECT_EQ(after->rows, before->rows);
}

INSTANTIATE_TEST_SUITE_P(All, Restore,
                         ::testing::Values(std::pair("BENCH_VKMS", false), std::pair("BENCH_VKMS", true),
                                           std::pair("BENCH_VGA", false), std::pair("BENCH_VGA", true)));

// AddressSanitizer finds leaks in each cycle; without it fewer cycles are enough.
#ifdef __SANITIZE_ADDRESS__
constexpr int kCycles = 200;
#else
constexpr int kCycles = 40;
#endif

class Unplug : public ::testing::Test {
 protected:
  Unplug() {
    options.connector = display.connector;
    options.mode = "640x480@60";
  }
  std::unique_ptr<DrmProjector> open() {
    auto projector = open_projector(options);
    if (projector) {
      const auto loaded = projector->load(
          std::vector<Pattern>{Pattern(projector->grid(), 1, 1.F), Pattern(projector->grid())});
      EXPECT_TRUE(loaded.ok());
    }
    return projector;
  }

  GuestDisplay display = display_of("BENCH_VKMS");
  DrmProjectorOptions options;
};

TEST_F(Unplug, is_told_by_name_each_time_and_the_projector_opens_again) {
  const GuestPlug plug(display.connector);
  open().reset();  // libdrm keeps some objects of the first cycle; they do not count
  const std::size_t files = open_files();
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    options.legacy = cycle % 2 == 1;
    const auto projector = open();
    ASSERT_TRUE(projector) << "cycle " << cycle;
    for (const std::size_t k : {0, 1}) ASSERT_TRUE(projector->show(k).ok()) << "cycle " << cycle;
    plug.out();
    const auto lost = projector->show(0);
    ASSERT_FALSE(lost.ok()) << "cycle " << cycle;
    EXPECT_EQ(lost.error().code, ErrorCode::device_lost);
    EXPECT_NE(lost.error().what.find(display.connector), std::string::npos) << lost.error().line();
    const auto absent = DrmProjector::open(options);
    ASSERT_FALSE(absent.ok());
    EXPECT_EQ(absent.error().code, ErrorCode::device_lost) << absent.error().line();
    plug.in();
    EXPECT_FALSE(projector->show(0).ok()) << "it must be opened anew";
  }
  EXPECT_EQ(open_files(), files);
}

TEST_F(Unplug, at_any_moment_is_told) {
  const GuestPlug plug(display.connector);
  for (int cycle = 0; cycle < 20; ++cycle) {
    const auto projector = open();
    ASSERT_TRUE(projector) << "cycle " << cycle;
    std::thread hand([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(3 + 7 * cycle));
      plug.out();
    });
    Result<Shown> shown = Shown{};
    for (std::size_t k = 0; shown && k < 10'000; ++k) shown = projector->show(k % 2);
    hand.join();
    ASSERT_FALSE(shown.ok());
    EXPECT_EQ(shown.error().code, ErrorCode::device_lost) << shown.error().line();
    plug.in();
  }
}

}  // namespace
}  // namespace symrig::bench_vm::taking_test
