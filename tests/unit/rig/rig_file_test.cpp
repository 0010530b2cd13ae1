// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/rig_file.hpp"

#include "scratch.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/hdr/sensor.hpp"

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::rig_file_test {
namespace {

using namespace std::chrono_literals;

const std::string kHead = "symrig = 1\n[board]\nuri = \"usb:\"\n";
const std::string kSensor = "bits = 12\nfull_well = 20000\nread_noise = 6\npedestal = 64\n";

Result<RigDescription> parse(const std::string& text) {
  return parse_rig_file(text, "rig.toml", ".");
}

void expect_refused(const std::string& text, const std::string& begin, const std::string& hint) {
  const auto file = parse(text);
  ASSERT_FALSE(file.ok()) << text;
  EXPECT_EQ(file.error().code, ErrorCode::bad_format);
  EXPECT_TRUE(file.error().what.starts_with("rig.toml:" + begin)) << file.error().line();
  EXPECT_NE(file.error().hint.find(hint), std::string::npos) << file.error().line();
}

TEST(RigFile, the_shortest_one_has_sound_defaults) {
  const auto file = parse(kHead + "[camera]\n" + kSensor + "[projector]\n");
  ASSERT_TRUE(file.ok()) << file.error().line();
  EXPECT_EQ(file->name, "rig");
  EXPECT_EQ(file->options.setup.line_name(RigRole::strobe), "camera_strobe");
  EXPECT_EQ(file->options.setup.line_name(RigRole::camera), "camera_trigger");
  EXPECT_EQ(file->options.setup.line_name(RigRole::vsync), "vsync");
  EXPECT_EQ(file->options.ledger.guards, 4);
  EXPECT_EQ(file->camera.noise, NoiseModel::from_electrons({}));
  EXPECT_GE(file->options.gap, file->options.ledger.readout + 2 * file->options.ledger.tolerance)
      << "stamps of two frames must not fit the same exposure";
}

TEST(RigFile, the_examples_are_read) {
  for (const char* name :
       {"hdmi.toml", "bench.toml", "two-pairs.toml", "lightcrafter-4500.toml", "lightcrafter-6500.toml"}) {
    const auto file = read_rig_file(std::filesystem::path(SYMRIG_EXAMPLE_RIGS) / name);
    EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().line());
  }
}

TEST(RigFile, bit_planes_need_both_trigger_outputs_and_a_profile_with_planes) {
  const std::string rig = "[rig]\nprojector = \"lightcrafter-4500-video\"\n";
  const std::string line = "[rig.lines.plane_trigger]\nrole = \"plane\"\n";
  const std::string rest = "[camera]\n" + kSensor + "[projector]\ndriver = \"dlpc350\"\n";
  const auto file = parse(kHead + rig + line + rest);
  ASSERT_TRUE(file.ok()) << file.error().line();
  EXPECT_EQ(file->options.setup.line_name(RigRole::plane), "plane_trigger");
  EXPECT_NE(file->identity().find("projector dlpc350"), std::string::npos) << file->identity();
  expect_refused(kHead + rig + rest, "5: no line has the role \"plane\"", "TRIG_OUT_1");
  expect_refused(kHead + rig + line + rest + "vsync = false\n", "5: no line has the role \"vsync\"",
                 "TRIG_OUT_2");
  expect_refused(kHead + line + rest, "4: rig.projector: 'hdmi-60'", "lightcrafter-4500-video");
}

TEST(RigFile, the_keys_of_a_dlp_controller_are_checked) {
  const std::string head = kHead + "[rig]\nprojector = \"lightcrafter-4500-video\"\n" +
                           "[rig.lines.plane_trigger]\nrole = \"plane\"\n[camera]\n" + kSensor +
                           "[projector]\ndriver = \"dlpc350\"\n";
  const auto all =
      parse(head +
            "controller = \"/dev/hidraw0\"\nconnector = \"HDMI-A-1\"\nmode = \"912x1140R@60\"\n"
            "planes = 12\nplane_period = \"1300 us\"\nplane_exposure = \"1 ms\"\nleds = \"blue\"\n"
            "red_current = 10\ngreen_current = 20\nblue_current = 30\nport = \"fpd-link\"\n"
            "plane_active = \"low\"\nframe_active = \"high\"\nplane_delay_us = 1.5\n"
            "frame_delay_us = -10\nlatency = 2\nplane_order = \"RGB highest first\"\n");
  EXPECT_TRUE(all.ok()) << all.error().line();
  EXPECT_NE(all->identity().find(", order RGB highest first"), std::string::npos) << all->identity();
  expect_refused(head + "planes = 25\n", "15: projector.planes", "24");
  expect_refused(head + "plane_period = \"684.5 us\"\n", "15: projector.plane_period", "684 us");
  expect_refused(head + "leds = \"violet\"\n", "15: projector.leds", "\"magenta\"");
  expect_refused(head + "red_current = 10\n", "13: projector.green_current", "0 to 255");
  expect_refused(head + "frame_delay_us = 1\n", "15: projector.frame_delay_us", "plane_delay_us");
  expect_refused(head + "plane_delay_us = 3\n", "15: projector.plane_delay_us", "2.78");
  expect_refused(head + "folder = \"p\"\n", "15: there is no key projector.folder", "connector");
  expect_refused(head + "plane_order = \"RRB\"\n", "15: projector.plane_order", "\"RGB\"");
}

TEST(RigFile, a_dlpc900_has_keys_of_its_own) {
  const std::string head = kHead + "[rig]\nprojector = \"lightcrafter-6500-video\"\n" +
                           "[rig.lines.plane_trigger]\nrole = \"plane\"\n[camera]\n" + kSensor +
                           "[projector]\ndriver = \"dlpc900\"\n";
  const auto usual = parse(head);
  ASSERT_TRUE(usual.ok()) << usual.error().line();
  EXPECT_NE(usual->identity().find("projector dlpc900  1920x1080@60, 24 planes, period longest"),
            std::string::npos)
      << usual->identity();
  for (const char* port : {"hdmi", "displayport", "unchanged"}) {
    const auto file = parse(head + "port = \"" + port + "\"\nplane_delay_us = 5\nframe_delay_us = -15\n");
    EXPECT_TRUE(file.ok()) << file.error().line();
  }
  expect_refused(head + "port = \"fpd-link\"\n", "15: projector.port", "displayport");
  expect_refused(head + "plane_exposure = \"300 us\"\n", "15: there is no key projector.plane_exposure",
                 "plane_");
  expect_refused(head + "frame_delay_us = -21\n", "15: projector.frame_delay_us", "-20");
}

TEST(RigFile, exposures_may_be_planned) {
  const auto file = parse(kHead + "[camera]\n" + kSensor + "[projector]\n[capture]\nexposures = \"auto\"\n");
  ASSERT_TRUE(file.ok()) << file.error().line();
  EXPECT_EQ(file->options.exposures, 0);
  EXPECT_NE(file->identity().find("exposures planned"), std::string::npos);
  expect_refused(kHead + "[camera]\n" + kSensor + "[projector]\n[capture]\nexposures = \"many\"\n",
                 "11: capture.exposures", "1 to 8, or");
}

TEST(RigFile, a_measured_sensor_takes_the_place_of_its_numbers) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "rig_file_sensor";
  std::filesystem::create_directories(folder);
  Sensor measured;
  measured.noise =
      NoiseModel::from_electrons({.full_well = 9000, .read_noise = 3, .bits = 10, .pedestal = 40});
  measured.defects = Image<std::uint8_t>({8, 12});
  measured.defects.at(5, 7) = 1;
  ASSERT_TRUE(save_sensor(folder / "sensor.toml", measured).ok());
  const std::string camera = kHead + "[projector]\n[camera]\nsensor = \"sensor.toml\"\n";
  const auto file = parse_rig_file(camera, "rig.toml", folder);
  ASSERT_TRUE(file.ok()) << file.error().line();
  EXPECT_EQ(file->camera.bits, 10);
  ASSERT_TRUE(file->camera.noise);
  EXPECT_NEAR(file->camera.noise->gain(), measured.noise.gain(), 1e-9);
  EXPECT_NEAR(file->camera.noise->read_noise(), 3, 1e-6);
  EXPECT_EQ(file->camera.defects.at(5, 7), 1);
  const auto refused = [&](const std::string& more, const std::string& says) {
    const auto wrong = parse_rig_file(camera + more, "rig.toml", folder);
    ASSERT_FALSE(wrong.ok()) << more;
    EXPECT_EQ(wrong.error().code, ErrorCode::bad_format);
    EXPECT_NE(wrong.error().what.find(says), std::string::npos) << wrong.error().line();
  };
  refused("full_well = 9000\n", "rig.toml:7: camera.full_well");
  refused("bits = 12\n", "measured at 10 bits");
  refused("size = \"16x8\"\n", "measured on pictures of 8x12");
  EXPECT_EQ(parse_rig_file(camera, "rig.toml", folder / "elsewhere").error().code, ErrorCode::not_found);
  std::filesystem::remove_all(folder);
}

