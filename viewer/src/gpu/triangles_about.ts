// Which triangles each point has about it, as a list that a shader walks.
import type {Mesh} from '../data/model';

export const across = 512;  // triangles a line of the list

// A point adds up all triangles of those at its place: these keep what a broken mesh costs in bounds.
const mostTogether = 64, mostTriangles = 256;

export interface About {
  spans: Uint32Array<ArrayBuffer>;    // of each point: where its triangles begin, and how many there are
  corners: Uint32Array<ArrayBuffer>;  // three a triangle
  rows: number;
}

export function trianglesAbout(rest: Float32Array, meshes: readonly Pick<Mesh, 'triangles'>[], size: number): About {
  const points = rest.length / 3, leader = leaders(rest, points);
  const count = new Uint32Array(points);
  for (const mesh of meshes) for (const v of mesh.triangles) ++count[leader[v]];
  const first = new Uint32Array(points + 1);
  for (let i = 0; i < points; ++i) first[i + 1] = first[i] + count[i];
  const rows = Math.max(1, Math.ceil(first[points] / across));
  const corners = new Uint32Array(rows * across * 3);
  const next = first.slice(0, points);
  for (const {triangles} of meshes) {
    for (let t = 0; t < triangles.length; t += 3) {
      for (let corner = 0; corner < 3; ++corner) corners.set(triangles.subarray(t, t + 3), 3 * next[leader[triangles[t + corner]]]++);
    }
  }
  const spans = new Uint32Array(size * 2);
  for (let i = 0; i < points; ++i) {
    spans[2 * i] = first[leader[i]];
    spans[2 * i + 1] = Math.min(mostTriangles, count[leader[i]]);
  }
  return {spans, corners, rows};
}

/** For each point the first one at the same place; where there are very many at one place (a mesh that has collapsed), each for itself. */
function leaders(rest: Float32Array, points: number): Uint32Array {
  const leader = new Uint32Array(points), together = new Uint32Array(points);
  const seen = new Map<string, number>();
  for (let i = 0; i < points; ++i) {
    const key = `${rest[3 * i]},${rest[3 * i + 1]},${rest[3 * i + 2]}`;
    const found = seen.get(key);
    if (found === undefined) seen.set(key, i);
    ++together[leader[i] = found ?? i];
  }
  return leader.map((first, i) => together[first] > mostTogether ? i : first);
}
