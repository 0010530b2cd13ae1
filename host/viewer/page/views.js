// SPDX-License-Identifier: Apache-2.0

/** The pixels of one view ("row,col"), or of the whole grid (""): the same division as ViewLayout::tile(). */
export function tile_of(grid, views, view) {
  const [rows, cols] = grid;
  const at = /^(\d+),(\d+)$/.exec(view);
  if (!at || Number(at[1]) >= views[0] || Number(at[2]) >= views[1]) return { row: 0, col: 0, rows, cols };
  const start = (n, count, k) => Math.floor((k * n) / count);
  const row = start(rows, views[0], Number(at[1])), col = start(cols, views[1], Number(at[2]));
  return { row, col, rows: start(rows, views[0], Number(at[1]) + 1) - row, cols: start(cols, views[1], Number(at[2]) + 1) - col };
}

export function cut_planes(planes, grid, tile) {
  if (tile.rows === grid[0] && tile.cols === grid[1]) return planes;
  return planes.map((plane) => {
    const part = new Float32Array(tile.rows * tile.cols);
    for (let row = 0; row < tile.rows; ++row) {
      const at = (tile.row + row) * grid[1] + tile.col;
      part.set(plane.subarray(at, at + tile.cols), row * tile.cols);
    }
    return part;
  });
}
