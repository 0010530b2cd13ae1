// SPDX-License-Identifier: Apache-2.0
// A matrix becomes a tensor: its errors, its size, and what is refused.
#include "command.hpp"
#include "symrig/base/statistics.hpp"

#include <fstream>

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

}  // namespace
}  // namespace symrig::test::import_test
