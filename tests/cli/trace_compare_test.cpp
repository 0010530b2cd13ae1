// SPDX-License-Identifier: Apache-2.0
// symrig trace --compare: the plan against the file of a logic analyser.
#include "command.hpp"

#include <cmath>
#include <cstdint>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace symrig::test::trace_compare_test {
namespace {

struct Sampled {
  double rate_mhz = 100;
  double ppm = 0;          ///< how much faster the analyser's clock counts
  double begin_us = 37.3;  ///< recorded before the first edge
  int lose_edge = -2;      ///< this edge of camera_trigger is not recorded, nor the next
  bool glitch = false;     ///< a pulse of one sample in the middle
};

class TraceCompare : public CommandTest {
 protected:
  static constexpr int kFault = 5;

  /// Bursts of 6 ticks (48 ns) on camera_trigger, each after a pulse of 1 us on lamp_enable.
  void write_program() const {
    write_text(path("burst.toml"), R"(symrig = 1
[rig.lines.camera_trigger]
role = "general"
[rig.lines.lamp_enable]
role = "general"
hazard = "benign"
[program]
steps = [
  { hold = "10 us" },
  { loop = 3, steps = [
    { mark = 1 },
    { pulse = "lamp_enable", width = "1 us" },
    { hold = "2 us" },
    { loop = 4, steps = [{ pulse = "camera_trigger", width = "48 ns" }, { hold = "48 ns" }] },
    { hold = "5 us" },
  ] },
]
)");
  }

  /// The planned edges of each line, in nanoseconds after the first, as an independent list.
  static std::map<std::string, std::vector<double>> plan() {
    std::map<std::string, std::vector<double>> edges;
    double at = 0;
    for (int round = 0; round < 3; ++round) {
      edges["lamp_enable"].push_back(at);
      edges["lamp_enable"].push_back(at + 1000);
      at += 3000;
      for (int k = 0; k < 4; ++k) {
        edges["camera_trigger"].push_back(at);
        edges["camera_trigger"].push_back(at + 48);
        at += 96;
      }
      at += 5000;
    }
    return edges;
  }

