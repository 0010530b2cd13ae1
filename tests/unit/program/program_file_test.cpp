// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/time.hpp"
#include "workshop.hpp"

#include <utility>
#include <vector>

namespace symrig::program_file_test {
namespace {

using namespace std::chrono_literals;

TEST(Duration, is_exact_to_the_nanosecond_halves_up) {
  const std::vector<std::pair<const char*, Nanoseconds>> good{
      {"14.26 us", 14'260ns}, {"1.5ms", 1'500'000ns},          {"2 s", 2s},
      {"0 ns", 0ns},          {"16.666667 ms", 16'666'667ns},  {"0.4 ns", 0ns},
      {"0.5 ns", 1ns},        {"1.0000004 ms", 1'000'000ns},   {"1.0000005 ms", 1'000'001ns},
      {"3 µs", 3us},          {"9000000000 s", 9'000'000'000s}};
  for (const auto& [text, value] : good) EXPECT_EQ(base::parse_duration(text), value) << text;
  for (const char* text : {"", "ms", "1", "1 m", "-1 ms", "1. ms", ".5 ms", "1e3 ms", "1 ms ", " 1 ms",
                           "1,5 ms", "10000000000 s", "99999999999999999999 ns"})
    EXPECT_FALSE(base::parse_duration(text).has_value()) << text;
}

constexpr const char* kScan = "symrig = 1\n[program]\npatterns = 2\nbracket = [\"1 ms\"]\n";

TEST(ProgramFile, a_short_one_has_defaults_for_everything_else) {
  const ProgramFile file = test::parse(kScan);
  ASSERT_TRUE(file.scan.has_value());
  EXPECT_EQ(file.scan->pattern_count(), 2U);
  EXPECT_EQ(file.scan->bracket, std::vector<Nanoseconds>{1ms});
  EXPECT_EQ(file.rig.camera.name, "generic-strobed");
  EXPECT_EQ(file.rig.projector.name, "hdmi-60");
  ASSERT_NE(file.rig.with_role(RigRole::camera), nullptr);
  EXPECT_EQ(file.rig.with_role(RigRole::camera)->config.line, "camera_trigger");
  EXPECT_EQ(file.rig.keep_alive, 1s);
}

TEST(ProgramFile, lines_have_polarity_delay_and_limits) {
  const ProgramFile file = test::parse(
      "symrig = 1\n[rig.lines.lamp_enable]\nrole = \"lamp\"\nactive = \"low\"\ndelay = \"40 ns\"\n"
      "max_on = \"10 ms\"\nmin_off = \"1 ms\"\nmax_duty = 0.5\ncapture = false\n"
      "[rig.lines.vsync]\nrole = \"interlock\"\ntrip = \"low\"\n"
      "[program]\nsteps = [{ hold = \"1 ms\" }]\n");
  const RigLine* lamp = file.rig.find("lamp_enable");
  ASSERT_NE(lamp, nullptr);
  EXPECT_TRUE(lamp->active_low);
  EXPECT_TRUE(lamp->config.safe_level);  // off is high
  EXPECT_EQ(lamp->delay, 40ns);
  EXPECT_EQ(lamp->config.max_on, 10ms);
  EXPECT_EQ(lamp->config.min_off, 1ms);
  EXPECT_EQ(lamp->config.max_duty, 0.5);
  EXPECT_EQ(lamp->config.hazard, Hazard::lamp);
  EXPECT_EQ(lamp->place, 2);
  ASSERT_TRUE(file.rig.find("vsync")->config.trip_level.has_value());
  EXPECT_FALSE(*file.rig.find("vsync")->config.trip_level);
}

TEST(ProgramFile, a_series_of_exposures) {
  const ProgramFile file = test::parse(
      "symrig = 1\n[program]\npatterns = 1\nbracket = { shortest = \"100 us\", ratio = 2.5, count = 4 }\n");
  EXPECT_EQ(file.scan->bracket, (std::vector<Nanoseconds>{100us, 250us, 625us, 1562500ns}));
}

TEST(ProgramFile, loops_take_2_to_the_32_rounds_and_no_more) {
  const auto text = [](const std::string& rounds) {
    return "symrig = 1\n[program]\nsteps = [{ loop = " + rounds + ", steps = [{ hold = \"1 ms\" }] }]\n";
  };
  EXPECT_EQ(test::parse(text("4294967296")).steps.at(0).count, kMaxRounds);
  EXPECT_FALSE(parse_program_file(text("4294967297"), "scan.toml", "").ok());
  EXPECT_FALSE(parse_program_file(text("0"), "scan.toml", "").ok());
}

/// What is wrong, at which line, and words of the message.
struct Fault {
  const char* text;
  int line;
  std::vector<const char*> words;
};

TEST(ProgramFile, faults_name_the_line_the_key_and_what_is_legal) {
  const std::vector<Fault> faults{
      {"symrig = 1\n[program]\npatterns = 2\n", 2, {"program.bracket is missing", "shortest"}},
      {"symrig = 1\n", 1, {"program is missing"}},
      {"symrig = 1\n[program]\npatterns = 2\nbracket = [\"1 ms\"]\nsettel = \"1 ms\"\n",
       5,
       {"no key program.settel", "settle"}},
      {"symrig = 1\n[rig]\ncamera = \"kodak\"\n[program]\npatterns = 2\nbracket = [\"1 ms\"]\n",
       3,
       {"rig.camera", "kodak", "basler-trigger-width"}},
      {"symrig = 1\n[program]\npatterns = 0\nbracket = [\"1 ms\"]\n", 3, {"program.patterns", "1 to"}},
      {"symrig = 1\n[program]\npatterns = 2\nbracket = [\"1 ms\", 3]\n", 4, {"not a duration"}},
      {"symrig = 1\n[program]\npatterns = 2\nbracket = { shortest = \"1 ms\", ratio = 1, count = 2 }\n",
       4,
       {"ratio", "above 1"}},
      {"symrig = 1\n[program]\npatterns = 2\nbracket = [\"1 ms\"]\norder = \"both\"\n",
       5,
       {R"("pattern-outer", "bracket-outer")"}},
      {"symrig = 1\n[program]\nsteps = [\n  { hold = \"1 ms\", mark = 3 },\n]\n", 4, {"more than one thing"}},
      {"symrig = 1\n[program]\nsteps = [\n  { wait = \"vsync\" },\n]\n", 4, {"timeout is missing"}},
      {"symrig = 1\n[program]\nsteps = [{ hold = \"1 ms\" }]\npatterns = 2\n",
       3,
       {"either steps, or patterns"}},
      {"symrig = 1\n[rig.lines.vsync]\nrole = \"interlock\"\n[program]\nsteps = [{ hold = \"1 ms\" }]\n",
       2,
       {"trip is missing"}},
      {"symrig = 1\n[rig.lines.lamp_enable]\nmax_duty = 2\n[program]\nsteps = [{ hold = \"1 ms\" }]\n",
       3,
       {"max_duty", "0.001 to 1"}},
      {"symrig = 1\n[program\n", 2, {"TOML"}}};
  for (const Fault& fault : faults) {
    const auto file = parse_program_file(fault.text, "scan.toml", "");
    ASSERT_FALSE(file.ok()) << fault.text;
    EXPECT_EQ(file.error().code, ErrorCode::bad_format);
    const std::string line = file.error().line();
    EXPECT_EQ(line.rfind("scan.toml:" + std::to_string(fault.line) + ":", 0), 0U) << line;
    for (const char* word : fault.words) EXPECT_NE(line.find(word), std::string::npos) << line;
  }
}

// Nothing that a file may hold makes the reader fall: every prefix of a real one, and every one-byte change
// of it.
TEST(ProgramFile, damaged_files_are_read_or_refused) {
  const std::string text =
      "symrig = 1\n[rig.camera]\nprofile = \"generic-strobed\"\n[rig.lines.lamp_enable]\nrole = \"lamp\"\n"
      "[program]\npatterns = [{ count = 3, bits = 8 }]\nbracket = { shortest = \"1 ms\", ratio = 2, count = "
      "3 }\n"
      "start_marker = { line = \"projector_trigger\", stretch = \"1 us\" }\n";
  std::size_t refused = 0;
  for (std::size_t k = 0; k <= text.size(); ++k)
    refused += parse_program_file(text.substr(0, k), "scan.toml", "").ok() ? 0U : 1U;
  for (std::size_t k = 0; k < text.size(); ++k) {
    std::string changed = text;
    changed[k] = static_cast<char>(changed[k] ^ 0x15);
    refused += parse_program_file(changed, "scan.toml", "").ok() ? 0U : 1U;
  }
  EXPECT_GT(refused, text.size());
}

}  // namespace
}  // namespace symrig::program_file_test