TEST(RigFile, the_sensor_need_not_be_known_to_be_measured) {
  const test::Scratch scratch;
  const auto read = [&](const std::string& keys) {
    return parse_rig_file(kHead + "[projector]\n[camera]\n" + keys, "rig.toml", scratch.folder(),
                          RigUse::sensor);
  };
  for (const char* keys : {"", "bits = 10\n", "sensor = \"sensor.toml\"\nbits = 10\n"}) {
    EXPECT_FALSE(parse_rig_file(kHead + "[projector]\n[camera]\n" + keys, "rig.toml", scratch.folder()).ok());
    const auto file = read(keys);
    ASSERT_TRUE(file.ok()) << file.error().line();
    EXPECT_FALSE(file->camera.noise);
    EXPECT_EQ(file->camera.bits, keys[0] == 0 ? 0 : 10);
  }
  // Of an old measurement only the bits count.
  Sensor old;
  old.noise = NoiseModel::from_electrons({.bits = 14});
  old.defects = Image<std::uint8_t>({2, 3}, 1, 1);
  ASSERT_TRUE(save_sensor(scratch / "sensor.toml", old).ok());
  const auto again = read("sensor = \"sensor.toml\"\nsize = \"16x8\"\n");
  ASSERT_TRUE(again.ok()) << again.error().line();
  EXPECT_EQ(again->camera.bits, 14);
  EXPECT_FALSE(again->camera.noise);
  EXPECT_TRUE(again->camera.defects.empty());
  EXPECT_EQ(again->camera.sensor, (scratch / "sensor.toml").string());
  EXPECT_EQ(read("full_well = 9000\n").error().code, ErrorCode::bad_format);  // half a description
  // A bin is no sample, and defects have no place in a part of the picture.
  auto binned = read("binning = 2\n");
  ASSERT_TRUE(binned.ok());
  EXPECT_EQ(parts_for_sensor(*std::move(binned)).error().code, ErrorCode::bad_argument);
  auto part = read("region = { row = 2, col = 2, rows = 4, cols = 4 }\n");
  ASSERT_TRUE(part.ok()) << part.error().line();
  EXPECT_FALSE(parts_for_sensor(*std::move(part)).value().whole_picture);
  EXPECT_TRUE(parts_for_sensor(read("").value()).value().whole_picture);
}

