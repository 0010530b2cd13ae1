// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "symrig/acquisition/algorithms.hpp"
#include "symrig/base/memory.hpp"
#include "symrig/image/file.hpp"
#include "symrig/job/capture_job.hpp"
#include "symrig/tensor/file.hpp"

#include <memory>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace symrig::test::capture_test {
namespace {

using Capture = CommandTest;

TEST_F(Capture, writes_a_scene_and_the_promised_keys) {
  const Outcome outcome = symrig({"capture", "--rig", kSmall, "-o", "scene.h5", "--json", "capture.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");  // quiet where nobody watches
  EXPECT_NE(outcome.out.find("scene.h5"), std::string::npos);
  EXPECT_EQ(files(), (std::set<std::string>{"capture.json", "scene.h5"}));
  const nlohmann::json j = json("capture.json");
  EXPECT_EQ(j.at("scene"), kSmall);
  EXPECT_EQ(j.at("grid"), nlohmann::json::array({12, 17}));
  EXPECT_EQ(j.at("channels"), 1);
  EXPECT_EQ(j.at("algorithm"), "symrig");
  EXPECT_EQ(j.at("noise"), "off");
  EXPECT_EQ(j.at("patterns_brute_force"), 12 * 17);
  const auto per_level = j.at("patterns_per_level").get<std::vector<std::int64_t>>();
  EXPECT_EQ(per_level.at(0), 1 + 6);  // flood-lit, checks
  EXPECT_EQ(std::accumulate(per_level.begin(), per_level.end(), std::int64_t{0}), j.at("patterns"));
  // Exposures are planned, and without noise one is enough.
  EXPECT_GE(j.at("frames").get<std::int64_t>(), j.at("patterns").get<std::int64_t>());
  EXPECT_LT(j.at("frames").get<std::int64_t>(), 2 * j.at("patterns").get<std::int64_t>());
  for (const char* kind : {"rank1", "lowrank", "empty", "scalar"})
    EXPECT_EQ(j.at("leaves_per_level").at(kind).size(), 6U) << kind;  // 17 → 9, 5, 3, 2, 1: five halvings
  EXPECT_GT(j.at("tensor_bytes").get<std::int64_t>(), 0);
  EXPECT_EQ(j.at("dense_bytes"), 4.0 * 204 * 204);
  EXPECT_GT(j.at("rig_seconds").get<double>(), 0);
  EXPECT_GT(j.at("peak_memory_bytes").get<std::int64_t>(), 0);
  const nlohmann::json& seconds = j.at("seconds");
  for (const char* key : {"measure", "process", "total", "merge"})
    EXPECT_GE(seconds.at(key).get<double>(), 0) << key;
  EXPECT_LE(seconds.at("measure").get<double>() + seconds.at("process").get<double>(),
            seconds.at("total").get<double>());
}

TEST_F(Capture, the_scene_file_remembers_how_it_was_made) {
  ASSERT_EQ(symrig({"capture", "--rig", kSmall, "-o", "scene.h5", "--json", "capture.json"}).code, 0);
  const auto scene = load_scene(path("scene.h5"));
  ASSERT_TRUE(scene.ok());
  EXPECT_EQ(nlohmann::json::parse(scene->capture_json), json("capture.json"));
}

TEST_F(Capture, json_on_standard_output_is_all_there_is) {
  const Outcome outcome = symrig({"capture", "--rig", kSmall, "-o", "scene.h5", "--json", "-"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out).at("command"), "capture");
}

TEST_F(Capture, every_algorithm_and_every_channel_count_works) {
  for (const std::string_view name : algorithm_names())
    for (const char* channels : {"", "&channels=3"}) {
      const std::string algorithm(name);
      const Outcome outcome = symrig({"capture", "--rig", std::string(kSmall) + channels, "-o", "scene.h5",
                                      "--algorithm", algorithm, "--json", "capture.json"});
      ASSERT_EQ(outcome.code, 0) << outcome.err;
      EXPECT_EQ(json("capture.json").at("algorithm"), algorithm);
      EXPECT_EQ(json("capture.json").at("channels"), *channels == '\0' ? 1 : 3);
    }
}

TEST_F(Capture, a_looser_tolerance_takes_fewer_patterns) {
  const auto patterns = [&](const char* tolerance) {
    EXPECT_EQ(
        symrig({"capture", "--rig", kSmall, "-o", "scene.h5", "--tolerance", tolerance, "--json", "t.json"})
            .code,
        0);
    return json("t.json").at("patterns").get<std::int64_t>();
  };
  EXPECT_LT(patterns("0.3"), patterns("1e-5"));
}

TEST_F(Capture, replaces_an_old_file_whole) {
  write_text(path("scene.h5"), "not a scene");
  capture_small();
  EXPECT_TRUE(load_scene(path("scene.h5")).ok());
}

TEST_F(Capture, says_that_it_replaces_the_scene_of_another_rig) {
  capture_small();
  EXPECT_EQ(symrig({"capture", "--rig", kSmall, "-o", "scene.h5"}).out.find("replaced"), std::string::npos);
  const Outcome other = symrig({"capture", "--rig", "sim:plane?size=8x8", "-o", "scene.h5"});
  EXPECT_NE(other.out.find(std::string("scene.h5 held a scene of ") + kSmall + ", which this one replaced\n"),
            std::string::npos)
      << other.out;
}

TEST_F(Capture, wrong_rigs_are_usage_errors) {
  expect_refusal({"capture", "--rig", "sim:vgroove-texture", "-o", "a.h5"}, kUsage,
                 {"vgroove-texture", "vgroove-textured"});
  expect_refusal({"capture", "--rig", "sim:plane?sise=8x8", "-o", "a.h5"}, kUsage, {"sise", "size"});
  expect_refusal({"capture", "--rig", "sim:plane?size=8by8", "-o", "a.h5"}, kUsage, {"8by8"});
  expect_refusal({"capture", "--rig", "sim:plane?channels=2", "-o", "a.h5"}, kUsage, {"channels", "2"});
  expect_refusal({"capture", "--rig", "sim:plane?noise=loud", "-o", "a.h5"}, kUsage, {"noise", "loud"});
  expect_refusal({"capture", "--rig", "vgroove-textured", "-o", "a.h5"}, kUsage,
                 {"vgroove-textured", "sim:"});
}

TEST_F(Capture, a_rig_file_without_a_version_is_refused) {
  write_text(path("rig.toml"), "[board]\n");
  expect_refusal({"capture", "--rig", "rig.toml", "-o", "a.h5"}, kBadInput, {"rig.toml:1", "symrig = 1"});
}

TEST_F(Capture, wrong_settings_are_usage_errors) {
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--algorithm", "magic"}, kUsage,
                 {"magic", "paper"});
  for (const char* value : {"0", "-1", "1", "nan", "inf"})
    for (const char* option : {"--tolerance", "--dual-threshold"})
      expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", std::string(option) + "=" + value}, kUsage,
                     {option});
}

