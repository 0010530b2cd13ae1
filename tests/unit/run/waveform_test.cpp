// SPDX-License-Identifier: Apache-2.0
#include "symrig/run/waveform.hpp"

#include "unit/program/workshop.hpp"

#include <set>
#include <sstream>

#include <nlohmann/json.hpp>

namespace symrig::waveform_test {
namespace {

Waveform two_lines(std::uint64_t hz) {
  return {"plan",
          {hz},
          Ticks{100},
          Ticks{400},
          0b10,
          {1, 2},
          {"camera_trigger", "lamp_enable"},
          {{1, false, Ticks{100}}, {2, true, Ticks{225}}, {1, true, Ticks{225}}, {2, false, Ticks{350}}}};
}

TEST(Vcd, is_the_text_written_down_here) {
  const std::vector<Waveform> one{two_lines(125'000'000)};
  EXPECT_EQ(vcd_text(one),
            "$version symrig $end\n"
            "$timescale 1 ns $end\n"
            "$scope module plan $end\n"
            "$var wire 1 ! camera_trigger $end\n"
            "$var wire 1 \" lamp_enable $end\n"
            "$upscope $end\n"
            "$enddefinitions $end\n"
            "#0\n"
            "$dumpvars\n"
            "1!\n"
            "0\"\n"
            "$end\n"
            "0!\n"
            "#1000\n"
            "1\"\n"
            "1!\n"
            "#2000\n"
            "0\"\n"
            "#2400\n");
}

TEST(Vcd, counts_in_picoseconds_where_a_tick_is_no_whole_nanosecond) {
  const std::vector<Waveform> one{two_lines(12'000'000)};  // 83.33 ns
  const std::string text = vcd_text(one);
  EXPECT_NE(text.find("$timescale 1 ps $end"), std::string::npos);
  EXPECT_NE(text.find("#10416667\n"), std::string::npos) << text;  // 125 ticks
  EXPECT_NE(text.find("#20833333\n"), std::string::npos) << text;  // 250 ticks
}

TEST(Vcd, scopes_share_the_time_axis) {
  std::vector<Waveform> both{two_lines(125'000'000), two_lines(125'000'000)};
  both[1].name = "actual";
  both[1].edges[1].tick = Ticks{226};
  const std::string text = vcd_text(both);
  EXPECT_NE(text.find("$scope module actual $end\n$var wire 1 # camera_trigger $end\n"), std::string::npos);
  EXPECT_NE(text.find("#1000\n1\"\n1!\n1#\n#1008\n1$\n#2000\n"), std::string::npos) << text;
}

TEST(Vcd, hundreds_of_signals_have_names_of_their_own) {
  Waveform many{"plan", {}, {}, Ticks{1}, 0, {}, {}, {}};
  for (int k = 0; k < 20; ++k) {
    many.lines.push_back(k);
    many.names.push_back("line" + std::to_string(k));
  }
  const std::vector<Waveform> scopes(10, many);
  const std::string text = vcd_text(scopes);
  std::set<std::string> codes;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);)
    if (line.rfind("$var", 0) == 0) codes.insert(line.substr(12, line.find(' ', 12) - 12));
  EXPECT_EQ(codes.size(), 200U);
}

TEST(WaveDrom, has_one_column_for_each_moment) {
  const std::vector<Waveform> one{two_lines(125'000'000)};
  const auto json = nlohmann::json::parse(wavedrom_text(one));
  const auto& signal = json.at("signal");
  EXPECT_EQ(signal.at(0).at("data"), nlohmann::json({"0 ns", "1 us", "2 us"}));
  EXPECT_EQ(signal.at(0).at("wave"), "===");
  EXPECT_EQ(signal.at(1).at(0), "plan");
  EXPECT_EQ(signal.at(1).at(1).at("name"), "camera_trigger");
  EXPECT_EQ(signal.at(1).at(1).at("wave"), "01.");
  EXPECT_EQ(signal.at(1).at(2).at("wave"), "010");
  EXPECT_FALSE(json.contains("foot"));
}

TEST(WaveDrom, says_what_it_leaves_out) {
  const std::vector<Waveform> one{two_lines(125'000'000)};
  const auto json = nlohmann::json::parse(wavedrom_text(one, 2));
  EXPECT_EQ(json.at("signal").at(1).at(2).at("wave"), "01");
  EXPECT_EQ(json.at("foot").at("text"), "the first 2 of 3 moments");
}

TEST(Waveform, of_a_plan_draws_the_lines_that_move) {
  const auto program = test::compiled(
      "symrig = 1\n[program]\nsteps = [{ pulse = \"lamp_enable\", width = \"1 us\" }, { hold = \"1 us\" "
      "}]\n");
  const Waveform drawn = waveform(*expand(program.program, program.board), program.board, "plan");
  EXPECT_EQ(drawn.names, std::vector<std::string>{"lamp_enable"});
  EXPECT_EQ(drawn.edges.size(), 2U);
  EXPECT_EQ(drawn.end, Ticks{250});
}

}  // namespace
}  // namespace symrig::waveform_test
