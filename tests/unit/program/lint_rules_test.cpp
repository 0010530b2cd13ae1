// SPDX-License-Identifier: Apache-2.0
// Every rule of the linter has an example that breaks it and one that keeps it.
#include "workshop.hpp"

#include <set>
#include <vector>

namespace symrig::lint_rules_test {
namespace {

using namespace std::chrono_literals;

// The board's own rules come last, without examples: `symrig lint --explain` refers to the protocol.
TEST(LintRules, the_document_has_them_all_and_no_others) {
  std::set<std::string> known;
  bool own = false;
  for (const LintRule& rule : lint_rules()) {
    EXPECT_TRUE(known.insert(std::string(rule.name)).second) << rule.name << " stands there twice";
    EXPECT_FALSE(rule.about.empty());
    own = own || rule.explanation.empty();
    EXPECT_EQ(rule.explanation.empty(), own) << rule.name;
    EXPECT_EQ(rule.breaks == rule.keeps, own) << rule.name;
    EXPECT_EQ(rule.about.starts_with("board: "), own) << rule.name;
  }
  EXPECT_EQ(known.size(), 46U);
}

std::vector<std::string> rules_with_examples() {
  std::vector<std::string> names;
  for (const LintRule& rule : lint_rules())
    if (!rule.explanation.empty()) names.emplace_back(rule.name);
  return names;
}

class Rule : public ::testing::TestWithParam<std::string> {};

TEST_P(Rule, is_broken_by_its_example_and_kept_by_the_other) {
  const LintRule& rule = *std::ranges::find(lint_rules(), GetParam(), &LintRule::name);
  const FileFinding finding = test::finding_of(test::compile(rule.example(rule.breaks)), GetParam());
  ASSERT_EQ(finding.rule, GetParam()) << "not found";
  EXPECT_EQ(finding.severity, rule.severity);
  EXPECT_GT(finding.place, 0);
  EXPECT_FALSE(finding.what.empty());
  EXPECT_FALSE(finding.alternative.empty());
  const Compilation kept = test::compile(rule.example(rule.keeps));
  EXPECT_EQ(test::finding_of(kept, GetParam()).rule, "");
  std::string errors;
  for (const FileFinding& each : kept.findings)
    if (each.severity == Severity::error) errors += each.text("scan.toml") + "\n";
  EXPECT_EQ(errors, "");
}

INSTANTIATE_TEST_SUITE_P(All, Rule, ::testing::ValuesIn(rules_with_examples()), [](const auto& rule) {
  std::string name = rule.param;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
});

/// A file with one fault, and the finding that it must have: line, and the setting that mends it.
struct Mend {
  const char* head;  ///< before the setting
  const char* bad;   ///< the setting that is wrong
  const char* tail;
  const char* rule;
  int place;
};

// The alternative of a setting is legal when it is pasted in place of the setting.
TEST(LintRules, alternatives_can_be_pasted) {
  const std::vector<Mend> mends{
      {"symrig = 1\n[program]\npatterns = 8\nbracket = [\"1 ms\", \"4 ms\"]\n", "gap = \"1 ms\"", "\n",
       "camera.readout", 5},
      {"symrig = 1\n[program]\npatterns = 8\n", R"(bracket = ["3 us", "1 ms", "4 ms"])", "\n",
       "camera.min_exposure", 4},
      {"symrig = 1\n[program]\npatterns = 8\n", R"(bracket = ["1 ms", "4 ms", "4 ms"])", "\n",
       "bracket.duplicate", 4},
      {"symrig = 1\n[program]\npatterns = 8\nbits = 8\n", R"(bracket = ["10 ms", "40 ms"])", "\n",
       "projector.whole_refresh", 5},
      {"symrig = 1\n[rig]\nprojector = \"dlpc900\"\n[program]\npatterns = 8\nbracket = [\"1 ms\", \"4 "
       "ms\"]\n",
       "on_time = \"100 us\"", "\n", "projector.min_exposure", 7},
      {"symrig = 1\n[rig]\nprojector = \"dlpc900\"\n[program]\npatterns = 8\nbracket = [\"1 ms\", \"4 "
       "ms\"]\n",
       "on_time = \"9 ms\"", "\n", "projector.black_insertion", 7},
      {"symrig = 1\n[rig]\nprojector = \"dlpc900\"\n[program]\npatterns = 8\nbits = 8\n",
       "bracket = [\"1 ms\"]", "\n", "projector.whole_refresh", 7},
      {"symrig = 1\n[rig]\nprojector = \"lightcrafter-4500-video\"\n[rig.lines.camera_strobe]\nrole = "
       "\"plane\"\n[program]\npatterns = 1\n",
       "bracket = [\"1 ms\"]", "\n", "projector.planes", 8},
      {"symrig = 1\n[rig.projector]\nprofile = \"lightcrafter-4500-video\"\n", "plane_period = \"700 us\"",
       "\n[rig.lines.camera_strobe]\nrole = \"plane\"\n[program]\npatterns = 1\nbracket = [\"100 us\"]\n",
       "projector.planes", 2},
      {"symrig = 1\n[rig.camera]\nprofile = \"basler-trigger-width\"\n", "overlap_time_max = \"3 ms\"",
       "\n[program]\npatterns = 8\nbracket = [\"1 ms\", \"4 ms\"]\n", "camera.overlap", 2},
      {"symrig = 1\n[rig]\n", "keep_alive = \"0 s\"",
       "\n[rig.lines.lamp_enable]\nhazard = \"lamp\"\nmax_on = \"1 s\"\n[program]\npatterns = 8\nbracket = "
       "[\"1 ms\"]\n",
       "keep_alive.needed", 2},
      {"symrig = 1\n[rig]\n", "keep_alive = \"0 s\"",
       "\n[rig.lines.lamp_enable]\nhazard = \"laser\"\nmax_on = \"1 s\"\n[program]\npatterns = 8\nbracket = "
       "[\"1 ms\"]\n",
       "keep_alive.needed", 2},
      {"symrig = 1\n[rig.projector]\nprofile = \"hdmi-60\"\nsettle = \"2 ms\"\n[program]\npatterns = "
       "8\nbracket = [\"1 ms\"]\n",
       "settle = \"1 ms\"", "\n", "settle", 8}};
  for (const Mend& mend : mends) {
    const FileFinding finding =
        test::finding_of(test::compile(std::string(mend.head) + mend.bad + mend.tail), mend.rule);
    ASSERT_EQ(finding.rule, mend.rule);
    EXPECT_EQ(finding.place, mend.place) << mend.rule;
    const Compilation mended = test::compile(mend.head + finding.alternative + mend.tail);
    EXPECT_EQ(test::finding_of(mended, mend.rule).what, "") << finding.alternative;
    EXPECT_TRUE(mended.ok()) << finding.alternative;
  }
}

TEST(LintRules, the_boards_own_are_told_at_the_line_of_the_file) {
  const Compilation out = test::compile(
      "symrig = 1\n[rig.lines.lamp_enable]\nmax_on = \"1 ms\"\n[program]\nsteps = [\n  { hold = \"1 ms\" },\n"
      "  { pulse = \"lamp_enable\", width = \"2 ms\" },\n  { hold = \"1 ms\" },\n]\n");
  const FileFinding finding = test::finding_of(out, "max_on");
  EXPECT_EQ(finding.place, 7);
  EXPECT_NE(finding.what.find("lamp_enable"), std::string::npos);
}

TEST(LintRules, a_lamp_has_a_limit_or_a_warning_by_its_name_or_its_use) {
  const auto of = [](const std::string& lines, const std::string& program) {
    return test::finding_of(test::compile("symrig = 1\n" + lines + "[program]\n" + program),
                            "lamp.unlimited");
  };
  const std::string pulse = "steps = [{ pulse = \"lamp_enable\", width = \"100 s\" }, { hold = \"1 ms\" }]\n";
  const std::string scan = "patterns = 8\nbracket = [\"1 ms\"]\nlamp = \"lamp_enable\"\n";
  EXPECT_EQ(of("", pulse).place, 3);
  EXPECT_EQ(of("",
               "steps = [{ loop = 3, steps = [{ set = \"lamp_enable\", to = \"on\" }, { hold = \"1 ms\" },\n"
               "{ set = \"lamp_enable\", to = \"off\" }, { hold = \"1 ms\" }] }]\n")
                .rule,
            "lamp.unlimited");
  EXPECT_EQ(of("[rig.lines.lamp_enable]\ncapture = false\n", pulse).rule, "lamp.unlimited");
  EXPECT_EQ(of("[rig.lines.lamp_enable]\nhazard = \"benign\"\n", pulse).rule, "");
  EXPECT_EQ(of("[rig.lines.lamp_enable]\nmax_on = \"200 s\"\n", pulse).rule, "");
  EXPECT_EQ(of("", scan).rule, "lamp.unlimited");
  EXPECT_EQ(of("[rig.lines.lamp_enable]\nrole = \"lamp\"\nmax_on = \"1 s\"\n", scan).rule, "");
}

TEST(LintRules, what_becomes_nothing_is_an_error) {
  for (const char* step : {"pulse = \"projector_trigger\", width", "hold"}) {
    const Compilation out = test::compile("symrig = 1\n[program]\nsteps = [{ " + std::string(step) +
                                          " = \"3 ns\" }, { hold = \"1 ms\" }]\n");
    const FileFinding finding = test::finding_of(out, "rounding");
    EXPECT_EQ(finding.severity, Severity::error) << step;
    EXPECT_FALSE(out.ok());
  }
}

// The warning states the difference between the rounds that the file asks for and those that the board makes.
TEST(LintRules, time_that_is_added_to_a_round_is_told) {
  const Compilation out = test::compile(
      "symrig = 1\n[program]\nsteps = [\n  { loop = 100, steps = [\n    { hold = \"9 ms\" },\n"
      "    { loop = 2, steps = [{ hold = \"400 us\" }, { pulse = \"projector_trigger\", width = \"100 us\" "
      "}] },\n"
      "  ] },\n]\n");
  const FileFinding finding = test::finding_of(out, "hold.added");
  EXPECT_EQ(finding.place, 6);
  EXPECT_NE(finding.what.find("40 ns"), std::string::npos) << finding.what;
  ASSERT_TRUE(out.ok());
  EXPECT_EQ(out.program->expected, 100 * (9ms + 2 * (500us + 40ns)));
}

TEST(LintRules, pulses_written_by_hand_are_held_against_the_camera) {
  const auto of = [](const std::string& gap) {
    return test::compile(
        "symrig = 1\n[program]\nsteps = [\n  { loop = 5, steps = [\n"
        "    { pulse = \"camera_trigger\", width = \"1 ms\" },\n    { hold = \"" +
        gap + "\" },\n  ] },\n]\n");
  };
  EXPECT_EQ(test::finding_of(of("3 ms"), "camera.readout").place, 5);  // from round to round
  EXPECT_EQ(test::finding_of(of("4 ms"), "camera.readout").rule, "");
}

TEST(LintRules, delays_that_bring_edges_too_close_are_told) {
  const Compilation out = test::compile(
      "symrig = 1\n[rig.lines.lamp_enable]\ndelay = \"984 ns\"\n[program]\nsteps = [\n"
      "  { set = \"lamp_enable\", to = \"on\" },\n  { pulse = \"projector_trigger\", width = \"1 us\" },\n"
      "  { set = \"lamp_enable\", to = \"off\" },\n  { hold = \"1 ms\" },\n]\n");
  const FileFinding finding = test::finding_of(out, "min_dwell");
  EXPECT_EQ(finding.place, 6);
  EXPECT_NE(finding.what.find("16 ns (2 ticks)"), std::string::npos) << finding.what;
}

}  // namespace
}  // namespace symrig::lint_rules_test