TEST(RigFile, measured_levels_choose_the_codes) {
  const test::Scratch scratch;
  std::vector<FieldLight> fields;
  for (int level = 0; level <= 255; level += 15)
    fields.push_back({level, std::pow(level / 255.0, 2.0), 1e-12});
  const auto response = ProjectorResponse::fit(fields);
  ASSERT_TRUE(response.ok()) << response.error().line();
  ASSERT_TRUE(save_projector_response(scratch / "levels.toml", *response).ok());
  const std::string text = kHead + "[camera]\n" + kSensor + "[projector]\nlevels = \"levels.toml\"\n";
  const auto file = parse_rig_file(text, "rig.toml", scratch.folder());
  ASSERT_TRUE(file.ok()) << file.error().line();
  EXPECT_TRUE(file->projector.codes.measured());
  EXPECT_NEAR(file->projector.codes.code(0.25F), 127.5,
              1);  // a square: half the level, a quarter of the light
  EXPECT_NE(file->identity().find("levels levels.toml"), std::string::npos);
  EXPECT_EQ(parse_rig_file(text, "rig.toml", scratch / "elsewhere").error().code, ErrorCode::not_found);
}

TEST(RigFile, a_driver_may_be_named) {
  const std::string folder = "folder = \"p\"\nscreen = \"1280x800\"\n";
  const std::string lines = "[rig.lines.projector_trigger]\nrole = \"projector\"\n";
  const auto identity_of = [&](const std::string& camera, const std::string& projector) {
    const auto file = parse(kHead + "[camera]\n" + camera + kSensor + "[projector]\n" + projector + lines);
    return file.ok() ? file->identity() : file.error().line();
  };
  EXPECT_EQ(identity_of("driver = \"v4l2\"\n", "driver = \"drm\"\n"), identity_of("", ""));
  EXPECT_EQ(identity_of("", "driver = \"folder\"\n" + folder), identity_of("", folder));
  expect_refused(kHead + "[camera]\ndriver = \"v4l\"\n" + kSensor + "[projector]\n", "5: camera.driver",
                 "v4l2");
  expect_refused(kHead + "[camera]\n" + kSensor + "[projector]\ndriver = \"folder\"\n", "9: projector",
                 "folder");
  expect_refused(kHead + "[camera]\n" + kSensor + "[projector]\ndriver = \"drm\"\n" + folder,
                 "11: there is no key projector.folder", "connector");
}

