// SPDX-License-Identifier: Apache-2.0
// benchmark_hmat: one symmetric T of 4096 pixels (two facing planes with albedo, one bounce of light between
// them, and the direct light on the diagonal) as a tensor and as an H-matrix of hmat-oss; error, bytes and
// time of one apply side by side, one thread, processor time. JSON lines on standard output. Run it with
// OPENBLAS_NUM_THREADS=1, so that the threads of hmat-oss's BLAS do not count against it.
#include "symrig/base/statistics.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/SVD>
#include <hmat/hmat.h>
#include <tbb/global_control.h>

namespace {

using namespace symrig;
using Matrix = Eigen::MatrixXd;

constexpr int kSide = 64, kPixels = kSide * kSide;

/// A V-groove of 90 degrees seen along its bisector: columns 0..31 on one plane, 32..63 on the other.
struct Scene {
  std::vector<double> points = std::vector<double>(std::size_t{3} * kPixels),
                      albedo = std::vector<double>(kPixels);
  bool with_diagonal = true;

  Scene() {
    Random random(7);
    for (int i = 0; i < kPixels; ++i) {
      const int from_middle = i % kSide - kSide / 2, row = i / kSide;
      const double from_edge = std::abs(from_middle + 0.5);
      double* const point = points.data() + 3 * std::ptrdiff_t{i};
      point[0] = left(i) ? from_edge : 0;
      point[1] = left(i) ? 0 : from_edge;
      point[2] = row;
      albedo[i] = 0.2 + 0.7 * random.uniform();
    }
  }
  static bool left(int i) { return i % kSide < kSide / 2; }
  /// T between raster pixels: Lambertian exchange ρ_i ρ_j cos cos / (π r²) off the diagonal.
  double operator()(int i, int j) const {
    if (i == j) return with_diagonal ? albedo[i] : 0.0;
    if (left(i) == left(j)) return 0;
    const double* const a = points.data() + 3 * std::ptrdiff_t{i};
    const double* const b = points.data() + 3 * std::ptrdiff_t{j};
    const double dx = a[0] - b[0], dy = a[1] - b[1], dz = a[2] - b[2], r2 = dx * dx + dy * dy + dz * dz;
    return albedo[i] * albedo[j] * std::abs(dx * dy) / (3.141592653589793 * r2 * r2);
  }
};

/// The cheapest partition into leaves and entries that keeps each block's relative error.
class Compression {
 public:
  Compression(const Scene& scene, double tolerance)
      : scene_(scene), tolerance_(tolerance), builder_(tree_, 1) {}

  TransportTensor run() {
    for (int i = 0; i < kPixels; ++i) {
      const int at = raster(i);
      builder_.add_scalar(i, i, std::vector<float>{static_cast<float>(scene_(at, at))});
    }
    const auto blocks = tree_.level(kFirst);
    for (int i = 0; i < std::ssize(blocks); ++i)
      for (int j = 0; j <= i; ++j) best(kFirst, i, j).keep();
    return std::move(builder_).finish();
  }

 private:
  static constexpr int kFirst = 2;  // blocks of 16 × 16 pixels
  struct Choice {
    double bytes;
    std::function<void()> keep;
  };

  int raster(int index) const { return tree_.order()[index]; }

  Matrix block(const Block& i, const Block& j) const {
    Matrix t(i.size(), j.size());
    for (int r = 0; r < i.size(); ++r) {
      for (int c = 0; c < j.size(); ++c) {
        const int row = raster(i.begin + r), col = raster(j.begin + c);
        t(r, c) = row == col ? 0 : scene_(row, col);
      }
    }
    return t;
  }

