// SPDX-License-Identifier: Apache-2.0
// What the library captures is what the command captures: defaults, checks and procedures are the library's.
#include "command.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <fstream>
#include <limits>

namespace symrig::test::library_test {
namespace {

using Words = std::vector<std::string>;

class Library : public CommandTest {
 protected:
  /// Writes command.h5 and command.json.
  void by_command(const std::string& rig, const Words& more) const {
    Words words{"capture", "--rig", rig, "-o", "command.h5", "--json", "command.json"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = symrig(words);
    ASSERT_EQ(outcome.code, 0) << rig << ": " << outcome.err;
  }
  /// Writes library.h5, without provenance.
  CaptureResult by_library(const std::string& rig, const CaptureOptions& options) const {
    auto opened = open_virtual_rig(rig);
    EXPECT_TRUE(opened.ok()) << rig;
    auto result = capture(**opened, options);
    EXPECT_TRUE(result.ok()) << rig << ": " << result.error().line();
    rig_seconds_ = (*opened)->cost().rig_seconds;
    frames_ = (*opened)->cost().frames;
    EXPECT_TRUE(save_scene(path("library.h5"), {result->tensor, "{}", result->held_out}).ok());
    return *std::move(result);
  }
  /// The command and the library, with the same choices.
  void compare(const std::string& rig, const Words& words, const CaptureOptions& options) const {
    std::string what = rig;
    for (const std::string& word : words) what += " " + word;
    SCOPED_TRACE(what);
    by_command(rig, words);
    const CaptureResult result = by_library(rig, options);
    expect_same_numbers(result);
    expect_same_scene();
  }

  /// The library refuses by itself, before it measures.
  static void expect_refused(const CaptureOptions& options, const std::string& begins) {
    auto rig = open_virtual_rig(std::string(kSmall) + "&exposures=4");
    ASSERT_TRUE(rig.ok());
    const auto result = capture(**rig, options);
    ASSERT_FALSE(result.ok()) << begins;
    EXPECT_EQ(result.error().code, ErrorCode::bad_argument) << begins;
    EXPECT_TRUE(result.error().what.starts_with(begins)) << result.error().line();
    EXPECT_EQ((*rig)->cost().photographs, 0) << begins;
  }

 private:
  void expect_same_numbers(const CaptureResult& result) const {
    const nlohmann::json told = json("command.json");
    EXPECT_EQ(told.at("patterns"), result.patterns);
    EXPECT_EQ(told.at("patterns_per_level"), nlohmann::json(result.patterns_per_level));
    EXPECT_EQ(told.at("stopped_by"), result.stopped_by);
    EXPECT_EQ(told.at("suspects"), result.suspects);
    EXPECT_EQ(told.at("frames"), frames_);
    // Baselines without a log ask for more photographs at once: gaps between runs are a few bytes' time.
    EXPECT_NEAR(told.at("rig_seconds").get<double>(), rig_seconds_, 1e-6 * rig_seconds_);
    EXPECT_EQ(told.at("error_per_level"), nlohmann::json(result.error_per_level));
    ASSERT_EQ(told.at("estimated_error").is_null(), !result.estimated);
    if (result.estimated) {
      EXPECT_EQ(told.at("estimated_error").at("frobenius"), result.estimated->frobenius);
    }
  }

  /// Everything that the two files hold but where they come from, bit by bit.
  void expect_same_scene() const {
    const auto command = load_scene(path("command.h5"));
    const auto library = load_scene(path("library.h5"));
    ASSERT_TRUE(command.ok() && library.ok());
    const TransportTensor& a = command->tensor;
    const TransportTensor& b = library->tensor;
    EXPECT_EQ(a.bytes(), b.bytes());
    EXPECT_EQ(a.symmetric(), b.symmetric());
    EXPECT_TRUE(std::ranges::equal(a.camera_tree().order(), b.camera_tree().order()));
    EXPECT_TRUE(std::ranges::equal(a.leaves(), b.leaves(), [](const Leaf& x, const Leaf& y) {
      return x.row_begin == y.row_begin && x.row_end == y.row_end && x.col_begin == y.col_begin &&
             x.col_end == y.col_end && x.rank == y.rank && x.level == y.level;
    }));
    EXPECT_EQ(*a.factors(), *b.factors());
    EXPECT_EQ(a.scalar_values(), b.scalar_values());
    EXPECT_TRUE(std::ranges::equal(a.scalars(), b.scalars(), [](const ScalarLeaf& x, const ScalarLeaf& y) {
      return x.row == y.row && x.col == y.col;
    }));
    EXPECT_TRUE(std::ranges::equal(a.bands(), b.bands(), [](const BandLeaf& x, const BandLeaf& y) {
      return x.radius == y.radius && x.values == y.values;
    }));
    EXPECT_TRUE(std::ranges::equal(a.column_rows(), b.column_rows()));
    EXPECT_TRUE(std::ranges::equal(a.column_values(), b.column_values()));
    for (int level = 0; level < a.levels(); ++level)
      EXPECT_EQ(a.empty_count(level), b.empty_count(level)) << level;
    EXPECT_TRUE(
        std::ranges::equal(command->held_out, library->held_out, [](const HeldOut& x, const HeldOut& y) {
          return x.name == y.name && x.pattern == y.pattern && x.photograph == y.photograph;
        }));
  }

  mutable double rig_seconds_ = 0;
  mutable std::int64_t frames_ = 0;
};

TEST_F(Library, captures_without_options_as_the_command_does) {
  for (const char* rig : {"sim:gummy?size=24x24", "sim:vgroove-textured?size=12x17&channels=3",
                          "sim:plane?size=16x16&noise=off&psf=0.1", "sim:views2?size=16x16",
                          "sim:occluder?size=16x16&exposures=auto"})
    compare(rig, {}, {});
}

TEST_F(Library, captures_with_every_algorithm_as_the_command_does) {
  for (const std::string_view text : algorithm_names())
    for (const char* rig : {"sim:gummy?size=16x16", "sim:vgroove-mixed?size=12x17&noise=off"})
      compare(rig, {"--algorithm", std::string(text)}, {.algorithm = *parse_algorithm(text)});
}

TEST_F(Library, understands_options_as_the_command_does) {
  const std::string rig = "sim:gummy?size=16x16", views = "sim:views2?size=16x16",
                    planned = "sim:gummy?size=12x12&exposures=auto";
  compare(rig, {"--tolerance", "3e-3"}, {.tolerance = 3e-3});
  compare(rig, {"--algorithm", "paper", "--tolerance", "3e-3", "--polish", "1"},
          {.algorithm = Algorithm::paper, .tolerance = 3e-3, .polish = 1});
  compare(rig, {"--algorithm", "dual", "--tolerance", "3e-3", "--dual-subtract"},
          {.algorithm = Algorithm::dual, .tolerance = 3e-3, .dual_subtracts = true});
  compare(rig, {"--algorithm", "dual", "--dual-threshold", "1e-2"},
          {.algorithm = Algorithm::dual, .dual_threshold = 1e-2});
  compare(rig, {"--max-patterns", "30"}, {.max_patterns = 30});
  compare(rig, {"--max-seconds", "2"}, {.max_seconds = 2});
  compare(rig, {"--target-error", "0.1"}, {.target_error = 0.1});
  compare(views, {"--split", "views-first"}, {.split = SplitOrder::views_first});
  compare(planned, {"--photograph-seconds", "1"}, {.photograph_seconds = 1});
}

// Both refuse, and the command says what the library says, in its own words.
TEST_F(Library, refuses_what_the_command_refuses) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  expect_refused({.tolerance = nan}, "tolerance");
  expect_refused({.tolerance = -1e-3}, "tolerance");
  expect_refused({.tolerance = 1}, "tolerance");
  expect_refused({.algorithm = Algorithm::dual, .dual_threshold = nan}, "dual_threshold");
  expect_refused({.polish = -1}, "polish");
  expect_refused({.polish = 21}, "polish");
  expect_refused({.photograph_seconds = nan}, "photograph_seconds");
  expect_refused({.photograph_seconds = -1}, "photograph_seconds");
  expect_refused({.photograph_seconds = 5}, "photograph_seconds");
  expect_refused({.split = SplitOrder::flat}, "split");
  expect_refused({.max_patterns = -5}, "max_patterns");
  expect_refused({.max_seconds = nan}, "max_seconds");
  expect_refused({.max_seconds = inf}, "max_seconds");
  expect_refused({.max_seconds = -1}, "max_seconds");
  expect_refused({.target_error = nan}, "target_error");
  expect_refused({.target_error = -0.1}, "target_error");
  expect_refused({.target_error = 1}, "target_error");
  expect_refused({.memory_limit = -1}, "memory_limit");
  expect_refused({.rule = RankRule{.signal_fraction = nan}}, "rule.signal_fraction");
  expect_refused({.rule = RankRule{.flood_fraction = -1}}, "rule.flood_fraction");
  expect_refused({.economy = Economy{.decay = nan}}, "economy.decay");
  expect_refused({.economy = Economy{.rank = 0}}, "economy.rank");
  expect_refused({.exposure = {.relative = nan}}, "exposure.relative");
  expect_refused({.algorithm = Algorithm::brute, .tolerance = 0.1}, "tolerance has no effect");
  expect_refused({.algorithm = Algorithm::brute, .max_patterns = 5}, "max_patterns has no effect");
  expect_refused({.algorithm = Algorithm::paper, .target_error = 0.1}, "target_error has no effect");
  expect_refused({.algorithm = Algorithm::paper, .dual_threshold = 0.1}, "dual_threshold has no effect");
  expect_refused({.algorithm = Algorithm::symrig, .dual_subtracts = true}, "dual_subtracts has no effect");
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--algorithm", "dual", "--tolerance", "0.01",
                  "--dual-threshold", "0.1"},
                 kUsage, {"--tolerance has no effect beside --dual-threshold"});
}

