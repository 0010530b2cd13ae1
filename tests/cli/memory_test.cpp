// SPDX-License-Identifier: Apache-2.0
// --memory: results do not depend on it. What a capture takes, and what it gives back.
#include "symrig/base/memory.hpp"

#include "command.hpp"
#include "symrig/image/file.hpp"
#include "symrig/job/capture_job.hpp"
#include "symrig/tensor/file.hpp"

#include <memory>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace symrig::test::memory_test {
namespace {

class Memory : public CommandTest {
 protected:
  /// The tensor of a capture with these options.
  TransportTensor captured(const std::vector<std::string>& options) {
    std::vector<std::string> words{"capture", "--rig", "sim:vgroove-textured?size=96x80&channels=3", "-o",
                                   "scene.h5"};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome outcome = symrig(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return std::move(load_scene(path("scene.h5")).value().tensor);
  }
};

// With the least memory that is allowed, all large data are in scratch files: numbers of levels, leaves and
// photographs.
TEST_F(Memory, a_capture_is_the_same_in_little_memory) {
  const std::string least = std::to_string(least_memory({96, 80}, 3));
  const TransportTensor free = captured({});
  const TransportTensor tight = captured({"--memory", least});
  EXPECT_EQ(*tight.factors(), *free.factors());
  EXPECT_EQ(tight.scalar_values(), free.scalar_values());
  ASSERT_EQ(tight.leaves().size(), free.leaves().size());
  for (std::size_t k = 0; k < free.leaves().size(); ++k)
    EXPECT_EQ(tight.leaves()[k].row_begin, free.leaves()[k].row_begin);
  EXPECT_EQ(files(), std::set<std::string>{"scene.h5"}) << "a scratch file is left";
}

// What is said before a capture begins: within a factor of 1.5, as memory_wanted() promises.
TEST_F(Memory, what_a_capture_wants_is_about_what_it_takes) {
  for (const int side : {96, 192}) {
    const std::string rig = fmt::format("sim:vgroove-textured?size={0}x{0}", side);
    const Outcome outcome = symrig({"capture", "--rig", rig, "-o", "scene.h5", "--json", "capture.json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto taken = json("capture.json")["peak_memory_bytes"].get<double>();
    const auto wanted = static_cast<double>(memory_wanted(*settings_of({}), {side, side}, 1));
    EXPECT_GT(wanted, taken / 1.5) << side;
    EXPECT_LT(wanted, taken * 1.5) << side;
  }
}

#ifndef __SANITIZE_ADDRESS__  // its allocator keeps what was freed on purpose

// Blocks between others that stay: malloc cannot give them back by itself. Both have one size, so that what
// earlier tests left free takes as many of one kind as of the other.
TEST(FreedMemory, is_given_back_from_between_other_blocks) {
  constexpr std::size_t kBlock = std::size_t{64} << 10, kBlocks = 4096;  // 256 MiB
  std::vector<std::unique_ptr<std::vector<char>>> freed, kept;
  for (std::size_t k = 0; k < kBlocks; ++k) {
    freed.push_back(std::make_unique<std::vector<char>>(kBlock, 'a'));
    kept.push_back(std::make_unique<std::vector<char>>(kBlock, 'b'));
  }
  const std::int64_t before = resident_memory();
  freed.clear();
  give_back_freed_memory();
  // Of each block, the pages that it does not share with its neighbours: all but two of sixteen.
  EXPECT_LE(resident_memory(), before - static_cast<std::int64_t>(kBlocks * kBlock * 14 / 16));
  EXPECT_EQ(kept.back()->back(), 'b');
}

#endif

TEST_F(Memory, too_little_is_refused_with_what_is_needed) {
  expect_refusal({"capture", "--rig", kSmall, "-o", "scene.h5", "--memory", "1M"}, kFault,
                 {"memory of 1M is too little for photographs of 12x17", "allow ", "M or more"});
}

TEST_F(Memory, a_size_that_is_none_is_named) {
  for (const char* wrong : {"4GB", "0", "-1", "much", "1.5G"}) {
    const Outcome outcome = symrig({"inspect", "scene.h5", std::string("--memory=") + wrong});
    EXPECT_EQ(outcome.code, kUsage) << wrong;
    EXPECT_NE(outcome.err.find(fmt::format("--memory: '{}' is no size of memory", wrong)), std::string::npos)
        << outcome.err;
  }
}

// A tensor that stays in its file gives the same pictures, numbers and pages.
TEST_F(Memory, a_scene_is_the_same_in_little_memory) {
  capture_small(fmt::format("{}&channels=3", kSmall));
  for (const char* command : {"relight", "dual"}) {
    ASSERT_EQ(symrig({command, "scene.h5", "--light", "natural", "-o", "free.pfm"}).code, 0);
    ASSERT_EQ(symrig({command, "scene.h5", "--light", "natural", "-o", "tight.pfm", "--memory", "1"}).code,
              0);
    EXPECT_EQ(read_image(path("tight.pfm")).value(), read_image(path("free.pfm")).value()) << command;
  }
  const std::string rig = fmt::format("{}&channels=3", kSmall);
  ASSERT_EQ(symrig({"evaluate", "scene.h5", "--rig", rig, "--json", "free.json"}).code, 0);
  ASSERT_EQ(symrig({"evaluate", "scene.h5", "--rig", rig, "--json", "tight.json", "--memory", "1"}).code, 0);
  EXPECT_EQ(json("tight.json")["error"], json("free.json")["error"]);
  const Outcome inspected = symrig({"inspect", "scene.h5"});
  const Outcome tight = symrig({"inspect", "scene.h5", "--memory", "1"});
  ASSERT_EQ(tight.code, 0) << tight.err;
  EXPECT_EQ(tight.out.substr(tight.out.find("level")), inspected.out.substr(inspected.out.find("level")));
  EXPECT_EQ(symrig({"report", "scene.h5", "-o", "page.html", "--memory", "1"}).code, 0);
  EXPECT_EQ(symrig({"view", "scene.h5", "--export", "view.html", "--memory", "1"}).code, 0);
}

}  // namespace
}  // namespace symrig::test::memory_test
