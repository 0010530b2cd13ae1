// SPDX-License-Identifier: Apache-2.0
// HDF5 files whose structure is damaged, with right checksums: refused in one line, or read as what they now
// are.
#include "campaign.hpp"
#include "mutators.hpp"
#include "scratch.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/dense_rig.hpp"
#include "symrig/tensor/file.hpp"
#include "tensor/h5_file.hpp"
#include "unit/calibration/small_registration.hpp"
#include "unit/tensor/random_tensor.hpp"
#include "unit/tensor/small_camera.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <sys/wait.h>

namespace symrig::structured::structured_hdf5_test {
namespace {

namespace fs = std::filesystem;
namespace h5 = tensor::h5;

template <class T>
void expect_one_line(const Result<T>& result) {
  if (result.ok()) return;
  const std::string line = result.error().line();
  EXPECT_TRUE(exit_code(result.error().code) == 4 || result.error().code == ErrorCode::limit) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  EXPECT_NE(line.find("mutated"), std::string::npos) << line;
}

/// Reads whatever the file has: all groups, attributes and numbers.
void read_everything(const h5::Object& object, int depth) {
  if (depth > 4) return;
  if (object.is_dataset()) {
    const auto set = h5::Dataset::open(object);
    constexpr std::uint64_t kMost = 1 << 20;
    if (!set || h5::count(set->shape()) > kMost) return;
    std::vector<double> values(h5::count(set->shape()));
    const std::uint64_t rows = set->shape().empty() ? 1 : set->shape()[0];
    (void)set->read(0, rows, h5::conversion<double>(), values.data(), values.size());
    return;
  }
  for (const char* name : {"text", "name 3", "name 11", "format", "capture"}) {
    (void)h5::read_text(object, name);
    (void)h5::read_integers(object, name, 1);
  }
  const auto names = object.names();
  for (std::size_t k = 0; names && k < std::min<std::size_t>(names->size(), 40); ++k)
    if (const auto found = object.find((*names)[k]); found && *found) read_everything(**found, depth + 1);
}

/// A command may refuse pictures of two channels, and matrices of more than one, for what they are.
StoredScene small_scene(int channels) {
  StoredScene scene;
  scene.tensor =
      tests::RandomTensor({5, 6}, {}, true, channels, 3, 0.1).with_band(true).make(2, 2, 12).tensor;
  for (int k = 0; k < 10; ++k) {
    HeldOut held{"pair " + std::to_string(k), Image<float>(scene.tensor.projector_grid(), 1, 0.5F), {}};
    held.photograph = *scene.tensor.apply(held.pattern);
    scene.held_out.push_back(std::move(held));
  }
  scene.camera = std::make_shared<const CameraTransport>(
      *CameraTransport::make(test::small_camera(channels, scene.tensor.projector_tree())));
  return scene;
}

class StructuredHdf5 : public testing::Test {
 protected:
  /// Mutates `whole`; `read` reads the file and returns whether it could.
  template <class Read>
  void mutate(const Hdf5File& whole, Read read) {
    int refused = 0, good = 0;
    campaign([&](std::uint64_t number) {
      Random random(number);
      write(whole.mutated(random));
      read() ? ++good : ++refused;
    });
    if (std::getenv("SYMRIG_CASE") != nullptr) return;
    EXPECT_GT(refused, 20);
    EXPECT_GT(good, 20);
  }
  void write(const std::string& bytes) const { std::ofstream(file_, std::ios::binary) << bytes; }
  bool read_scene() const {
    const auto scene = load_scene(file_);
    expect_one_line(scene);
    if (scene.ok()) {
      const Image<float> white(scene->tensor.projector_grid(), 1, 1.0F);
      EXPECT_TRUE(scene->tensor.apply(white).ok());
      EXPECT_TRUE(!scene->camera || scene->camera->apply(white).ok());
    }
    return scene.ok();
  }
  bool read_matrix() const {
    const auto matrix = read_dense({file_});
    expect_one_line(matrix);
    for (std::size_t k = 0; matrix.ok() && k < matrix->values.size(); ++k)
      EXPECT_TRUE(std::isfinite(matrix->values[k]));
    constexpr h5::FileWords kWords{"a file", "name one", "make one", "make it again"};
    if (const auto root = h5::open_file(file_, kWords)) read_everything(*root, 0);
    return matrix.ok();
  }