// A rig whose camera has pixels of its own: calibrate, capture, evaluate.

using RegistrationCommand = CommandTest;

constexpr const char* kBench =
    "sim:vgroove-textured?size=24x24&noise=off&camera=110x110&turn=1.5&zoom=0.8&shift=0.7,-0.4";

TEST_F(RegistrationCommand, two_commands_capture_a_bench) {
  const Outcome calibrated = symrig(
      {"calibrate", "--rig", kBench, "-o", "registration.h5", "--json", "r.json", "--report", "r.html"});
  ASSERT_EQ(calibrated.code, 0) << calibrated.err;
  EXPECT_NE(calibrated.out.find("--registration registration.h5"), std::string::npos) << calibrated.out;
  const nlohmann::json r = json("r.json");
  EXPECT_EQ(r.at("photographs"), 22 + 6 + 2 + 16);  // 2 (5 + 5) + 2, 6 of dots, 2 to notice motion, 16 blocks
  EXPECT_EQ(r.at("cells"), nlohmann::json::array({24, 24}));
  EXPECT_EQ(r.at("camera_grid"), nlohmann::json::array({110, 110}));
  EXPECT_EQ(r.at("weights").at("cells_seen"), 24 * 24);
  EXPECT_NEAR(r.at("pixels_per_cell").get<double>(), 110 * 0.8 / 24, 0.01);
  EXPECT_EQ(r.at("ghost").at("found"), false);
  EXPECT_NE(read_text(path("r.html")).find("110x110"), std::string::npos);

  const Outcome captured =
      symrig({"capture", "--rig", kBench, "--registration", "registration.h5", "-o", "scene.h5"});
  ASSERT_EQ(captured.code, 0) << captured.err;
  ASSERT_EQ(symrig({"evaluate", "scene.h5", "--rig", kBench, "--json", "e.json"}).code, 0);
  const nlohmann::json errors = json("e.json");
  // The bars of the registration's benchmark.
  EXPECT_LT(errors.at("error").at("frobenius").get<double>(), 0.03);
  EXPECT_LT(errors.at("error_ideal").at("frobenius").get<double>(), 0.03);
  // What calibrate told in advance is right within a factor of 2.
  const double expected = r.at("expected_indirect").at("surfaces").get<double>();
  const double indirect = errors.at("error_ideal").at("indirect").get<double>();
  EXPECT_LT(indirect, 2 * expected);
  EXPECT_GT(indirect, expected / 2);
}

