// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/neighbouring_leaves.hpp"

#include "acquisition/search/rank_test.hpp"

#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace symrig::acquisition {

NeighbouringLeaves::NeighbouringLeaves(const SceneFacts& facts, const KnownTransport& known,
                                       const Parents& parents, std::span<const Piece> pieces)
    : parents_(parents),
      flood_squared_(facts.flood_squared),
      channels_(facts.channels),
      most_(facts.options.economy.rank),
      sigmas_(facts.rule().noise_sigmas),
      pieces_(pieces.begin(), pieces.end()),
      bases_(static_cast<std::size_t>(channels_) * 2 * BlockTree::kMaxChildren) {
  for (int channel = 0; channel < channels_; ++channel) {
    for (int k = 0; k < parents.row.children; ++k) make_basis(known, channel, kRow, k);
    for (int k = 0; k < parents.col.children; ++k) make_basis(known, channel, kCol, k);
  }
}

const Block& NeighbouringLeaves::child(Side side, int k) const {
  const Block& parent = side == kRow ? parents_.row : parents_.col;
  return parents_.children[static_cast<std::size_t>(parent.first_child) + static_cast<std::size_t>(k)];
}

/// The factors of all pieces on one child, side by side.
NeighbouringLeaves::Matrix NeighbouringLeaves::gather(const KnownTransport& known, int channel, Side side,
                                                      int k) {
  std::vector<Piece*> there;
  int columns = 0;
  for (Piece& piece : pieces_) {
    if ((side == kRow ? piece.row_child : piece.col_child) != k) continue;
    (side == kRow ? piece.row_column : piece.col_column) = columns;
    columns += piece.rank;
    there.push_back(&piece);
  }
  const std::int32_t pixels = child(side, k).size();
  Matrix factors(pixels, columns);
  Eigen::Index column = 0;
  for (const Piece* piece : there) {
    const std::int64_t offset =
        channel * (std::int64_t{piece->rows()} + piece->cols()) + (side == kRow ? 0 : piece->rows());
    const auto leaves = known.leaves().subspan(piece->first, piece->rank);
    for (const KnownLeaf& leaf : leaves) {
      const float* const from = known.factors().data() + leaf.factors + offset;
      for (std::int32_t t = 0; t < pixels; ++t) factors(t, column) = static_cast<double>(from[t]);
      ++column;
    }
  }
  return factors;
}

void NeighbouringLeaves::make_basis(const KnownTransport& known, int channel, Side side, int k) {
  Matrix factors = gather(known, channel, side, k);
  Basis& basis = bases_[base(channel, side, k)];
  if (factors.cols() >= factors.rows()) {
    basis.q = Matrix::Identity(factors.rows(), factors.rows());
    basis.coordinates = std::move(factors);
  } else {
    const Eigen::HouseholderQR<Matrix> qr(factors);
    basis.q = qr.householderQ() * Matrix::Identity(factors.rows(), factors.cols());
    basis.coordinates = qr.matrixQR().topRows(factors.cols()).triangularView<Eigen::Upper>();
  }
  basis.sum = basis.q.colwise().sum().transpose();
}

/// Where the coordinates of each child begin in those of a rectangle; the last: how many there are.
std::vector<Eigen::Index> NeighbouringLeaves::begins(int channel, Side side, int first, int last) const {
  std::vector<Eigen::Index> begins{0};
  for (int k = first; k < last; ++k) begins.push_back(begins.back() + basis(channel, side, k).q.cols());
  return begins;
}

/// Q' 1 of each child, one column each.
NeighbouringLeaves::Matrix NeighbouringLeaves::sums(int channel, Side side, int first, int last) const {
  const std::vector<Eigen::Index> at = begins(channel, side, first, last);
  Matrix sums = Matrix::Zero(at.back(), last - first);
  for (int k = first; k < last; ++k) {
    const Eigen::VectorXd& sum = basis(channel, side, k).sum;
    sums.col(k - first).segment(at[k - first], sum.size()) = sum;
  }
  return sums;
}

NeighbouringLeaves::Core NeighbouringLeaves::core(const Rectangle& r, int channel) const {
  const std::vector<Eigen::Index> row_at = begins(channel, kRow, r.row_first, r.row_last);
  const std::vector<Eigen::Index> col_at = begins(channel, kCol, r.col_first, r.col_last);
  Core core{Matrix::Zero(row_at.back(), col_at.back()),
            sums(channel, kRow, r.row_first, r.row_last),
            sums(channel, kCol, r.col_first, r.col_last),
            {},
            row_at.back() <= col_at.back()};
  for (const Piece& piece : pieces_) {
    if (!r.holds(piece)) continue;
    const Matrix& a = basis(channel, kRow, piece.row_child).coordinates;
    const Matrix& b = basis(channel, kCol, piece.col_child).coordinates;
    core.k
        .block(row_at[piece.row_child - r.row_first], col_at[piece.col_child - r.col_first], a.rows(),
               b.rows())
        .noalias() =
        a.middleCols(piece.row_column, piece.rank) * b.middleCols(piece.col_column, piece.rank).transpose();
  }
  return core;
}

void NeighbouringLeaves::Core::decompose(int most) {
  const Matrix gram = on_rows ? Matrix(k * k.transpose()) : Matrix(k.transpose() * k);
  const Eigen::SelfAdjointEigenSolver<Matrix> solved(gram);
  lead = solved.eigenvectors().rightCols(std::min<Eigen::Index>(most, gram.cols())).rowwise().reverse();
}

