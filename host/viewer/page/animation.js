// SPDX-License-Identifier: Apache-2.0

/** The place on a path at time t (1 = once along it): [x, y]. drawn: points of the path "drawn". */
export function place_on_path(path, t, drawn) {
  const turn = t - Math.floor(t);
  const there_and_back = 1 - Math.abs(2 * turn - 1);
  switch (path) {
    case "across": return [0.05 + 0.9 * there_and_back, 0.5];
    case "down": return [0.5, 0.05 + 0.9 * there_and_back];
    case "drawn": return place_on_line(drawn, turn);
    default: return [0.5 + 0.35 * Math.cos(2 * Math.PI * turn), 0.5 + 0.35 * Math.sin(2 * Math.PI * turn)];
  }
}

/** At equal speed along a closed line of points. */
function place_on_line(points, t) {
  if (points.length < 2) return points[0] ?? [0.5, 0.5];
  const closed = [...points, points[0]];
  const lengths = closed.slice(1).map(([x, y], k) => Math.hypot(x - closed[k][0], y - closed[k][1]));
  let rest = t * lengths.reduce((sum, length) => sum + length, 0);
  for (let k = 0; k < lengths.length; ++k) {
    if (rest <= lengths[k] && lengths[k] > 0) {
      const share = rest / lengths[k];
      return [0, 1].map((axis) => closed[k][axis] + share * (closed[k + 1][axis] - closed[k][axis]));
    }
    rest -= lengths[k];
  }
  return points[0];
}