TEST(RigFile, every_key_arrives) {
  const auto file = parse(kHead + R"([rig]
camera = { profile = "generic-strobed", readout = "5 ms", active = "low" }
[rig.lines.interlock]
role = "interlock"
trip = "high"
[camera]
device = "cam"
format = "Y12"
size = "640x480"
region = { row = 2, col = 4, rows = 96, cols = 128 }
binning = 2
strobe = false
stamp_tolerance = "300 us"
guards = 6
patience = "2 s"
)" + kSensor + R"([camera.controls]
gain = 3
trigger_mode = "Edge"
auto_exposure = false
[projector]
connector = "DP-1"
cell = 3
mirror = "both"
vsync = false
[capture]
grid = "48x64"
exposures = 3
retakes = 9
device_patience = "5 s"
views = "2x2"
)");
  ASSERT_TRUE(file.ok()) << file.error().line();
  const std::string identity = file->identity();
  EXPECT_TRUE(identity.starts_with("rig: camera cam Y12 96x128+2+4 of 480x640, binning 2, ")) << identity;
  EXPECT_NE(identity.find(", gain 3, trigger_mode Edge, auto_exposure 0; projector DP-1 , cell 3+0+0, rows "
                          "mirrored, columns mirrored; 3 exposures, ratio 8"),
            std::string::npos)
      << identity;
  EXPECT_TRUE(file->options.setup.is_active_low(RigRole::camera));
  EXPECT_EQ(file->options.gap, 5ms + 2 * 300us + 500us);
  EXPECT_EQ(file->options.setup.line_name(RigRole::strobe), "");
  EXPECT_EQ(file->options.setup.line_name(RigRole::vsync), "");
  EXPECT_EQ(file->options.ledger.guards, 6);
  EXPECT_EQ(file->options.frame_patience, Nanoseconds(2s));
  EXPECT_TRUE(file->projector.placement.mirror_rows && file->projector.placement.mirror_cols);
  EXPECT_EQ(file->grid, (Grid{48, 64}));
  EXPECT_EQ(file->options.retakes, 9);
  EXPECT_EQ(file->options.device_patience, Nanoseconds(5s));
  EXPECT_EQ(file->options.views.rows, 2);
  const RigLine* interlock = file->options.setup.with_role(RigRole::interlock);
  ASSERT_NE(interlock, nullptr);
  EXPECT_EQ(interlock->config.trip_level, true);
}

