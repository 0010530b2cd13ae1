// SPDX-License-Identifier: Apache-2.0
#include "matrix_for_c.h"
#include "symrig/acquisition/capture.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <stdexcept>
#include <vector>

namespace symrig::matrix_probe {
namespace {

class MatrixProbe final : public Probe {
 public:
  Grid grid() const override { return {kMatrixSide, kMatrixSide}; }
  int channels() const override { return 1; }
  ProbeCost cost() const override { return {taken_, taken_}; }
  std::string describe() const override { return "matrix"; }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    SYMRIG_CHECK(check_patterns(*this, patterns));
    std::vector<Radiance> photographs;
    for (const Pattern& pattern : patterns) {
      Radiance one{Image<float>(grid()), Image<float>(grid()), Image<std::uint8_t>(grid(), 1, 1)};
      matrix_photograph(pattern.values().data(), one.mean.values().data());
      photographs.push_back(std::move(one));
      ++taken_;
    }
    return photographs;
  }

 private:
  std::int64_t taken_ = 0;
};

bool equal(const Leaf& a, const Leaf& b) {
  return a.row_begin == b.row_begin && a.row_end == b.row_end && a.col_begin == b.col_begin &&
         a.col_end == b.col_end && a.rank == b.rank && a.level == b.level;
}

bool equal(const BandLeaf& a, const BandLeaf& b) {
  return a.radius == b.radius && a.values == b.values;
}

bool equal(const ScalarLeaf& a, const ScalarLeaf& b) {
  return a.row == b.row && a.col == b.col;
}

bool equal(const EmptyLeaf& a, const EmptyLeaf& b) {
  return a.row_block == b.row_block && a.col_block == b.col_block;
}

template <class List>
bool all_equal(const List& a, const List& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& one, const auto& other) { return equal(one, other); });
}

bool same_empties(const TransportTensor& a, const TransportTensor& b) {
  for (int level = 0; level < a.levels(); ++level)
    if (!all_equal(a.empties(level), b.empties(level))) return false;
  return a.levels() == b.levels();
}

bool same(const TransportTensor& a, const TransportTensor& b) {
  return a.camera_grid() == b.camera_grid() && a.symmetric() == b.symmetric() &&
         all_equal(a.leaves(), b.leaves()) && *a.factors() == *b.factors() &&
         all_equal(a.scalars(), b.scalars()) && a.scalar_values() == b.scalar_values() &&
         all_equal(a.bands(), b.bands()) && same_empties(a, b);
}

}  // namespace
}  // namespace symrig::matrix_probe

int capture_by_probe(const char* path) {
  symrig::matrix_probe::MatrixProbe probe;
  const auto captured = symrig::capture(probe, {});
  if (!captured) return 1;
  return symrig::save_scene(path, {captured->tensor, "{}", captured->held_out}) ? 0 : 2;
}

int throwing_measure(symrig_batch* /*batch*/, void* /*user*/) {
  throw std::runtime_error("thrown by a callback");
}

int throwing_progress(const symrig_capture_progress* /*at*/, void* /*user*/) {
  throw 7;  // NOLINT(hicpp-exception-baseclass): any value can be thrown
}

int same_tensor(const char* one, const char* other) {
  const auto a = symrig::load_scene(one), b = symrig::load_scene(other);
  if (!a || !b || a->tensor.leaves().empty() || a->tensor.scalar_values().empty()) return -1;
  return symrig::matrix_probe::same(a->tensor, b->tensor) ? 1 : 0;
}
