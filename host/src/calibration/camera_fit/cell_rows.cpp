// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_fit/cell_rows.hpp"

#include "symrig/tensor/internal/half.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

/// a bᵀ = u diag(s) vᵀ, without what is too small to count.
struct ThinSvd {
  MatrixXf u, v;
  Eigen::VectorXf s;
};

ThinSvd svd_of(const Eigen::Ref<const MatrixXf>& a, const Eigen::Ref<const MatrixXf>& b) {
  const Index rank = std::min({a.cols(), a.rows(), b.rows()});
  const auto orthonormal = [](const Eigen::HouseholderQR<MatrixXf>& qr, Index rows, Index cols) {
    return MatrixXf(qr.householderQ() * MatrixXf::Identity(rows, cols));
  };
  const Eigen::HouseholderQR<MatrixXf> left(a), right(b);
  const Index la = std::min(a.rows(), a.cols()), lb = std::min(b.rows(), b.cols());
  const MatrixXf ra = left.matrixQR().topRows(la).triangularView<Eigen::Upper>();
  const MatrixXf rb = right.matrixQR().topRows(lb).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<MatrixXf> svd(ra * rb.transpose(), Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXf& s = svd.singularValues();
  Index kept = 0;
  while (kept < std::min(rank, s.size()) && s(kept) > 1e-7F * s(0)) ++kept;
  return {orthonormal(left, a.rows(), la) * svd.matrixU().leftCols(kept),
          orthonormal(right, b.rows(), lb) * svd.matrixV().leftCols(kept), s.head(kept)};
}

void sort_by_cell(std::size_t cells, const std::vector<std::pair<std::int32_t, CellRows::Entry>>& all,
                  std::vector<std::int64_t>& first, std::vector<CellRows::Entry>& entries) {
  first.assign(cells + 1, 0);
  for (const auto& [cell, entry] : all) ++first[cell + 1];
  for (std::size_t c = 0; c < cells; ++c) first[c + 1] += first[c];
  entries.resize(all.size());
  std::vector<std::int64_t> next(first.begin(), first.end() - 1);
  for (const auto& [cell, entry] : all) entries[next[cell]++] = entry;
}

}  // namespace

Result<void> CellRows::take_leaves(const TransportTensor& tensor, int channel, std::vector<LightBasis>& bases,
                                   std::vector<float>& values) {
  const auto add = [&](std::int32_t begin, std::int32_t end, MatrixXf a, std::int32_t col_begin,
                       std::int32_t col_end, const MatrixXf& basis) {
    LeafRows rows{
        begin, end, {col_begin, col_end, static_cast<std::int32_t>(basis.cols()), 0}, std::move(a), {}};
    if (!bases.empty()) rows.basis.first = bases.back().first + bases.back().rank;
    rows.rms = (rows.a.colwise().squaredNorm() / static_cast<float>(rows.a.rows())).cwiseSqrt().transpose();
    bases.push_back(rows.basis);
    for (const float value : basis.reshaped()) values.push_back(tensor::from_half(tensor::to_half(value)));
    leaves_.push_back(std::move(rows));
  };
  return tensor.visit_leaves([&](const Leaf& leaf, std::span<const float> factors) {
    if (leaf.rank == 0) return;
    const std::size_t one = leaf.values(1);
    const float* at = factors.data() + one * static_cast<std::size_t>(channel);
    const Eigen::Map<const MatrixXf> a(at, leaf.rows(), leaf.rank);
    const Eigen::Map<const MatrixXf> b(at + a.size(), leaf.cols(), leaf.rank);
    const ThinSvd svd = svd_of(a, b);
    if (svd.s.size() == 0) return;
    add(leaf.row_begin, leaf.row_end, svd.u * svd.s.asDiagonal(), leaf.col_begin, leaf.col_end, svd.v);
    if (tensor.symmetric() && leaf.row_begin != leaf.col_begin)
      add(leaf.col_begin, leaf.col_end, svd.v * svd.s.asDiagonal(), leaf.row_begin, leaf.row_end, svd.u);
  });
}

void CellRows::list_leaves(std::span<const std::int32_t> order) {
  leaf_first_.assign(order.size() + 1, 0);
  for (const LeafRows& leaf : leaves_)
    for (std::int32_t t = leaf.begin; t < leaf.end; ++t) ++leaf_first_[order[t] + 1];
  for (std::size_t c = 0; c < order.size(); ++c) leaf_first_[c + 1] += leaf_first_[c];
  leaf_row_.resize(leaf_first_.back());
  std::vector<std::int64_t> next(leaf_first_.begin(), leaf_first_.end() - 1);
  for (std::size_t q = 0; q < leaves_.size(); ++q)
    for (std::int32_t t = leaves_[q].begin; t < leaves_[q].end; ++t)
      leaf_row_[next[order[t]]++] = {static_cast<std::int32_t>(q), t - leaves_[q].begin};
}

