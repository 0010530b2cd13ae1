// SPDX-License-Identifier: Apache-2.0
// Many lights: a folder or a film of lights becomes a folder or a film of pictures.
#include "command.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/y4m.hpp"
#include "symrig/job/relight.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

namespace symrig::test::relight_lights_test {
namespace {

constexpr Grid kGrid{12, 17};

/// A light of its own for each number.
Image<float> light_of(int number) {
  Image<float> light(kGrid);
  for (std::size_t i = 0; i < light.values().size(); ++i)
    light.values()[i] = static_cast<float>((i * 7 + static_cast<std::size_t>(number) * 13) % 61) / 61;
  return light;
}

class RelightLights : public CommandTest {
 protected:
  void SetUp() override {
    capture_small(fmt::format("{}&channels=3", kSmall));
    std::filesystem::create_directory(path("lights"));
  }

  /// Lights "00.pfm", "01.pfm", ...
  void write_lights(int count) const {
    for (int k = 0; k < count; ++k)
      ASSERT_TRUE(write_image(path(fmt::format("lights/{:02}.pfm", k)), light_of(k)).ok());
  }
  TransportTensor tensor() const { return std::move(load_scene(path("scene.h5")).value().tensor); }
  Image<float> picture(const std::string& name) const { return read_image(path(name)).value(); }
  /// Names in a folder, without what says how they were made.
  std::set<std::string> pictures(const std::string& folder) const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path(folder)))
      if (entry.path().filename() != "relight.json") names.insert(entry.path().filename().string());
    return names;
  }
};