  Choice best(int level, int i, int j) {
    const Block bi = tree_.level(level)[i], bj = tree_.level(level)[j];
    const Matrix t = block(bi, bj);
    if (t.isZero(0)) return {1, [] {}};
    if (bi.size() == 1)
      return {8, [this, bi, bj, v = t(0, 0)] {
                builder_.add_scalar(bi.begin, bj.begin, std::vector<float>{static_cast<float>(v)});
              }};
    Choice whole = i == j ? Choice{1e30, [] {}} : leaf(t, bi, bj, level);
    if (whole.bytes < 2.0 * 5 * (bi.size() + bj.size())) return whole;  // rank 4 or less: parts cost more
    Choice parts{0, [] {}};
    for (int a = 0; a < bi.children; ++a) {
      for (int b = 0; b < bj.children; ++b) {
        if (i == j && b > a) continue;
        const Choice part = best(level + 1, bi.first_child + a, bj.first_child + b);
        parts.bytes += part.bytes;
        parts.keep = [before = parts.keep, now = part.keep] { before(), now(); };
      }
    }
    return parts.bytes < whole.bytes ? parts : whole;
  }

  /// Truncated singular value decomposition: A = U √S, B = V √S.
  Choice leaf(const Matrix& t, const Block& bi, const Block& bj, int level) {
    const Eigen::BDCSVD<Matrix> svd(t, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const Eigen::VectorXd& s = svd.singularValues();
    Eigen::Index rank = s.size();
    double tail = 0;
    while (rank > 1 && tail + s[rank - 1] * s[rank - 1] <= std::pow(tolerance_ * t.norm(), 2))
      tail += s[rank - 1] * s[rank - 1], --rank;
    const Eigen::VectorXd root = s.head(rank).cwiseSqrt();
    const Eigen::MatrixXf a = (svd.matrixU().leftCols(rank) * root.asDiagonal()).cast<float>(),
                          b = (svd.matrixV().leftCols(rank) * root.asDiagonal()).cast<float>();
    std::vector<float> factors(a.data(), a.data() + a.size());
    factors.insert(factors.end(), b.data(), b.data() + b.size());
    // 2 bytes a value; 24 a leaf and 12 a rank of index, and two panels.
    const double bytes = 2.0 * static_cast<double>(factors.size()) + 36 + 12.0 * static_cast<double>(rank);
    return {bytes, [this, bi, bj, rank, level, factors = std::move(factors)] {
              builder_.add_leaf(bi.begin, bi.end, bj.begin, bj.end, static_cast<int>(rank), level, factors);
            }};
  }

  const Scene& scene_;
  double tolerance_;
  BlockTree tree_ = BlockTree(Grid{kSide, kSide});
  TensorBuilder builder_;
};

double seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

template <class Work>
double best_ms(const Work& work) {
  double best = 1e9;
  for (int k = 0; k < 40; ++k) {
    const double start = seconds();
    for (int again = 0; again < 10; ++again) work();
    best = std::min(best, seconds() - start);
  }
  return 1e3 * best / 10;
}

struct Light {
  std::vector<float> p = std::vector<float>(kPixels);
  std::vector<double> exact = std::vector<double>(kPixels);