/// What is missing from the best approximation of a rank: K − W W' K.
NeighbouringLeaves::Matrix NeighbouringLeaves::Core::lost(int rank) const {
  const auto w = lead.leftCols(std::min<Eigen::Index>(rank, lead.cols()));
  return on_rows ? Matrix(k - w * (w.transpose() * k)) : Matrix(k - (k * w) * w.transpose());
}

/// The noise that a merge takes out of the images of its pieces. They see as many lit children as the
/// rectangle has on the other side. Of these, rank k keeps k directions.
double NeighbouringLeaves::lost_noise(const Piece& piece, const Rectangle& r, double samples) const {
  const auto lost = [&](int children) {
    return std::max(0.0, 1 - piece.rank / static_cast<double>(children));
  };
  const double share = 0.5 * (lost(r.row_last - r.row_first) + lost(r.col_last - r.col_first));
  return noise_allowance(share * piece.noise, samples, sigmas_);
}

/// The two bounds of merge_leaves for a rank.
bool NeighbouringLeaves::good(std::span<const Core> cores, const Piece& piece, const Rectangle& r,
                              double allowed) const {
  double images = 0;
  double all = 0;
  for (int channel = 0; channel < channels_; ++channel) {
    const Core& core = cores[channel];
    const double f = flood_squared_[channel];
    if (f <= 0) continue;
    const Matrix lost = core.lost(piece.rank);
    images += ((lost * core.cols).squaredNorm() + (lost.transpose() * core.rows).squaredNorm()) / f;
    all += lost.squaredNorm() / f;
  }
  const double samples = static_cast<double>(channels_) * ((r.col_last - r.col_first) * piece.rows() +
                                                           (r.row_last - r.row_first) * piece.cols());
  const double mean = allowed + lost_noise(piece, r, samples) / samples;
  return images <= samples * mean && all <= channels_ * 0.5 * (piece.rows() + piece.cols()) * mean;
}

/// What a leaf takes in a finished tensor: its range, and for each rank two columns of halves, their places
/// and their weights.
std::int64_t NeighbouringLeaves::bytes(const Piece& piece) const {
  const std::int64_t a_rank =
      2 * sizeof(std::uint32_t) +
      channels_ * (std::int64_t{sizeof(float)} + 2 * (std::int64_t{piece.rows()} + piece.cols()));
  return std::int64_t{sizeof(Leaf)} + piece.rank * a_rank;
}

void NeighbouringLeaves::append_pixels(const Rectangle& r, int channel, Side side, const Eigen::VectorXd& x,
                                       std::vector<float>& out) const {
  Eigen::Index at = 0;
  const int last = side == kRow ? r.row_last : r.col_last;
  for (int k = side == kRow ? r.row_first : r.col_first; k < last; ++k) {
    const Matrix& q = basis(channel, side, k).q;
    const Eigen::VectorXd pixels = q.lazyProduct(x.segment(at, q.cols()));
    at += q.cols();
    for (const double v : pixels) out.push_back(static_cast<float>(v));
  }
}

/// The leaf of rank 1 that would replace what a rectangle holds, without factors.
Merged NeighbouringLeaves::outline(const Rectangle& r) const {
  Merged merged;
  merged.piece = {child(kRow, r.row_first).begin, child(kRow, r.row_last - 1).end,
                  child(kCol, r.col_first).begin, child(kCol, r.col_last - 1).end};
  for (const Piece& p : pieces_) {
    if (!r.holds(p)) continue;
    merged.piece.noise += p.noise;
    for (int rank = 0; rank < p.rank; ++rank) merged.replaces.push_back(p.first + rank);
  }
  return merged;
}

/// T ≈ Σ w (w'T), w the leading singular vectors of the smaller side.
void NeighbouringLeaves::append_rank(const Rectangle& r, std::span<const Core> cores, int rank,
                                     std::vector<float>& out) const {
  for (int channel = 0; channel < channels_; ++channel) {
    const Core& core = cores[channel];
    Eigen::VectorXd w = Eigen::VectorXd::Zero(core.lead.rows());
    if (rank < core.lead.cols()) w = core.lead.col(rank);
    Eigen::VectorXd other(core.on_rows ? core.k.cols() : core.k.rows());
    if (core.on_rows)
      other = core.k.transpose().lazyProduct(w);
    else
      other = core.k.lazyProduct(w);
    append_pixels(r, channel, kRow, core.on_rows ? w : other, out);
    append_pixels(r, channel, kCol, core.on_rows ? other : w, out);
  }
}

std::optional<Merged> NeighbouringLeaves::merge(const Rectangle& r, double allowed) {
  std::int64_t before = 0;
  for (const Piece& p : pieces_)
    if (r.holds(p)) before += bytes(p);
  Merged merged = outline(r);
  Piece& piece = merged.piece;
  if (bytes(piece) >= before) return {};
  std::vector<Core> cores;
  for (int channel = 0; channel < channels_; ++channel) {
    cores.push_back(core(r, channel));
    cores.back().decompose(most_);
  }
  while (piece.rank <= most_ && bytes(piece) < before && !good(cores, piece, r, allowed)) ++piece.rank;
  if (piece.rank > most_ || bytes(piece) >= before) return {};
  for (int rank = 0; rank < piece.rank; ++rank) append_rank(r, cores, rank, merged.factors);
  piece.noise = 0;
  std::erase_if(pieces_, [&](const Piece& p) { return r.holds(p); });
  return merged;
}

}  // namespace symrig::acquisition