// Two sums of the same terms in another order: at most twice the bound of TransportTensor::apply apart. All
// terms are positive here, so that bound is a share of the value: (|J| + leaves + 4) ε, |J| ≤ 204 pixels and
// fewer leaves than that on a pixel's path.
TEST_F(RelightLights, each_picture_is_that_of_its_light) {
  write_lights(19);
  write_text(path("lights/notes.txt"), "no light");
  const Outcome outcome = symrig({"relight", "scene.h5", "--lights", "lights", "-o", "pictures"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "pictures: 19 pictures, 12x17, 3 channels\n");
  EXPECT_EQ(pictures("pictures").size(), 19U);
  const TransportTensor scene = tensor();
  for (const int k : {0, 15, 16, 18}) {
    const std::string name = fmt::format("pictures/{:02}.exr", k);
    const Image<float> seen = picture(name), expected = scene.apply(light_of(k)).value();
    ASSERT_EQ(seen.grid(), expected.grid());
    for (std::size_t i = 0; i < seen.values().size(); ++i)
      EXPECT_NEAR(seen.values()[i], expected.values()[i],
                  2 * (2.0 * kGrid.size() + 4) * 0x1p-24 * static_cast<double>(expected.values()[i]) + 1e-12);
    const PictureFacts facts = read_picture_facts(path(name)).value();
    EXPECT_EQ(facts.light, fmt::format("{:02}", k));
    EXPECT_EQ(facts.scene, file_hash(path("scene.h5")).value());
  }
}

TEST_F(RelightLights, a_film_becomes_a_film_with_one_exposure) {
  {
    auto film = Y4mWriter::begin(path("walk.y4m"), kGrid, 1, {30, 1});
    for (int k = 0; k < 18; ++k)
      ASSERT_TRUE(film->add(Image<std::uint8_t>(kGrid, 1, static_cast<std::uint8_t>(10 * k))).ok());
    ASSERT_TRUE(film->finish().ok());
  }
  const Outcome outcome =
      symrig({"relight", "scene.h5", "--lights", "walk.y4m", "-o", "seen.y4m", "--exposure", "0.5"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "seen.y4m: 18 pictures, 12x17, 3 channels, exposure 0.5\n");
  const auto seen = Y4mReader::open(path("seen.y4m"));
  ASSERT_TRUE(seen.ok()) << seen.error().line();
  ASSERT_EQ(seen->frames(), 18U);
  EXPECT_EQ(seen->rate().frames, 30);
  const TransportTensor scene = tensor();
  for (const std::size_t k : {1U, 17U}) {
    const Image<float> light(kGrid, 1, static_cast<float>(k) * 10 / 255);
    const Image<std::uint8_t> codes = to_display(scene.apply(light).value(), 0.5);
    const Image<float> luma = seen->luma(k).value();
    for (int i = 0; i < kGrid.size(); ++i) {
      const double expected =
          0.299 * codes.plane(0)[i] + 0.587 * codes.plane(1)[i] + 0.114 * codes.plane(2)[i];
      // Luma is rounded once, and each code may be another one by the last bits.
      EXPECT_NEAR(255 * static_cast<double>(luma.values()[i]), expected, 1.5 + 1e-4);
    }
  }
  // Frames in a folder get the film's name and their number.
  ASSERT_EQ(symrig({"relight", "scene.h5", "--lights", "walk.y4m", "-o", "frames", "--format", "png"}).code,
            0);
  EXPECT_EQ(*pictures("frames").begin(), "walk-00001.png");
  EXPECT_EQ(*pictures("frames").rbegin(), "walk-00018.png");
}

TEST_F(RelightLights, views_are_relit_as_one_by_one) {
  capture_small("sim:views2?size=12x18&noise=off");
  for (int k = 0; k < 3; ++k) {
    Image<float> light({6, 9});
    for (std::size_t i = 0; i < light.values().size(); ++i)
      light.values()[i] = static_cast<float>((i + k) % 5) / 4;
    ASSERT_TRUE(write_image(path(fmt::format("lights/{}.pfm", k)), light).ok());
  }
  const std::vector<std::string> views{"--from-view", "0,1", "--to-view", "1,0"};
  std::vector<std::string> many{"relight", "scene.h5", "--lights", "lights",
                                "-o",      "pictures", "--format", "pfm"};
  many.insert(many.end(), views.begin(), views.end());
  ASSERT_EQ(symrig(many).code, 0);
  std::vector<std::string> one{"relight", "scene.h5", "--light", "lights/2.pfm", "-o", "one.pfm"};
  one.insert(one.end(), views.begin(), views.end());
  ASSERT_EQ(symrig(one).code, 0);
  const Image<float> a = picture("pictures/2.pfm"), b = picture("one.pfm");
  ASSERT_EQ(a.grid(), b.grid());
  for (std::size_t i = 0; i < a.values().size(); ++i)
    EXPECT_NEAR(a.values()[i], b.values()[i],
                2 * (2.0 * 12 * 18 + 4) * 0x1p-24 * static_cast<double>(b.values()[i]) + 1e-12);
}

// A call that stops, and one that goes on, leave what one call leaves. Pictures that are there stay
// untouched; one whose light has changed, or that is missing, is made again.
TEST_F(RelightLights, a_stopped_call_is_resumed) {
  write_lights(18);
  const std::vector<std::string> words{"relight", "scene.h5", "--lights", "lights", "-o", "pictures"};
  ASSERT_EQ(symrig(words).code, 0);
  std::vector<Image<float>> whole;
  whole.reserve(18);
  for (int k = 0; k < 18; ++k) whole.push_back(picture(fmt::format("pictures/{:02}.exr", k)));

  std::filesystem::remove(path("pictures/03.exr"));
  ASSERT_TRUE(write_image(path("lights/05.pfm"), light_of(40)).ok());
  const auto before = std::filesystem::last_write_time(path("pictures/04.exr"));
  expect_refusal(words, kUsage, {"pictures has pictures already", "--resume"});
  std::vector<std::string> resumed = words;
  resumed.emplace_back("--resume");
  const Outcome outcome = symrig(resumed);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "pictures: 18 pictures, 12x17, 3 channels, 16 of them from before\n");
  EXPECT_EQ(std::filesystem::last_write_time(path("pictures/04.exr")), before);
  for (int k = 0; k < 18; ++k) {
    const Image<float> seen = picture(fmt::format("pictures/{:02}.exr", k));
    EXPECT_EQ(seen == whole[k], k != 5) << k;
  }
}

TEST_F(RelightLights, a_job_that_is_told_to_stop_leaves_whole_pictures) {
  write_lights(40);
  const Relighter relighter = Relighter::begin(tensor(), {}).value();
  const LightSequence lights = LightSequence::open(path("lights"), kGrid, "the projector").value();
  SequenceOutput output;
  output.path = path("pictures");
  output.asked = "format exr";
  output.facts.scene = file_hash(path("scene.h5")).value();
  const auto stop = [](const ProgressEvent& event) { return event.done < 32; };
  const auto stopped = relight_sequence(relighter, lights, output, stop);
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::interrupted);
  EXPECT_NE(stopped.error().line().find("32 of 40 pictures"), std::string::npos) << stopped.error().line();
  EXPECT_EQ(pictures("pictures").size(), 32U);
  const Outcome resumed = symrig({"relight", "scene.h5", "--lights", "lights", "-o", "pictures", "--resume"});
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_NE(resumed.out.find("40 pictures"), std::string::npos);
  EXPECT_NE(resumed.out.find("32 of them from before"), std::string::npos);

  output.path = path("seen.y4m");
  EXPECT_EQ(relight_sequence(relighter, lights, output, stop).error().code, ErrorCode::interrupted);
  EXPECT_FALSE(std::filesystem::exists(path("seen.y4m")));
}

