// SPDX-License-Identifier: Apache-2.0
// A matrix becomes a tensor: its errors, its size, and what is refused.
#include "command.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <functional>

#include <fmt/format.h>

namespace symrig::test::import_test {
namespace {

class Import : public CommandTest {
 protected:
  /// T of a captured scene, as a matrix.
  void write_matrix(const std::string& file) {
    capture_small(kSmall);
    ASSERT_EQ(symrig({"export", "scene.h5", "--dense", file}).code, 0);
  }
};

TEST_F(Import, compresses_a_matrix_and_compares) {
  write_matrix("T.mat");  // which states its grid
  const Outcome outcome = symrig({"import", "T.mat", "-o", "new.h5", "--json", "import.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("times smaller than the matrix"), std::string::npos) << outcome.out;
  const nlohmann::json facts = json("import.json");
  EXPECT_EQ(facts.at("command"), "import");
  EXPECT_EQ(facts.at("noise"), "off");
  EXPECT_LT(facts.at("error").at("frobenius").get<double>(), 0.02);
  EXPECT_GT(facts.at("error").at("frobenius").get<double>(), 0);
  EXPECT_GT(facts.at("matrix_bytes"), facts.at("tensor_bytes"));
  // The same in two steps.
  ASSERT_EQ(
      symrig({"capture", "--rig", "dense:T.mat", "--no-log", "-o", "two.h5", "--json", "two.json"}).code, 0);
  EXPECT_EQ(json("two.json").at("patterns"), facts.at("patterns"));
  ASSERT_EQ(symrig({"evaluate", "two.h5", "--rig", "dense:T.mat", "--json", "errors.json"}).code, 0);
  EXPECT_EQ(json("errors.json").at("error"), facts.at("error"));
}

// Blocks across views need fewer photographs than a picture that is cut without regard to them.
TEST_F(Import, views_are_as_stated) {
  capture_small("sim:views2?size=16x16&noise=off");
  ASSERT_EQ(symrig({"export", "scene.h5", "--dense", "T.npy"}).code, 0);
  const auto patterns = [this](const std::vector<std::string>& more) {
    std::vector<std::string> words{"import", "T.npy", "-o", "new.h5", "--json", "import.json"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = symrig(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return json("import.json").at("patterns").get<int>();
  };
  EXPECT_LT(patterns({"--views", "2x2"}), patterns({}));
  EXPECT_EQ(patterns({"--grid", "16x16", "--views", "1x1"}), patterns({"--grid", "16x16"}));
  EXPECT_EQ(symrig({"relight", "new.h5", "--light", "white", "--from-view", "0,1", "-o", "out.pfm"}).code,
            kUsage)
      << "a tensor of one view";
  patterns({"--views", "2x2"});
  EXPECT_EQ(symrig({"relight", "new.h5", "--light", "white", "--from-view", "0,1", "-o", "out.pfm"}).code, 0);
  expect_refusal({"import", "T.npy", "-o", "other.h5", "--views", "17x1"}, kUsage, {"17x1", "16x16"});
  expect_refusal({"import", "T.npy", "-o", "other.h5", "--views", "two"}, kUsage, {"views=two"});
}

/// A .npy file of n x n random numbers; symmetric, or not.
void write_random(const std::filesystem::path& path, std::size_t n, bool symmetric) {
  std::vector<float> values(n * n);
  symrig::Random rng(1);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      values[i * n + j] = symmetric && j < i ? values[j * n + i] : static_cast<float>(rng.uniform());
  std::string head = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({0}, {0}), }}", n);
  head.append(117 - head.size(), ' ');
  std::ofstream file(path, std::ios::binary);
  file << std::string("\x93NUMPY\x01\0\x76\0", 10) << head << '\n';
  file.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(float)));
}

// A search that ends in brute force would give a tensor that is no smaller than the matrix.
TEST_F(Import, a_matrix_that_is_not_data_sparse_is_refused_with_the_evidence) {
  write_random(path("random.npy"), 256, true);
  expect_refusal({"import", "random.npy", "-o", "new.h5", "--json", "import.json"}, kBadInput,
                 {"not data-sparse", "256 columns", "nodes are leaves", "unexplained", "--algorithm brute"});
  const Outcome outcome =
      symrig({"import", "random.npy", "-o", "new.h5", "--json", "import.json", "--algorithm", "brute"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  // Brute force measures each column, and rounds it to 32-bit floats.
  EXPECT_LT(json("import.json").at("error").at("flood").get<double>(), 1e-5);
  EXPECT_LT(json("import.json").at("error").at("frobenius").get<double>(), 1e-5);
}

TEST_F(Import, what_cannot_be_imported_is_refused) {
  write_random(path("T.npy"), 96, false);
  expect_refusal({"import", "T.npy", "--grid", "8x12", "-o", "new.h5"}, kBadInput,
                 {"not symmetric", "algorithm brute"});
  EXPECT_EQ(symrig({"import", "T.npy", "--grid", "8x12", "--algorithm", "brute", "-o", "new.h5"}).code, 0);
  expect_refusal({"import", "T.npy", "-o", "other.h5"}, kBadInput, {"(96, 96)", "grid=ROWSxCOLS"});
  expect_refusal({"import", "T.npy", "--grid", "8", "-o", "other.h5"}, kUsage, {"grid=8"});
  expect_refusal({"import", "none.npy", "-o", "other.h5"}, kBadInput, {"none.npy"});
  std::ofstream(path("text.mat")) << "text";
  expect_refusal({"import", "text.mat", "--grid", "8x12", "-o", "other.h5"}, kBadInput,
                 {"text.mat", "neither"});
}

// The 42 real photographs, where they are (SYMRIG_PHOTOGRAPHS in the environment, or as configured): what the
// command says of them, and of folders in which something is wrong with them. They are linked, never copied;
// a picture that is altered is written to the test's own folder.

class RealFolder : public CommandTest {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("SYMRIG_PHOTOGRAPHS");  // NOLINT(concurrency-mt-unsafe): no threads here
    const std::filesystem::path from = folder ? folder : SYMRIG_PHOTOGRAPHS;
    if (!std::filesystem::is_directory(from))
      GTEST_SKIP() << "no photographs in " << from << "; set SYMRIG_PHOTOGRAPHS to their folder";
    std::filesystem::create_directory(path("photographs"));
    for (int k = 0; k < kAll; ++k) {
      sources_.push_back(std::filesystem::absolute(from / name(k)));
      link(k, k);
    }
  }

  static constexpr int kAll = 42, kWhite = 40, kBlack = 41;

  static std::string name(int k) { return fmt::format("graycode_{:02}.png", k); }
  std::filesystem::path at(int k) const { return path("photographs") / name(k); }
  /// Photograph k becomes a link to the real one of another number.
  void link(int k, int source) const {
    std::filesystem::remove(at(k));
    std::filesystem::create_symlink(sources_[source], at(k));
  }
  /// Photograph k becomes a changed copy, of the same number.
  void alter(int k, const std::function<float(const Image<float>&, int row, int col)>& value) const {
    const auto image = read_image(at(k));
    ASSERT_TRUE(image.ok()) << image.error().line();
    Image<float> changed(image->grid());
    for (int r = 0; r < changed.grid().rows; ++r)
      for (int c = 0; c < changed.grid().cols; ++c) changed.at(r, c) = value(*image, r, c);
    std::filesystem::remove(at(k));
    ASSERT_TRUE(write_image(path("photographs") / fmt::format("graycode_{:02}.pfm", k), changed).ok());
  }
  void is_refused(const std::vector<std::string>& words) const {
    expect_refusal({"calibrate", "--from", "photographs"}, kBadInput, words);
  }

 private:
  std::vector<std::filesystem::path> sources_;
};

// The bar of every stripe width from 8 px on; the pair is the one that fit chooses.
TEST_F(RealFolder, predicts_a_pair_that_the_fit_has_not_seen) {
  const Outcome outcome = symrig({"fit", "--from", "photographs", "-o", "real.h5", "--json", "f.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto figures = json("f.json");
  ASSERT_EQ(figures.at("held_out").size(), 2U);
  for (const auto& held_out : figures.at("held_out")) EXPECT_LE(held_out.at("relative").get<double>(), 0.06);
  const Outcome report = symrig({"report", "real.h5", "-o", "real.html"});
  EXPECT_EQ(report.code, 0) << report.err;
}

TEST_F(RealFolder, a_missing_photograph_is_named) {
  std::filesystem::remove(at(7));
  is_refused({"has 41 photographs", "between graycode_06.png and graycode_08.png there is a gap"});
}

TEST_F(RealFolder, a_missing_pair_is_named) {
  std::filesystem::remove(at(22));
  std::filesystem::remove(at(23));
  is_refused({"has 40 photographs", "between graycode_21.png and graycode_24.png there is a gap"});
}

TEST_F(RealFolder, a_missing_black_photograph_is_named) {
  std::filesystem::remove(at(kBlack));
  is_refused({"graycode_40.png, is the white one", "the black one is missing"});
}

TEST_F(RealFolder, a_black_photograph_that_is_lit_is_named) {
  link(kBlack, 30);
  is_refused({"graycode_41.png (black) is lit"});
}

TEST_F(RealFolder, a_saturated_white_photograph_is_named) {
  alter(kWhite, [](const Image<float>& white, int r, int c) { return std::min(1.0F, 2 * white.at(r, c)); });
  is_refused({"graycode_40.pfm (white) is saturated"});
}

TEST_F(RealFolder, a_camera_that_moved_by_a_pixel_is_named_with_the_place) {
  for (int k = 0; k < 6; ++k)
    alter(k, [](const Image<float>& image, int r, int c) { return image.at(r, std::max(c - 1, 0)); });
  is_refused({"has moved between graycode_04.pfm and graycode_06.png"});
}

TEST_F(RealFolder, a_photograph_of_another_pattern_is_named) {
  link(13, 15);
  is_refused({"graycode_12.png and graycode_13.png (columns, 16 px) do not add up"});
}

class RealSwappedPair : public RealFolder, public testing::WithParamInterface<int> {};

TEST_P(RealSwappedPair, is_named) {
  const int first = 2 * GetParam();
  link(first, first + 1);
  link(first + 1, first);
  is_refused({name(first) + " and " + name(first + 1), "swapped"});
}
// Ten pairs of columns, ten of rows; the coarsest of each shows in the map's orientation only.
INSTANTIATE_TEST_SUITE_P(Pairs, RealSwappedPair, testing::Values(0, 1, 4, 7, 9, 10, 11, 14, 17, 19));

}  // namespace
}  // namespace symrig::test::import_test