// Light of other views looks like blur, and adds errors that pixels a cell do not tell.
TEST_F(RegistrationCommand, several_views_are_promised_nothing) {
  const Outcome calibrated =
      symrig({"calibrate", "--rig", "sim:views2?size=24x24&fine=2&camera=110x110&zoom=0.8", "-o", "views.h5",
              "--report", "views.html"});
  ASSERT_EQ(calibrated.code, 0) << calibrated.err;
  EXPECT_NE(calibrated.out.find("blur is not measured"), std::string::npos) << calibrated.out;
  EXPECT_EQ(calibrated.out.find("expect an error"), std::string::npos) << calibrated.out;
  EXPECT_EQ(read_text(path("views.html")).find("edges are sharp"), std::string::npos);
}

TEST_F(RegistrationCommand, a_ghost_is_named) {
  const Outcome calibrated = symrig(
      {"calibrate", "--rig", "sim:plane?size=32x32&camera=150x150&turn=1.5&zoom=0.78&ghost=0.02@4.5,-3", "-o",
       "ghost.h5", "--json", "g.json", "--report", "g.html"});
  ASSERT_EQ(calibrated.code, 0) << calibrated.err;
  EXPECT_NE(calibrated.out.find("cells above and"), std::string::npos) << calibrated.out;
  EXPECT_NE(calibrated.out.find("cells right of its source"), std::string::npos) << calibrated.out;
  EXPECT_NE(read_text(path("g.html")).find("pellicle"), std::string::npos);
  const nlohmann::json ghost = json("g.json").at("ghost");
  EXPECT_EQ(ghost.at("found"), true);
  EXPECT_NEAR(ghost.at("share").get<double>(), 0.02, 0.004);
  EXPECT_NEAR(ghost.at("place").at(0).get<double>(), 4.5, 1);
  EXPECT_NEAR(ghost.at("place").at(1).get<double>(), -3, 1);
}

