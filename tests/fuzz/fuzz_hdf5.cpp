// SPDX-License-Identifier: Apache-2.0
// HDF5 files with any numbers in their structures, and right checksums: read, or refused in one line.
#include "fuzz/structured/mutators.hpp"
#include "symrig/base/files.hpp"
#include "symrig/sim/dense_rig.hpp"
#include "symrig/tensor/file.hpp"
#include "targets.hpp"
#include "unit/tensor/small_camera.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <sys/mman.h>
#include <unistd.h>

namespace symrig::fuzz {
namespace {

using structured::Hdf5Change;
using structured::Hdf5File;

StoredScene scene() {
  TensorBuilder builder(BlockTree(Grid{3, 4}), 1);
  builder.add_leaf(0, 6, 6, 12, 1, 1, std::vector<float>(12, 0.5F));
  builder.add_scalar(2, 2, std::vector<float>{1});
  StoredScene stored{std::move(builder).finish(), "{}", {}, {}};
  stored.camera = std::make_shared<const CameraTransport>(
      *CameraTransport::make(test::small_camera(1, stored.tensor.projector_tree())));
  for (int k = 0; k < 10; ++k)  // more than an object header holds
    stored.held_out.push_back(
        {std::to_string(k), Image<float>(Grid{3, 4}, 1, 0.5F), Image<float>(Grid{3, 4}, 1, 0.5F)});
  return stored;
}

std::vector<Hdf5File> make_files() {
  std::string folder = std::filesystem::temp_directory_path() / "symrig-fuzz-XXXXXX";
  require(mkdtemp(folder.data()) != nullptr, "there is a folder for temporary files");
  std::vector<Hdf5File> files = structured::matrix_files(folder);
  const std::filesystem::path file = std::filesystem::path(folder) / "scene.h5";
  require(save_scene(file, scene()).ok(), "a scene can be saved");
  files.push_back(structured::whole_file(file));
  files.push_back(structured::in_older_layout(file, folder));
  std::filesystem::remove_all(folder);
  return files;
}

template <class T>
void expect_one_line(const Result<T>& result) {
  require(result.ok() || result.error().line().find('\n') == std::string::npos, "an error is one line");
}

}  // namespace

/// The first byte chooses a file. Then come changes: two bytes for the place, one for the size, eight for the
/// number.
void fuzz_hdf5(const std::uint8_t* data, std::size_t size) {
  static const std::vector<Hdf5File> files = make_files();
  if (size == 0) return;
  std::vector<Hdf5Change> changes;
  for (std::size_t at = 1; at + 11 <= size && changes.size() < 16; at += 11) {
    Hdf5Change change{data[at] + 256U * data[at + 1], 1U + data[at + 2] % 8U, 0};
    std::memcpy(&change.number, data + at + 3, sizeof change.number);
    changes.push_back(change);
  }
  const std::string bytes = files[data[0] % files.size()].changed(changes);
  const Fd memory(memfd_create("hdf5", MFD_CLOEXEC));
  require(::write(memory.get(), bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()),
          "memory takes a file");
  const std::string path = "/proc/self/fd/" + std::to_string(memory.get());
  expect_one_line(load_scene(path));
  expect_one_line(read_dense({path}));
}

}  // namespace symrig::fuzz
