// SPDX-License-Identifier: Apache-2.0
// Where the projector's cells lie on the picture. Places are shares of width and height: of the cells, and of the picture.

/** Of a scene whose pictures have the projector's cells. */
export const kSamePlaces = { affine: [1, 0, 0, 0, 1, 0], on_picture: (place) => place, on_cells: (place) => place };

/** Of a camera with pixels of its own (CellPlaces in host/src/viewer/camera_view.hpp). */
export class Places {
  /** numbers: the affine map, x of each cell, y of each cell. grid: of the cells. */
  constructor(numbers, [rows, cols]) {
    Object.assign(this, { rows, cols, affine: numbers.subarray(0, 6) });
    this.x = numbers.subarray(6, 6 + rows * cols);
    this.y = numbers.subarray(6 + rows * cols);
  }

  /** Linear between the middles of four cells, and beyond the cells by the affine map. */
  on_picture([u, v]) {
    const clip = (at, most) => Math.min(Math.max(at, 0), most);
    const col = clip(u * this.cols - 0.5, this.cols - 1), row = clip(v * this.rows - 0.5, this.rows - 1);
    const left = Math.floor(col), top = Math.floor(row), right = Math.min(left + 1, this.cols - 1), bottom = Math.min(top + 1, this.rows - 1);
    const mixed = (plane) => {
      const across = (r) => plane[r * this.cols + left] * (left + 1 - col) + plane[r * this.cols + right] * (col - left);
      return across(top) * (top + 1 - row) + across(bottom) * (row - top);
    };
    const beyond = [u - (col + 0.5) / this.cols, v - (row + 0.5) / this.rows], [a, b, , c, d] = this.affine;
    return [mixed(this.x) + a * beyond[0] + b * beyond[1], mixed(this.y) + c * beyond[0] + d * beyond[1]];
  }

  /** The inverse, in steps of the inverse of the affine map, which is nearly the same. */
  on_cells([x, y]) {
    const [a, b, e, c, d, f] = this.affine, size = a * d - b * c;
    const back = (dx, dy) => [(d * dx - b * dy) / size, (a * dy - c * dx) / size];
    let place = back(x - e, y - f);
    for (let k = 0; k < 8; ++k) {
      const at = this.on_picture(place), [du, dv] = back(x - at[0], y - at[1]);
      place = [place[0] + du, place[1] + dv];
    }
    return place;
  }
}