TEST_F(RegistrationCommand, a_rig_that_is_not_coaxial_is_not_taken_for_symmetric) {
  const std::string apart =
      "sim:vgroove-textured?size=24x24&noise=off&fine=4&camera=110x110&turn=1.5&zoom=0.8&parallax=4";
  const Outcome calibrated = symrig({"calibrate", "--rig", apart, "-o", "r.h5"});
  ASSERT_EQ(calibrated.code, 0) << calibrated.err;
  EXPECT_NE(calibrated.out.find("warning: camera and projector are not coaxial"), std::string::npos)
      << calibrated.out;
  expect_refusal({"capture", "--rig", apart, "--registration", "r.h5", "-o", "scene.h5"}, kBadInput,
                 {"not coaxial", "symrig align", "--algorithm brute"});
  EXPECT_EQ(
      symrig({"capture", "--rig", apart, "--registration", "r.h5", "-o", "scene.h5", "--algorithm", "brute"})
          .code,
      0);
  // What a perspective map explains is no parallax.
  ASSERT_EQ(symrig({"calibrate", "--rig", kBench, "-o", "r.h5", "--json", "r.json"}).code, 0);
  EXPECT_EQ(json("r.json").at("parallax").at("coaxial"), true);
  EXPECT_LT(json("r.json").at("parallax").at("range").get<double>(), 0.1);
  EXPECT_NEAR(json("r.json").at("shape").at("turn").get<double>(), 1.5, 0.1);
}

TEST_F(RegistrationCommand, what_does_not_fit_is_refused) {
  ASSERT_EQ(symrig({"calibrate", "--rig", kBench, "-o", "registration.h5"}).code, 0);
  expect_refusal({"capture", "--rig", kBench, "-o", "scene.h5"}, kBadInput,
                 {"24x24", "110x110", "symrig calibrate"});
  expect_refusal({"capture", "--rig", kSmall, "--registration", "registration.h5", "-o", "scene.h5"},
                 kBadInput, {"24x24", "12x17"});
  expect_refusal({"capture", "--rig", kBench, "--registration", "none.h5", "-o", "scene.h5"}, kBadInput,
                 {"none.h5", "symrig calibrate"});
  std::ofstream(path("text.h5")) << "no registration";
  expect_refusal({"capture", "--rig", kBench, "--registration", "text.h5", "-o", "scene.h5"}, kBadInput,
                 {"text.h5", "not a registration"});
  expect_refusal({"calibrate", "--rig", "sim:plane?size=24x24&camera=40x40&zoom=0.8", "-o", "r.h5"}, kFault,
                 {"pixels along the side of a cell"});
  expect_refusal({"calibrate", "--rig", kBench, "-o", "r.h5", "--uncertainty", "u.exr"}, kUsage,
                 {"--uncertainty"});
  expect_refusal({"calibrate", "--from", "photographs", "-o", "r.h5"}, kUsage, {"--rig"});
}