  explicit Light(const Scene& scene) {
    Random random(3);
    for (float& v : p) v = static_cast<float>(random.uniform());
    for (int i = 0; i < kPixels; ++i)
      for (int j = 0; j < kPixels; ++j) exact[i] += scene(i, j) * double{p[j]};
  }
  double error(std::span<const float> y) const {
    double e = 0, s = 0;
    for (std::size_t i = 0; i < exact.size(); ++i) {
      e += std::pow(exact[i] - double{y[i]}, 2);
      s += exact[i] * exact[i];
    }
    return std::sqrt(e / s);
  }
};

void print(const std::string& what, double error, double bytes, double ms) {
  std::printf("{\"what\": \"%s\", \"error\": %.2e, \"mb\": %.3f, \"ms\": %.4f}\n", what.c_str(), error,
              1e-6 * bytes, ms);
  static_cast<void>(std::fflush(stdout));
}

void run_tensor(const Scene& scene, const Light& light, double tolerance) {
  const TransportTensor tensor = Compression(scene, tolerance).run();
  Image<float> pattern(Grid{kSide, kSide});
  std::copy(light.p.begin(), light.p.end(), pattern.values().begin());
  const double error = light.error(tensor.apply(pattern)->values());
  print("symrig " + std::to_string(tolerance), error, static_cast<double>(tensor.bytes()),
        best_ms([&] { (void)tensor.apply(pattern); }));
}

struct Method {
  const char* name;
  hmat_compression_algorithm_t* (*create)(double);
};
constexpr Method kMethods[] = {{"ACA+", hmat_create_compression_aca_plus},
                               {"ACA full", hmat_create_compression_aca_full},
                               {"ACA partial", hmat_create_compression_aca_partial}};

struct Setting {
  int leaf;
  double eta;
  Method method;
  double tolerance;
  bool diagonal_beside;  ///< hmat holds T without its diagonal, which is added as a vector
};

/// In single precision, too, the callback writes a double.
void interaction(void* scene, int row, int col, void* result) {
  *static_cast<double*>(result) = (*static_cast<const Scene*>(scene))(row, col);
}

void run_hmat(Scene scene, const Light& light, const Setting& s) {
  scene.with_diagonal = !s.diagonal_beside;
  hmat_interface_t hmat;
  hmat_init_default_interface(&hmat, HMAT_SIMPLE_PRECISION);
  if (hmat.init() != 0) return;
  auto* const median = hmat_create_clustering_median();
  auto* const clustering = hmat_create_clustering_max_dof(median, s.leaf);
  auto* const tree = hmat_create_cluster_tree(scene.points.data(), 3, kPixels, clustering);
  auto* const admissible = hmat_create_admissibility_standard(s.eta);
  hmat_matrix_t* const matrix = hmat.create_empty_hmatrix_admissibility(tree, tree, 1, admissible);
  hmat_assemble_context_t assemble;
  hmat_assemble_context_init(&assemble);
  assemble.user_context = &scene;
  assemble.compression = s.method.create(s.tolerance);
  assemble.simple_compute = interaction;
  assemble.lower_symmetric = 1;
  assemble.progress = nullptr;
  hmat.assemble_generic(matrix, &assemble);
  hmat_info_t info{};
  hmat.get_info(matrix, &info);
  std::vector<float> p = light.p, y(kPixels);
  float one = 1, zero = 0;
  const auto apply = [&] {
    hmat.gemv('N', &one, matrix, p.data(), &zero, y.data(), 1);
    for (std::size_t i = 0; s.diagonal_beside && i < y.size(); ++i)
      y[i] += static_cast<float>(scene.albedo[i]) * p[i];
  };
  apply();
  const double error = light.error(y);
  const double ms = best_ms(apply);
  char name[160];
  static_cast<void>(std::snprintf(name, sizeof name, "hmat-oss %s %.0e, leaf %d, eta %.0f%s", s.method.name,
                                  s.tolerance, s.leaf, s.eta, s.diagonal_beside ? ", diagonal beside" : ""));
  print(name, error, 4.0 * (static_cast<double>(info.compressed_size) + (s.diagonal_beside ? kPixels : 0)),
        ms);
  hmat_delete_compression(assemble.compression);
  hmat.destroy(matrix);
  hmat_delete_cluster_tree(tree);
  hmat_delete_admissibility(admissible);
  hmat_delete_clustering(clustering);
  hmat_delete_clustering(median);
  hmat.finalize();
}

}  // namespace

int main() {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const Scene scene;
  const Light light(scene);
  for (const double tolerance : {1e-2, 3e-3, 1e-3, 3e-4}) run_tensor(scene, light, tolerance);
  for (const bool beside : {true, false})
    for (const double tolerance : {5e-3, 2e-3})
      for (const double eta : {2.0, 4.0, 8.0})
        for (const int leaf : {16, 32})
          for (const Method& method : kMethods)
            run_hmat(scene, light, {leaf, eta, method, tolerance, beside});
  return 0;
}
