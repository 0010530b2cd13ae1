// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"

#include <algorithm>
#include <csignal>

namespace symrig::test::bench_test {
namespace {

using Bench = CommandTest;

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t n = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
  return n;
}

const std::vector<std::string> kSmallBench{
    "bench",   "--scenes", "plane,vgroove-white", "--size",    "16x16",      "--seeds", "1",
    "--noise", "off",      "--tolerances",        "3e-3,3e-4", "--no-memory"};

std::vector<std::string> with(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// The seconds of a bench are those of the machine; everything else is the same every time.
nlohmann::json without_seconds(nlohmann::json bench) {
  for (nlohmann::json& one : bench.at("captures")) one.erase("seconds");
  return bench;
}

// Two scenes; paper, symrig, dual at two tolerances and brute force once: fourteen captures.
TEST_F(Bench, writes_the_table_four_ways) {
  const Outcome outcome = symrig(with(kSmallBench, {"-o", "b.html", "--json", "b.json", "--csv", "b.csv"}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(files(), (std::set<std::string>{"b.csv", "b.html", "b.json"}));
  EXPECT_EQ(count(outcome.out, "16x16 "), 14U) << outcome.out;
  EXPECT_EQ(count(outcome.out, "geometric means over 2 pairs"), 1U);
  EXPECT_EQ(count(read_text(path("b.csv")), "\n"), 15U);
  EXPECT_EQ(count(read_text(path("b.html")), "role=\"img\""), 18U);
  const nlohmann::json j = json("b.json");
  EXPECT_EQ(j.at("complete"), true);
  ASSERT_EQ(j.at("captures").size(), 14U);
  EXPECT_EQ(j.at("summary").at(0).at("pairs").size(), 2U);
}

// What the bench says of a capture is what `capture` and `evaluate` say.
TEST_F(Bench, a_capture_is_that_of_the_capture_command) {
  ASSERT_EQ(symrig({"bench", "--scenes", "vgroove-white", "--size", "16x16", "--seeds", "2", "--algorithms",
                    "dual,symrig", "--tolerances", "1e-3", "--no-memory", "--json", "b.json"})
                .code,
            0);
  const std::string rig = "sim:vgroove-white?size=16x16&seed=2";
  for (const char* algorithm : {"dual", "symrig"}) {
    ASSERT_EQ(symrig({"capture", "--rig", rig, "-o", "s.h5", "--algorithm", algorithm, "--tolerance", "1e-3",
                      "--json", "c.json"})
                  .code,
              0);
    ASSERT_EQ(symrig({"evaluate", "s.h5", "--rig", rig, "--json", "e.json"}).code, 0);
    const nlohmann::json all = json("b.json").at("captures");
    const auto same = std::find_if(all.begin(), all.end(), [&](const nlohmann::json& one) {
      return one.at("algorithm") == algorithm && one.at("seed") == 2;
    });
    ASSERT_NE(same, all.end());
    for (const char* key : {"patterns", "frames", "tensor_bytes"})
      EXPECT_EQ(same->at(key), json("c.json").at(key)) << algorithm << key;
    // The command asks for fewer photographs at once; each run of the board ends on a tick of 8 ns.
    EXPECT_NEAR(same->at("rig_seconds").get<double>(), json("c.json").at("rig_seconds").get<double>(), 1e-5);
    EXPECT_EQ(same->at("error"), json("e.json").at("error")) << algorithm;
  }
}

// Without noise the photographs do not depend on exposures. So patterns and errors are those of the other
// rig, and only the time differs.
TEST_F(Bench, runs_every_capture_on_each_rig) {
  const Outcome outcome = symrig({"bench", "--scenes", "random", "--size", "16x16", "--seeds", "1", "--noise",
                                  "off", "--algorithms", "symrig", "--tolerances", "1e-3", "--no-memory",
                                  "--profiles", "screen60,video", "--json", "b.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const nlohmann::json captures = json("b.json").at("captures");
  ASSERT_EQ(captures.size(), 2U);
  EXPECT_EQ(captures[0].at("profile"), "screen60");
  EXPECT_EQ(captures[1].at("profile"), "video");
  EXPECT_EQ(captures[0].at("patterns"), captures[1].at("patterns"));
  EXPECT_GT(captures[0].at("rig_seconds").get<double>(), captures[1].at("rig_seconds").get<double>());
  for (const nlohmann::json& one : captures) {
    double sum = 0;
    for (const nlohmann::json& part : one.at("rig_time")) sum += part.get<double>();
    EXPECT_NEAR(sum, one.at("rig_seconds").get<double>(), 1e-6);
  }
}

TEST_F(Bench, refuses_an_unknown_rig) {
  const Outcome outcome = symrig({"bench", "--profiles", "cinema"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(count(outcome.err, "cinema"), 1U) << outcome.err;
}

TEST_F(Bench, is_the_same_every_time) {
  ASSERT_EQ(symrig(with(kSmallBench, {"--json", "a.json"})).code, 0);
  ASSERT_EQ(symrig(with(kSmallBench, {"--json", "b.json"})).code, 0);
  EXPECT_EQ(without_seconds(json("a.json")), without_seconds(json("b.json")));
}

TEST_F(Bench, tolerances_can_be_given_to_one_algorithm) {
  const Outcome outcome = symrig({"bench", "--scenes", "plane", "--size", "8x8,9x7", "--size", "8x8",
                                  "--seeds", "1", "--algorithms", "paper,symrig", "--tolerances",
                                  "paper:3e-4", "--tolerances", "1e-2,1e-3", "--no-memory", "--json", "-"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const nlohmann::json j = nlohmann::json::parse(outcome.out);  // nothing but the JSON
  ASSERT_EQ(j.at("captures").size(), 6U);
  EXPECT_EQ(j.at("captures").at(0).at("tolerance"), 3e-4);
  EXPECT_EQ(j.at("captures").at(0).at("preset"), true);
  EXPECT_EQ(j.at("captures").at(1).at("tolerance"), 1e-2);
  EXPECT_EQ(j.at("plan").at("sizes"), nlohmann::json::array({{8, 8}, {9, 7}}));
}

TEST_F(Bench, wrong_arguments_are_one_line) {
  expect_refusal({"bench", "--scenes", "plane,gumy"}, kUsage, {"gumy", "gummy"});
  expect_refusal({"bench", "--size", "8by8"}, kUsage, {"8by8"});
  expect_refusal({"bench", "--size", "0x8"}, kUsage, {"0x8"});
  expect_refusal({"bench", "--seeds", "0"}, kUsage, {"--seeds", "0"});
  expect_refusal({"bench", "--seeds", "few"}, kUsage, {"few"});
  expect_refusal({"bench", "--noise", "loud"}, kUsage, {"loud"});
  expect_refusal({"bench", "--channels", "2"}, kUsage, {"channels", "2"});
  expect_refusal({"bench", "--algorithms", "magic"}, kUsage, {"magic", "paper"});
  expect_refusal({"bench", "--tolerances", "1e-3,much"}, kUsage, {"--tolerances", "much"});
  expect_refusal({"bench", "--tolerances", "1e-3,"}, kUsage, {"--tolerances", "''"});
  expect_refusal({"bench", "--tolerances", "2"}, kUsage, {"--tolerances", "2"});
  expect_refusal({"bench", "--tolerances", "magic:1e-3"}, kUsage, {"magic"});
  expect_refusal({"bench", "--json", "-", "--csv", "-"}, kUsage, {"--json", "--csv"});
  expect_refusal({"bench", "gummy"}, kUsage, {"gummy"});
}

TEST_F(Bench, places_that_cannot_be_written_are_refused_first) {
  for (const char* option : {"-o", "--json", "--csv"})
    expect_refusal({"bench", "--size", "400x400", option, "missing/file"}, kBadInput, {"missing/file"});
}

TEST_F(Bench, control_c_writes_what_is_done_and_says_so) {
  Running bench(path(""), {"bench", "--scenes", "plane,gummy", "--size", "8x8", "--size", "256x256",
                           "--seeds", "9", "--algorithms", "paper", "--json", "b.json", "-o", "b.html"});
  ASSERT_TRUE(bench.works(SIGINT, 0.5));
  bench.signal(SIGINT);
  const Outcome outcome = bench.wait();
  EXPECT_EQ(outcome.code, kFault);
  EXPECT_NE(outcome.err.find("stopped after"), std::string::npos) << outcome.err;
  EXPECT_EQ(count(outcome.err, "\n"), 1U) << outcome.err;
  const nlohmann::json j = json("b.json");
  EXPECT_EQ(j.at("complete"), false);
  EXPECT_LT(j.at("captures").size(), j.at("captures_planned").get<std::size_t>());
  EXPECT_EQ(count(read_text(path("b.html")), "Incomplete"), 1U);
}

}  // namespace
}  // namespace symrig::test::bench_test