const std::string kPairOfDevices = "[[pair]]\n[pair.camera]\n" + kSensor + "[pair.projector]\n";

TEST(RigFile, several_pairs_have_one_board) {
  const auto file = parse_rig_file(
      kHead + "[[pair]]\nregistration = \"left.h5\"\n[pair.camera]\nguards = 9\n" + kSensor +
          "[pair.projector]\ncell = 3\n[[pair]]\nuri = \"tcp:10.0.0.7:7001\"\nsecret = \"secret\"\n"
          "[capture]\ngrid = \"24x20\"\n",
      "rig.toml", "/home/rig");
  ASSERT_TRUE(file.ok()) << file.error().line();
  ASSERT_EQ(file->pairs.size(), 2U);
  EXPECT_EQ(file->pair_layout, (ViewLayout{1, 2}));
  EXPECT_EQ(file->options.views, (ViewLayout{1, 2}));
  EXPECT_EQ(pair_layout_of(*file).cells, (Grid{24, 40}));
  EXPECT_EQ(file->pairs[0].registration, "/home/rig/left.h5");
  EXPECT_EQ(file->pairs[0].projector.placement.cell, 3);
  EXPECT_EQ(file->pairs[1].address->secret, "/home/rig/secret");
  EXPECT_EQ(file->pairs[1].address->uri.text(), "tcp:10.0.0.7:7001");
  EXPECT_EQ(file->options.ledger.guards, 9);
  EXPECT_NE(file->identity().find("pair 2: tcp:10.0.0.7:7001"), std::string::npos) << file->identity();
}

TEST(RigFile, pairs_are_laid_out) {
  const std::string four = kPairOfDevices + kPairOfDevices + kPairOfDevices + kPairOfDevices;
  const auto square = parse(kHead + four + "[capture]\ngrid = \"6x5\"\npairs = \"2x2\"\nviews = \"2x4\"\n");
  ASSERT_TRUE(square.ok()) << square.error().line();
  EXPECT_EQ(square->pair_layout, (ViewLayout{2, 2}));
  EXPECT_EQ(square->options.views, (ViewLayout{2, 4}));
  EXPECT_EQ(pair_layout_of(*square).cells, (Grid{12, 10}));
  expect_refused(kHead + kPairOfDevices + "[capture]\npairs = \"1x2\"\n",
                 "12: capture.pairs: 1x2 has 2 places", "1x2");
}

TEST(RigFile, mistakes_in_pairs_are_named) {
  const std::string tcp = "[[pair]]\nuri = \"tcp:10.0.0.7:7001\"\n";
  expect_refused(kHead + tcp, "4: pair.secret: TCP needs a shared secret", "the file with the secret");
  expect_refused(kHead + "[[pair]]\nuri = \"usb:\"\n", "5: pair.uri: \"usb:\" is no place", "tcp:HOST:PORT");
  expect_refused(kHead + kPairOfDevices + "[camera]\n", "11: camera: cannot be combined", "[pair.camera]");
  expect_refused(kHead + "pair = 3\n", "4: there is no key board.pair", "uri");
  expect_refused("pair = 3\n" + kHead, "1: pair: is not 1 to 64 tables", "[[pair]]");
  expect_refused(kHead + "[[pair]]\nuri = \"unix:a\"\n[pair.camera]\n", "6: pair.camera: cannot be combined",
                 "server");
  expect_refused(kHead + "[[pair]]\nurl = \"unix:a\"\n", "5: there is no key pair.url", "uri");
  expect_refused(kHead + kPairOfDevices + "[capture]\ncolour = true\n", "4: pair: capture.colour",
                 "one pair");
  for (const RigUse use : {RigUse::sensor, RigUse::one_pair, RigUse::served}) {
    const auto file = parse_rig_file(kHead + kPairOfDevices, "rig.toml", ".", use);
    ASSERT_FALSE(file.ok());
    EXPECT_TRUE(file.error().what.starts_with("rig.toml:4: pair: this work needs")) << file.error().line();
  }
}

