// SPDX-License-Identifier: Apache-2.0
#include "viewer/page_tensor.hpp"

#include "viewer/entry_sums.hpp"

namespace symrig::viewer {
namespace {

PageSide side_of(const BlockTree& tree) {
  return {tree.grid(), {tree.order().begin(), tree.order().end()}, {}};
}

}  // namespace

PageLeaf page_leaf(const Leaf& leaf, bool symmetric) {
  const bool own_mirror_image = leaf.row_begin == leaf.col_begin && leaf.row_end == leaf.col_end;
  return {leaf.row_begin,
          leaf.row_end,
          leaf.col_begin,
          leaf.col_end,
          leaf.rank,
          leaf.level,
          symmetric && !own_mirror_image ? 1 : 0};
}

Result<PageTensor> page_tensor(const TransportTensor& tensor) {
  PageTensor page;
  page.camera = side_of(tensor.camera_tree());
  page.projector = side_of(tensor.projector_tree());
  page.channels = tensor.channels();
  page.symmetric = tensor.symmetric();
  for (const Leaf& leaf : tensor.leaves()) page.leaves.push_back(page_leaf(leaf, page.symmetric));
  SYMRIG_TRY(page.factors, tensor.factors());
  EntrySums sums(page);
  sums.add(tensor.scalars(), tensor.scalar_values());
  sums.finish();
  page.bands = tensor.bands();
  page.columns.assign(tensor.columns().begin(), tensor.columns().end());
  page.column_rows.assign(tensor.column_rows().begin(), tensor.column_rows().end());
  page.column_values.assign(tensor.column_values().begin(), tensor.column_values().end());
  return page;
}

}  // namespace symrig::viewer