// Another registration would put the log's photographs on other cells.
TEST_F(RegistrationCommand, a_capture_goes_on_only_with_the_same_registration) {
  ASSERT_EQ(symrig({"calibrate", "--rig", kBench, "-o", "one.h5"}).code, 0);
  const std::string other = std::string(kBench) + "&indirect=0.5";
  ASSERT_EQ(symrig({"calibrate", "--rig", other, "-o", "two.h5"}).code, 0);
  ASSERT_EQ(symrig({"capture", "--rig", kBench, "--registration", "one.h5", "-o", "scene.h5", "--keep-log",
                    "--max-patterns", "20"})
                .code,
            0);
  expect_refusal({"capture", "--rig", kBench, "--registration", "two.h5", "-o", "scene.h5", "--resume"},
                 kBadInput, {"registration"});
  EXPECT_EQ(
      symrig({"capture", "--rig", kBench, "--registration", "one.h5", "-o", "scene.h5", "--resume"}).code, 0);
}

// A log of an older symrig has photographs on the cells.
TEST_F(RegistrationCommand, a_log_of_cells_goes_on) {
  ASSERT_EQ(symrig({"calibrate", "--rig", kBench, "-o", "one.h5"}).code, 0);
  {
    const OpenedRig rig = *open_rig(kBench, path("one.h5").string(), {});
    CaptureOptions options;
    options.max_patterns = 20;
    const auto log =
        *create_photograph_log(path("scene.h5.log"), log_identity(*rig.probe, *settings_of(options)));
    LoggedProbe probe(*rig.probe, *log);
    options.log = log.get();
    ASSERT_TRUE(capture(probe, options).ok());
    EXPECT_EQ(log->size(), 20);
  }
  EXPECT_FALSE(*keeps_camera_photographs(path("scene.h5.log")));
  const Outcome continued = symrig({"capture", "--rig", kBench, "--registration", "one.h5", "-o", "scene.h5",
                                    "--resume", "--json", "scene.json"});
  ASSERT_EQ(continued.code, 0) << continued.err;
  // The smaller budget chose the last of them.
  EXPECT_GT(json("scene.json").at("replayed"), 5);
  ASSERT_EQ(symrig({"capture", "--rig", kBench, "--registration", "one.h5", "-o", "whole.h5", "--json",
                    "whole.json"})
                .code,
            0);
  EXPECT_EQ(json("scene.json").at("patterns"), json("whole.json").at("patterns"));
}

TEST_F(RegistrationCommand, a_rig_file_that_names_one_needs_the_cells) {
  const auto refused =
      [&](const std::string& keys, const std::string& grid) {
        std::ofstream(path("rig.toml"))
            << "symrig = 1\n"
            << keys << "[board]\nuri = \"unix:no-board.sock\"\n"
            << "[camera]\nbits = 12\nfull_well = 20000\nread_noise = 6\npedestal = 64\n"
            << "[projector]\n"
            << grid;
        return symrig({"capture", "--rig", "rig.toml", "-o", "scene.h5"}).err;
      };
  EXPECT_NE(refused("registration = \"r.h5\"\n", "").find("rig.toml:2: registration: it needs capture.grid"),
            std::string::npos);
  EXPECT_NE(refused("registration = \"r.exr\"\n", "").find(".h5"), std::string::npos);
  const std::string error = refused("registration = \"r.h5\"\n", "[capture]\ngrid = \"24x24\"\n");
  EXPECT_NE(error.find("r.h5"), std::string::npos) << error;
  EXPECT_NE(error.find("symrig calibrate"), std::string::npos) << error;
  const std::string colour = refused("", "[capture]\ngrid = \"24x24\"\ncolour = true\n");
  EXPECT_NE(colour.find("registration: capture.colour needs it"), std::string::npos) << colour;
}

}  // namespace
}  // namespace symrig::test::library_test