TEST_F(Capture, a_misaligned_rig_is_told_before_the_capture_is_wasted) {
  const std::string rig = "sim:vgroove-textured?size=64x64";
  expect_refusal({"capture", "--rig", rig + "&misalign=0.1", "--check-axis", "-o", "a.h5"}, kBadInput,
                 {"--check-axis"});
  // Without a log there is nothing to go on from, and nothing was checked before.
  expect_refusal({"capture", "--rig", rig + "&misalign=0.1", "--check-axis", "--resume", "-o", "a.h5"},
                 kBadInput, {"--check-axis"});
  EXPECT_EQ(symrig({"capture", "--rig", rig, "--check-axis", "--max-patterns", "20", "-o", "b.h5"}).code, 0);
}

// Nine views of 4x4 pixels have no blocks to share: the search would take more photographs than brute force.
TEST_F(Capture, transport_that_is_not_data_sparse_is_told) {
  const Outcome outcome =
      symrig({"capture", "--rig", "sim:views3?size=12x12", "-o", "a.h5", "--json", "a.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("the transport is not data-sparse: "), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("brute force measured the rest after "), std::string::npos) << outcome.out;
  const nlohmann::json told = json("a.json");
  EXPECT_LE(told.at("patterns"), told.at("patterns_brute_force"));
  const nlohmann::json& found = told.at("search").at("undetermined");
  EXPECT_EQ(found.at("completed"), true);
  EXPECT_EQ(found.at("brute_force"), 144);
  EXPECT_GT(found.at("forecast"), 144);
  for (const char* key : {"level", "patterns", "tested", "leaves", "unexplained"})
    EXPECT_TRUE(found.at("levels").at(1).contains(key)) << key;
  const Outcome sparse =
      symrig({"capture", "--rig", "sim:gummy?size=16x16", "-o", "b.h5", "--json", "b.json"});
  EXPECT_TRUE(json("b.json").at("search").at("undetermined").is_null());
  EXPECT_EQ(sparse.out.find("data-sparse"), std::string::npos) << sparse.out;
}

TEST_F(Capture, baselines_say_when_they_take_more_photographs_than_brute_force) {
  const Outcome paper =
      symrig({"capture", "--rig", "sim:views3?size=12x12", "-o", "a.h5", "--algorithm", "paper"});
  EXPECT_NE(paper.out.find("photographs more than brute force needs"), std::string::npos) << paper.out;
}

TEST_F(Capture, wrong_budgets_splits_and_steps_are_usage_errors) {
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--split", "sideways"}, kUsage, {"sideways"});
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--polish=-1"}, kUsage, {"--polish"});
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--polish=21"}, kUsage, {"--polish"});
}

// Checked before the first photograph: a long capture must not end in a message about its folder.
TEST_F(Capture, places_that_cannot_be_written_are_refused_first) {
  const std::string endless = "sim:gummy?size=400x400";
  std::filesystem::create_directory(path("folder"));
  write_text(path("file"), "");
  expect_refusal({"capture", "--rig", endless, "-o", "missing/a.h5"}, kBadInput, {"missing/a.h5", "folder"});
  expect_refusal({"capture", "--rig", endless, "-o", "a.h5", "--json", "missing/a.json"}, kBadInput,
                 {"missing/a.json"});
  expect_refusal({"capture", "--rig", endless, "-o", "folder"}, kBadInput, {"folder"});
  expect_refusal({"capture", "--rig", endless, "-o", "file/a.h5"}, kBadInput, {"file/a.h5"});
}

// /proc takes no new files, not even from root.
TEST_F(Capture, a_folder_that_takes_no_files_is_an_input_error) {
  expect_refusal({"capture", "--rig", kSmall, "-o", "/proc/a.h5"}, kBadInput, {"/proc/a.h5"});
}

// --memory: results do not depend on it. What a capture takes, and what it gives back.

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
}  // namespace symrig::test::capture_test
