// The edges of triangles, each once.

/** Two points an edge, of `points` points in all. */
export function edgesOf(triangles: Uint32Array, points: number): Uint32Array<ArrayBuffer> {
  const keys = new Float64Array(triangles.length);
  let count = 0;
  for (let t = 0; t + 2 < triangles.length; t += 3) {
    for (let corner = 0; corner < 3; ++corner) {
      const a = triangles[t + corner], b = triangles[t + (corner + 1) % 3];
      if (a !== b) keys[count++] = Math.min(a, b) * points + Math.max(a, b);
    }
  }
  const sorted = keys.subarray(0, count).sort(), edges = new Uint32Array(2 * count);
  let at = 0;
  for (let i = 0; i < count; ++i) {
    if (i && sorted[i] === sorted[i - 1]) continue;
    edges[at++] = Math.floor(sorted[i] / points);
    edges[at++] = sorted[i] % points;
  }
  return edges.slice(0, at);
}