TEST_F(RelightLights, what_another_scene_or_request_made_is_not_resumed) {
  write_lights(2);
  ASSERT_EQ(symrig({"relight", "scene.h5", "--lights", "lights", "-o", "pictures", "--format", "png"}).code,
            0);
  const auto resume = [](const std::vector<std::string>& more) {
    std::vector<std::string> words{"relight", "scene.h5", "--lights", "lights", "-o", "pictures", "--resume"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  expect_refusal(resume({"--format", "pfm"}), kUsage, {"another request"});
  expect_refusal(resume({"--format", "png", "--exposure", "2"}), kUsage, {"another exposure"});
  capture_small(kSmall);
  expect_refusal(resume({"--format", "png"}), kUsage, {"another scene"});
  write_text(path("pictures/relight.json"), "{\"scene\": 3}");
  expect_refusal(resume({"--format", "png"}), kBadInput, {"relight.json", "not a list"});
}

TEST_F(RelightLights, wrong_folders_and_lights_are_named) {
  const auto with = [](const std::vector<std::string>& more) {
    std::vector<std::string> words{"relight", "scene.h5"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  expect_refusal(with({"--lights", "lights", "-o", "out"}), kUsage, {"lights has no picture"});
  expect_refusal(with({"--lights", "nothing", "-o", "out"}), kBadInput, {"no folder or film nothing"});
  write_lights(2);
  expect_refusal(with({"--lights", "lights", "--light", "white", "-o", "out"}), kUsage, {"both"});
  expect_refusal(with({"-o", "out.exr"}), kUsage, {"--light"});
  expect_refusal(with({"--lights", "lights", "-o", "lights"}), kUsage, {"is the same file as --lights"});
  expect_refusal(with({"--lights", "lights", "-o", "no/out"}), kBadInput, {"no/out"});
  expect_refusal(with({"--lights", "lights", "-o", "scene.h5"}), kUsage, {"scene.h5", "is an input"});
  expect_refusal(with({"--lights", "lights", "-o", "out.exr"}), kUsage, {"-o writes a folder"});
  expect_refusal(with({"--lights", "lights", "-o", "lights/00.pfm"}), kUsage,
                 {"lights/00.pfm", "not a folder"});
  expect_refusal(with({"--lights", "lights", "-o", "out", "--format", "tif"}), kUsage, {".tif"});
  expect_refusal(with({"--lights", "lights", "-o", "out.y4m", "--format", "png"}), kUsage, {"--format"});
  expect_refusal(with({"--lights", "lights", "-o", "out.y4m", "--resume"}), kUsage, {"--resume"});
  expect_refusal(with({"--lights", "lights", "-o", "out", "--exposure", "2"}), kUsage, {"--exposure"});
  expect_refusal(with({"--light", "white", "-o", "out.exr", "--resume"}), kUsage, {"--resume"});
  expect_refusal(with({"--light", "white", "-o", "out.exr", "--format", "png"}), kUsage, {"--format"});
  ASSERT_TRUE(write_image(path("lights/00.png"), light_of(1)).ok());
  expect_refusal(with({"--lights", "lights", "-o", "out"}), kUsage, {"00.pfm", "00.png", "one name"});
  std::filesystem::remove(path("lights/00.png"));
  ASSERT_TRUE(write_image(path("lights/01.pfm"), Image<float>({3, 4})).ok());
  const Outcome outcome = symrig(with({"--lights", "lights", "-o", "out"}));
  EXPECT_EQ(outcome.code, kBadInput);
  for (const char* word : {"01.pfm", "3x4", "12x17"})
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
  write_text(path("film.y4m"), "YUV4MPEG2 W4 H3 Cmono\nFRAME\n123456789012");
  expect_refusal(with({"--lights", "film.y4m", "-o", "seen"}), kBadInput, {"film.y4m is 3x4", "12x17"});
}

}  // namespace
}  // namespace symrig::test::relight_lights_test
