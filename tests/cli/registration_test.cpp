// SPDX-License-Identifier: Apache-2.0
// A rig whose camera has pixels of its own: calibrate, capture, evaluate.
#include "command.hpp"

#include <fstream>

namespace symrig::test::registration_test {
namespace {

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

// A log's photographs are on the cells, so another registration would mix two kinds of photographs.
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
}  // namespace symrig::test::registration_test