TEST(RigFile, a_served_pair_needs_no_board) {
  const std::string text = "symrig = 1\n[camera]\n" + kSensor + "[projector]\n";
  EXPECT_FALSE(parse(text).ok());
  const auto file = parse_rig_file(text, "rig.toml", ".", RigUse::served);
  ASSERT_TRUE(file.ok()) << file.error().line();
}

TEST(RigFile, a_map_lies_beside_the_file) {
  const std::string rest = "[camera]\n" + kSensor + "[projector]\n";
  const auto map_of = [&](const std::string& path) {
    return parse_rig_file("map = \"" + path + "\"\n" + kHead + rest, "rig.toml", "/rigs").value().map;
  };
  EXPECT_EQ(map_of("bench.exr"), "/rigs/bench.exr");
  EXPECT_EQ(map_of("/maps/bench.pfm"), "/maps/bench.pfm");
  EXPECT_EQ(parse(kHead + rest)->map, "");
  expect_refused("map = \"bench.png\"\n" + kHead + rest, "1: map", ".exr or .pfm");
}

TEST(RigFile, mistakes_are_named_with_their_line) {
  const std::string rest = "[camera]\n" + kSensor + "[projector]\n";
  expect_refused(kHead + "[camera]\nbining = 2\n" + kSensor + "[projector]\n",
                 "5: there is no key camera.bining", "did you mean 'binning'?");
  expect_refused("symrig = 2\n" + rest, "1: symrig: 2 is out of range", "");
  expect_refused(kHead + "[camera]\n[projector]\n", "4: camera.full_well is missing", "full well");
  expect_refused("symrig = 1\n" + rest, "1: board is missing", "[board]");
  expect_refused("symrig = 1\n[board]\nuri = \"usb\"\n" + rest, "3: board.uri", "usb");
  expect_refused(kHead + "[camera]\nsize = \"1280\"\n" + kSensor + "[projector]\n", "5: camera.size",
                 "columns x rows");
  expect_refused(kHead + rest + "[capture]\nratio = 0.5\n", "11: capture.ratio", "1.01");
  expect_refused(kHead + rest + "folder = \"p\"\nconnector = \"DP-1\"\n", "10: projector.folder", "either");
  expect_refused(kHead + "[rig]\ncamera = { exposure = \"timed\" }\n" + rest, "5: rig.camera",
                 "trigger-width");
  expect_refused(kHead + "[camera]\n" + kSensor + "pedestal = 64\n[projector]\n", "9", "");
}

TEST(RigFile, a_log_knows_a_rig_by_what_changes_its_photographs) {
  const auto text = [](const std::string& camera, const std::string& capture) {
    return parse(kHead + "[camera]\n" + camera + kSensor + "[projector]\n[capture]\n" + capture)->identity();
  };
  const std::string plain = text("", "");
  EXPECT_EQ(plain, text("patience = \"3 s\"\n", "retakes = 9\ndevice_patience = \"1 s\"\n"));
  EXPECT_NE(plain, text("binning = 2\n", ""));
  EXPECT_NE(plain, text("controls = { gain = 4 }\n", ""));
  EXPECT_NE(plain, text("", "exposures = 3\n"));
  EXPECT_EQ(plain.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace symrig::rig_file_test