void CellRows::take_singles(const TransportTensor& tensor, int channel) {
  const std::span<const std::int32_t> order = tensor.camera_tree().order();
  std::vector<std::pair<std::int32_t, Entry>> all;
  const auto add = [&](std::int32_t cell, std::int32_t from, float value) {
    if (value != 0) all.emplace_back(cell, Entry{from, value});
  };
  const std::vector<ScalarLeaf> scalars = tensor.scalars();
  const std::vector<float> values = tensor.scalar_values();
  for (std::size_t k = 0; k < scalars.size(); ++k) {
    const float value = values[k * tensor.channels() + channel];
    const std::int32_t row = order[scalars[k].row], col = order[scalars[k].col];
    add(row, col, value);
    if (row != col) add(col, row, value);
  }
  for (const BandLeaf& band : tensor.bands()) {
    const std::vector<BandOffset> offsets = band_offsets(band.radius);
    for (std::size_t k = 0; k < offsets.size(); ++k) {
      const float* plane = &band.values[(channel * offsets.size() + k) * grid_.size()];
      for (int i = 0; i + offsets[k].dy < grid_.rows; ++i)
        for (int j = std::max(0, -offsets[k].dx); j < grid_.cols && j + offsets[k].dx < grid_.cols; ++j) {
          const std::int32_t from = i * grid_.cols + j,
                             to = (i + offsets[k].dy) * grid_.cols + j + offsets[k].dx;
          add(from, to, plane[from]);
          add(to, from, plane[from]);
        }
    }
  }
  sort_by_cell(order.size(), all, single_first_, single_);
}

/// Whole rows, one after the other: what is near, what is strong, and the sum.
void CellRows::sum_rows(std::span<const std::int32_t> order, std::span<const float> values,
                        std::size_t first_value, const Work& work) {
  const std::size_t cells = order.size();
  std::vector<std::size_t> basis_at(leaves_.size());
  for (std::size_t q = 0, at = first_value; q < leaves_.size(); ++q) {
    basis_at[q] = at;
    at += static_cast<std::size_t>(leaves_[q].basis.end - leaves_[q].basis.begin) * leaves_[q].basis.rank;
  }
  std::vector<std::int32_t> rank_of(cells);
  for (std::size_t t = 0; t < cells; ++t) rank_of[order[t]] = static_cast<std::int32_t>(t);
  total_.assign(cells, 0);
  near_.assign(cells, {});
  std::vector<std::vector<Entry>> strong(cells);
  tbb::enumerable_thread_specific<std::vector<float>> rows;
  tbb::parallel_for(std::size_t{0}, cells, [&](std::size_t c) {
    work.add(static_cast<std::int64_t>(cells));
    std::vector<float>& row = rows.local();  // in tree order
    row.assign(cells, 0);
    const auto cell = static_cast<std::int32_t>(c);
    for (const LeafRow& at : leaves(cell)) {
      const LeafRows& leaf = leaves_[at.leaf];
      const std::size_t length = leaf.basis.end - leaf.basis.begin;
      for (std::int32_t k = 0; k < leaf.basis.rank; ++k) {
        const float a = leaf.a(at.row, k);
        const float* b = &values[basis_at[at.leaf] + k * length];
        for (std::size_t j = 0; j < length; ++j) row[leaf.basis.begin + j] += a * b[j];
      }
    }
    for (const Entry& entry : single(cell)) row[rank_of[entry.cell]] += entry.value;
    double sum = 0;
    for (const float v : row) sum += v;
    total_[c] = sum;
    const int y = cell / grid_.cols, x = cell % grid_.cols;
    for (int dy = -radius; dy <= radius; ++dy)
      for (int dx = -radius; dx <= radius; ++dx)
        if (y + dy >= 0 && y + dy < grid_.rows && x + dx >= 0 && x + dx < grid_.cols)
          near_[c][(dy + radius) * side + dx + radius] = row[rank_of[(y + dy) * grid_.cols + x + dx]];
    const auto least = static_cast<float>(std::max(0.02 * sum, 1e-30));
    for (std::size_t t = 0; t < cells; ++t) {
      if (row[t] < least) continue;
      const std::int32_t n = order[t];
      const bool far = std::abs(n / grid_.cols - y) > 1 || std::abs(n % grid_.cols - x) > 1;
      if (far) strong[c].push_back({n, row[t]});
    }
  });
  double mean = 0;
  for (const double total : total_) mean += std::abs(total) / static_cast<double>(cells);
  constexpr double kDarkest = 1e-4;
  least_ = mean > 0 ? kDarkest * mean : 1;
  strong_first_.assign(cells + 1, 0);
  for (std::size_t c = 0; c < cells; ++c) {
    strong_first_[c + 1] = strong_first_[c] + std::ssize(strong[c]);
    strong_.insert(strong_.end(), strong[c].begin(), strong[c].end());
  }
  list_partners();
}

void CellRows::list_partners() {
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  const auto cells = static_cast<std::int32_t>(grid_.size());
  for (std::int32_t c = 0; c < cells; ++c)
    for (const Entry& one : strong(c)) {
      pairs.emplace_back(c, one.cell);
      pairs.emplace_back(one.cell, c);
    }
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  partner_first_.assign(std::size_t{1} + cells, 0);
  for (const auto& [cell, partner] : pairs) {
    ++partner_first_[cell + 1];
    partner_.push_back(partner);
  }
  for (std::int32_t c = 0; c < cells; ++c) partner_first_[c + 1] += partner_first_[c];
}

Result<CellRows> CellRows::make(const TransportTensor& tensor, int channel,
                                std::span<const std::uint8_t> seen, std::vector<LightBasis>& bases,
                                std::vector<float>& values, const Work& work) {
  CellRows rows;
  rows.grid_ = tensor.camera_grid();
  rows.seen_.assign(seen.begin(), seen.end());
  const std::size_t first_value = values.size();
  SYMRIG_CHECK(rows.take_leaves(tensor, channel, bases, values));
  const std::span<const std::int32_t> order = tensor.camera_tree().order();
  rows.list_leaves(order);
  rows.take_singles(tensor, channel);
  rows.sum_rows(order, values, first_value, work);
  return rows;
}

}  // namespace symrig::calibration