  /// A file as sigrok-cli writes it: samples at a rate, times in whole nanoseconds.
  void write_capture(const Sampled& how, const std::string& names = "lamp_enable camera_trigger") const {
    const double period = 1e3 / how.rate_mhz;
    std::map<std::uint64_t, std::string> changes;
    const auto put = [&](double ns, char id, bool level) {
      const double own = (how.begin_us * 1e3 + ns) * (1 + how.ppm * 1e-6);
      const double sample = std::ceil(own / period) * period;
      changes[static_cast<std::uint64_t>(std::llround(sample))] += std::string(level ? "1" : "0") + id + "\n";
    };
    auto edges = plan();
    for (std::size_t k = 0; k < edges["lamp_enable"].size(); ++k)
      put(edges["lamp_enable"][k], '!', k % 2 == 0);
    for (int k = 0; k < static_cast<int>(edges["camera_trigger"].size()); ++k)
      if (k != how.lose_edge && k != how.lose_edge + 1) put(edges["camera_trigger"][k], '"', k % 2 == 0);
    if (how.glitch) {
      put(6000, '"', true);
      put(6000 + period, '"', false);
    }
    std::istringstream words(names);
    std::string lamp;
    std::string camera;
    words >> lamp >> camera;
    std::ostringstream text;
    text << "$date Tue Nov 24 16:00:00 2026 $end\n$version libsigrok 0.5.2 $end\n$comment\n  Acquisition "
            "with 2/8 "
            "channels at "
         << how.rate_mhz << " MHz\n$end\n$timescale 1 ns $end\n$scope module libsigrok $end\n$var wire 1 ! "
         << lamp << " $end\n$var wire 1 \" " << camera
         << " $end\n$upscope $end\n$enddefinitions $end\n#0 0! 0\"\n";
    for (const auto& [time, values] : changes) text << '#' << time << "\n" << values;
    write_text(path("capture.vcd"), text.str());
  }
};

TEST_F(TraceCompare, an_analyser_that_saw_the_plan_agrees) {
  write_program();
  write_capture({.ppm = 60});
  const Outcome seen = symrig({"trace", "burst.toml", "--compare", "capture.vcd", "--differences", "d.csv"});
  ASSERT_EQ(seen.code, 0) << seen.err << seen.out;
  EXPECT_NE(seen.out.find("30 edges of camera_trigger, lamp_enable paired: 0 missing, 0 unplanned, 0 before"),
            std::string::npos)
      << seen.out;
  EXPECT_NE(seen.out.find("allowed 18 ns"), std::string::npos) << seen.out;  // a sample of 10 ns and a tick
  const std::string csv = read_text(path("d.csv"));
  EXPECT_TRUE(csv.starts_with("line,level,planned_ns,seen_ns,difference_ns\nlamp_enable,1,0.000,")) << csv;
}

TEST_F(TraceCompare, channels_have_other_names) {
  write_program();
  write_capture({}, "D0 D1");
  expect_refusal({"trace", "burst.toml", "--compare", "capture.vcd"}, kBadInput,
                 {"no channel", "D0, D1", "--channel"});
  const Outcome seen = symrig({"trace", "burst.toml", "--compare", "capture.vcd", "--channel",
                               "lamp_enable=D0", "--channel", "camera_trigger=D1"});
  EXPECT_EQ(seen.code, 0) << seen.err;
  const Outcome one =
      symrig({"trace", "burst.toml", "--compare", "capture.vcd", "--channel", "camera_trigger=D1"});
  EXPECT_EQ(one.code, 0) << one.err;
  EXPECT_NE(one.out.find("no channel shows it: lamp_enable"), std::string::npos) << one.out;
  expect_refusal({"trace", "burst.toml", "--compare", "capture.vcd", "--channel", "lamp_enable=D7"}, kUsage,
                 {"no channel 'D7'"});
  expect_refusal({"trace", "burst.toml", "--compare", "capture.vcd", "--channel", "lamp=D0"}, kUsage,
                 {"no line 'lamp'"});
  expect_refusal({"trace", "burst.toml", "--compare", "capture.vcd", "--channel", "D0"}, kUsage,
                 {"LINE=CHANNEL"});
  expect_refusal({"trace", "burst.toml", "--channel", "lamp_enable=D0"}, kUsage, {"--channel", "--compare"});
}

TEST_F(TraceCompare, a_lost_pulse_and_a_glitch_are_found) {
  write_program();
  write_capture({.lose_edge = 22});
  Outcome seen = symrig({"trace", "burst.toml", "--compare", "capture.vcd"});
  EXPECT_EQ(seen.code, kFault) << seen.out;
  EXPECT_NE(seen.err.find("2 edges missing, 0 unplanned"), std::string::npos) << seen.err;
  write_capture({.glitch = true});
  seen = symrig({"trace", "burst.toml", "--compare", "capture.vcd"});
  EXPECT_EQ(seen.code, kFault) << seen.out;
  EXPECT_NE(seen.err.find("0 edges missing, 2 unplanned"), std::string::npos) << seen.err;
}

TEST_F(TraceCompare, files_that_are_none_are_refused_with_their_line) {
  write_program();
  for (const auto& [text, word] : std::map<std::string, std::string>{
           {"hello world\n", "no wire of one bit"},
           {"$var wire 1 ! D0 $end\n#5\n7!\n", "a value is not 0, 1, x or z"},
           {"$timescale nonsense $end\n", "$timescale is no time"},
           {"$timescale 1 ns $end\n$enddefinitions $end\n#0\n", "no wire of one bit"},
           {"$var wire 1 ! D0 $end\n#5\n1!\n#4\n0!\n", "time goes back"},
           {"$var wire 1 ! D0 $end\n#x\n", "a time is no number"},
       }) {
    write_text(path("capture.vcd"), text);
    expect_refusal({"trace", "burst.toml", "--compare", "capture.vcd"}, kBadInput,
                   {"capture.vcd: line", word});
  }
  expect_refusal({"trace", "burst.toml", "--compare", "none.vcd"}, kBadInput, {"none.vcd"});
}

TEST_F(TraceCompare, the_plan_of_a_receipt_serves_too) {
  write_program();
  ASSERT_EQ(symrig({"run", "burst.toml", "--device", "sim:", "-o", "receipt.json"}).code, 0);
  write_capture({});
  const Outcome seen = symrig({"trace", "receipt.json", "--compare", "capture.vcd"});
  EXPECT_EQ(seen.code, 0) << seen.err << seen.out;
}

}  // namespace
}  // namespace symrig::test::trace_compare_test
