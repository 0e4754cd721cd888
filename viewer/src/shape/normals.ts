// Smooth normals: the triangles about each point added up. Points at one place at rest (seams of textures) share theirs.
import type {Mesh} from '../data/model';

export class Normals {
  private readonly leader: Uint32Array;  // for each point the first one at the same place

  constructor(rest: Float32Array, private readonly meshes: readonly Pick<Mesh, 'triangles'>[]) {
    const seen = new Map<string, number>();
    this.leader = Uint32Array.from({length: rest.length / 3}, (_, i) => {
      const key = `${rest[3 * i]},${rest[3 * i + 1]},${rest[3 * i + 2]}`, first = seen.get(key) ?? i;
      if (first === i) seen.set(key, i);
      return first;
    });
  }

  /** Of length 1, or 0 where no triangle says more. */
  compute(points: Float32Array, out: Float32Array): void {
    const {leader} = this;
    out.fill(0);
    for (const {triangles} of this.meshes) addUp(triangles, leader, points, out);
    for (let v = 0; v < leader.length; ++v) {
      const i = 3 * v, from = 3 * leader[v];  // a leader comes before those it leads
      if (from !== i) {
        out[i] = out[from];
        out[i + 1] = out[from + 1];
        out[i + 2] = out[from + 2];
        continue;
      }
      const x = out[i], y = out[i + 1], z = out[i + 2], size = 1 / Math.max(Math.sqrt(x * x + y * y + z * z), 1e-30);
      out[i] = x * size;
      out[i + 1] = y * size;
      out[i + 2] = z * size;
    }
  }
}

function addUp(triangles: Uint32Array, leader: Uint32Array, points: Float32Array, out: Float32Array): void {
  for (let t = 0; t + 2 < triangles.length; t += 3) {
    const i = triangles[t], j = triangles[t + 1], k = triangles[t + 2], a = 3 * i, b = 3 * j, c = 3 * k;
    const ux = points[b] - points[a], uy = points[b + 1] - points[a + 1], uz = points[b + 2] - points[a + 2];
    const vx = points[c] - points[a], vy = points[c + 1] - points[a + 1], vz = points[c + 2] - points[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    const l = 3 * leader[i], m = 3 * leader[j], n = 3 * leader[k];
    out[l] += x;
    out[l + 1] += y;
    out[l + 2] += z;
    out[m] += x;
    out[m + 1] += y;
    out[m + 2] += z;
    out[n] += x;
    out[n + 1] += y;
    out[n + 2] += z;
  }
}
