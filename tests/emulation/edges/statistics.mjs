// SPDX-License-Identifier: Apache-2.0
// Numbers about edges, all in cycles.

/** {count, min, max, mean, jitter} of a list; jitter is max - min. */
export function statistics(values) {
  if (values.length === 0) return { count: 0, min: NaN, max: NaN, mean: NaN, jitter: NaN };
  let [min, max, sum] = [Infinity, -Infinity, 0];
  for (const value of values) {
    min = Math.min(min, value);
    max = Math.max(max, value);
    sum += value;
  }
  return { count: values.length, min, max, mean: sum / values.length, jitter: max - min };
}

/** How long one pin stood at each level: [{level, cycles, begin}], the open end left out. */
export function levels(edges) {
  return edges.slice(1).map((edge, i) => ({ level: edges[i].level, begin: edges[i].cycle, cycles: edge.cycle - edges[i].cycle }));
}

/** Shortest stretch of one pin at `level`, or of either level. */
export function shortest(edges, level) {
  const stretches = levels(edges).filter((each) => level === undefined || each.level === level);
  return statistics(stretches.map((each) => each.cycles)).min;
}

/** From each rising edge of `from` to the first edge at `level` of `to` that follows it before the next. */
export function delays(from, to, level = 1) {
  const starts = from.filter((edge) => edge.level === 1);
  const ends = to.filter((edge) => edge.level === level);
  const result = [];
  let at = 0;
  starts.forEach((start, i) => {
    const limit = starts[i + 1]?.cycle ?? Infinity;
    while (at < ends.length && ends[at].cycle < start.cycle) at++;
    if (at < ends.length && ends[at].cycle < limit) result.push(ends[at].cycle - start.cycle);
  });
  return result;
}
