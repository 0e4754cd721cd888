// A rig as the page shows it: its meta, the blobs that everything needs, and the others when they are asked for.
import type {Feed} from './feed';
import type {BlobArray, Meta, ShapeInfo} from './meta';

export interface Shape {
  info: ShapeInfo;
  basis: Int8Array | Int16Array;
  steps: number;  // what a full swing is in the basis: 127 or 32767
  scale: Float32Array;
  rows: Float32Array;
}

export interface Mesh {
  name: string;
  first: number;
  count: number;
  colour: string;
  triangles: Uint32Array;
  edges: Uint32Array | null;
}

export interface Model {
  meta: Meta;
  live: boolean;
  points: number;
  accelerated: boolean;
  tolerance: number | null;
  unit: {name: string; metres: number};
  rest: Float32Array;
  meshes: Mesh[];
  shape: Shape | null;
  /** A blob, fetched once. */
  blob(name: string): Promise<BlobArray>;
}

export async function loadModel(feed: Feed): Promise<Model> {
  const meta = await feed.meta();
  const kept = new Map<string, Promise<BlobArray>>();
  const blob = (name: string): Promise<BlobArray> => {
    let found = kept.get(name);
    if (!found) {
      const info = meta.blobs[name];
      found = info ? feed.blob(name, info) : Promise.reject(new Error(`there is no blob ${name}`));
      kept.set(name, found);
    }
    return found;
  };
  const [rest, meshes, shape] = await Promise.all([
    blob(meta.rest).then(floats),
    Promise.all(meta.meshes.map(async (mesh): Promise<Mesh> => ({
      name: mesh.name,
      first: mesh.first,
      count: mesh.count,
      colour: mesh.colour ?? '#b9b4ac',
      triangles: indices(await blob(mesh.triangles), meta.points),
      edges: mesh.edges ? indices(await blob(mesh.edges), meta.points) : null,
    }))),
    meta.shape ? loadShape(meta.shape, meta.points, blob) : null,
  ]);
  if (rest.length !== meta.points * 3) throw new Error(`rest has ${rest.length} numbers for ${meta.points} points`);
  for (const clip of meta.clips ?? []) {
    const rows = shape ? shape.rows.length / shape.info.modes : 0, first = clip.first_row;
    if (shape && first !== null && first !== undefined && first + clip.frames > rows) throw new Error(`clip ${clip.name} asks for rows beyond the ${rows} there are`);
  }
  return {
    meta, live: feed.live, points: meta.points, rest, meshes, shape, blob,
    accelerated: meta.accelerated === true,
    tolerance: meta.accelerated && meta.tolerance ? meta.tolerance : null,
    unit: meta.unit ?? {name: 'mm', metres: 0.001},
  };
}

async function loadShape(info: ShapeInfo, points: number, blob: (name: string) => Promise<BlobArray>): Promise<Shape> {
  const [basis, scale, rows] = await Promise.all([blob(info.basis), blob(info.scale).then(floats), blob(info.rows).then(floats)]);
  if (!(basis instanceof Int8Array) && !(basis instanceof Int16Array)) throw new Error('the basis is neither i8 nor i16');
  if (basis.length !== info.modes * points * 3) throw new Error('the basis has another size than its modes and points');
  if (info.modes < 1 || info.modes > 256) throw new Error(`a shape has 1 to 256 modes, not ${info.modes}`);
  if (scale.length !== info.modes || rows.length % info.modes !== 0) throw new Error('scale or rows do not fit the modes');
  return {info, basis, steps: basis instanceof Int8Array ? 127 : 32767, scale, rows};
}

function floats(array: BlobArray): Float32Array {
  if (!(array instanceof Float32Array)) throw new Error('a blob that must be f32 is not');
  return array;
}

function indices(array: BlobArray, points: number): Uint32Array {
  if (!(array instanceof Uint32Array)) throw new Error('a blob that must be u32 is not');
  for (const index of array) if (index >= points) throw new Error(`index ${index} is beyond the ${points} points`);
  return array;
}
