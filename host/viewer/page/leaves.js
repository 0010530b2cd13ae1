// SPDX-License-Identifier: Apache-2.0
// Which leaf of the tensor holds the light between one pixel and each other pixel.

const kLeafNumbers = 7;

/** tree index of each raster pixel. */
function inverse(order) {
  const tree = new Int32Array(order.length);
  for (let t = 0; t < order.length; ++t) tree[order[t]] = t;
  return tree;
}

/**
 * For each camera pixel (raster order): the level of the finest leaf that holds light from this projector pixel, and the sum of the
 * ranks of all such leaves; -1 and 0 where no leaf holds any.
 */
export function leaves_of(table, projector_pixel) {
  const pixel = inverse(table.projector_order)[projector_pixel];
  const size = table.camera_order.length;
  const level = new Int16Array(size).fill(-1), rank = new Int32Array(size);
  const note = (begin, end, leaf_rank, leaf_level) => {
    for (let t = begin; t < end; ++t) {
      const at = table.camera_order[t];
      if (leaf_level > level[at]) level[at] = leaf_level;
      rank[at] += leaf_rank;
    }
  };
  const numbers = table.leaves;
  for (let k = 0; k < numbers.length; k += kLeafNumbers) {
    const [r0, r1, c0, c1, leaf_rank, leaf_level, mirrored] = numbers.subarray(k, k + kLeafNumbers);
    if (pixel >= c0 && pixel < c1) note(r0, r1, leaf_rank, leaf_level);
    if (mirrored && pixel >= r0 && pixel < r1) note(c0, c1, leaf_rank, leaf_level);
  }
  return { level, rank };
}

/** A colour of a scale of `count` colours from dark violet to yellow, as [red, green, blue] codes. */
export function scale_colour(k, count) {
  const t = count > 1 ? k / (count - 1) : 0;
  const stops = [[70, 20, 110], [40, 110, 160], [40, 170, 120], [180, 200, 50], [250, 230, 80]];
  const at = Math.min(t * (stops.length - 1), stops.length - 1.001), low = Math.floor(at);
  return stops[low].map((v, c) => Math.round(v + (at - low) * (stops[low + 1][c] - v)));
}