  test::Scratch folder_;
  const fs::path file_ = folder_ / "mutated.h5";
};

TEST_F(StructuredHdf5, scenes_are_refused_in_one_line_or_read) {
  const fs::path original = folder_ / "whole.h5";
  ASSERT_TRUE(save_scene(original, small_scene(2)).ok());
  for (const Hdf5File& whole : {whole_file(original), in_older_layout(original, folder_.folder())}) {
    write(whole.changed({}));
    ASSERT_TRUE(read_scene());
    ASSERT_EQ(whole.changed({}), whole.bytes());
    ASSERT_GT(whole.structures().size(), 20U);
    mutate(whole, [this] { return read_scene(); });
  }
}

TEST_F(StructuredHdf5, registrations_are_refused_in_one_line_or_read) {
  const fs::path original = folder_ / "whole.h5";
  ASSERT_TRUE(save_registration(original, tests::small_registration()).ok());
  mutate(whole_file(original), [this] {
    const auto registration = load_registration(file_);
    expect_one_line(registration);
    return registration.ok();
  });
}

TEST_F(StructuredHdf5, matrices_are_refused_in_one_line_or_read) {
  for (const Hdf5File& whole : matrix_files(folder_.folder())) {
    write(whole.bytes());
    ASSERT_TRUE(read_matrix());
    mutate(whole, [this] { return read_matrix(); });
  }
}

#ifdef SYMRIG_COMMAND
/// Everything that a command reads as HDF5. FILE stands for the file, and outputs have the name "out".
const std::vector<std::string> kCommands{
    "inspect FILE",
    "relight FILE --light white -o out.exr",
    "dual FILE --light white -o out.exr",
    "evaluate FILE --rig 'sim:plane?size=5x6'",
    "report FILE -o out.html",
    "export FILE --dense out.npy",
    "view FILE --export out.html",
    "import FILE -o out.h5",
    "capture --rig dense:FILE -o out.h5",
    "capture --rig 'sim:plane?size=5x6&camera=24x28' --registration FILE -o out.h5",
};

/// 20 s of processor time end a command that hangs.
void expect_done_or_refused(const fs::path& folder, std::string arguments) {
  arguments.replace(arguments.find("FILE"), 4, "mutated.h5");
  const std::string command = "cd '" + folder.string() + "' && ulimit -t 20 && '" SYMRIG_COMMAND "' " +
                              arguments + " > out.txt 2> err.txt";
  const int status = std::system(command.c_str());  // NOLINT(cert-env33-c): the shell sets the limit
  ASSERT_TRUE(WIFEXITED(status)) << arguments;
  std::ifstream in(folder / "err.txt");
  const std::string error(std::istreambuf_iterator<char>(in), {});
  if (WEXITSTATUS(status) == 0) return;
  EXPECT_TRUE(WEXITSTATUS(status) == 4 || WEXITSTATUS(status) == 5)
      << WEXITSTATUS(status) << " " << arguments << error;
  EXPECT_EQ(error.find('\n'), error.size() - 1) << arguments << "\n" << error;
}

// Each file by one command in turns; in a campaign, 200 files by all.
TEST_F(StructuredHdf5, commands_refuse_in_one_line_or_work) {
  const bool all = std::getenv("SYMRIG_LONG") != nullptr;
  const fs::path original = folder_ / "whole.h5";
  ASSERT_TRUE(save_scene(original, small_scene(1)).ok());
  std::vector<Hdf5File> whole = matrix_files(folder_.folder());
  whole.push_back(whole_file(original));
  whole.push_back(in_older_layout(original, folder_.folder()));
  for (std::uint64_t number = 0; number < (all ? 200 : 30); ++number) {
    SCOPED_TRACE("file " + std::to_string(number));
    Random random(70'000 + number);
    write(whole[number % whole.size()].mutated(random));
    for (std::size_t k = 0; k < kCommands.size(); ++k)
      if (all || k == number / whole.size() % kCommands.size())
        expect_done_or_refused(folder_.folder(), kCommands[k]);
    if (HasFailure()) return;
  }
}
#endif

}  // namespace
}  // namespace symrig::structured::structured_hdf5_test
