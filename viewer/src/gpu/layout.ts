// How arrays lie in textures: a point is a texel of a W x H picture, and x y z are three texels next to each other of one 3W wide. So the
// arrays of the data are uploaded as they are.
import {
  DataArrayTexture, DataTexture, FloatType, ByteType, ShortType, NearestFilter, RedFormat, RedIntegerFormat, RGIntegerFormat, UnsignedIntType,
  UnsignedByteType, type Texture, type PixelFormat, type TextureDataType,
} from 'three';

export interface Grid {
  width: number;
  height: number;
}

export function gridOf(points: number): Grid {
  const width = points <= 256 * 1024 ? 256 : 512;
  return {width, height: Math.max(1, Math.ceil(points / width))};
}

type Values = Float32Array<ArrayBuffer> | Int8Array<ArrayBuffer> | Int16Array<ArrayBuffer> | Uint8Array<ArrayBuffer> | Uint32Array<ArrayBuffer>;

function formOf(values: Values): {format: PixelFormat; type: TextureDataType} {
  if (values instanceof Float32Array) return {format: RedFormat, type: FloatType};
  if (values instanceof Int8Array) return {format: RedIntegerFormat, type: ByteType};
  if (values instanceof Int16Array) return {format: RedIntegerFormat, type: ShortType};
  if (values instanceof Uint32Array) return {format: RedIntegerFormat, type: UnsignedIntType};
  return {format: RedFormat, type: UnsignedByteType};
}

function plain<T extends Texture>(texture: T): T {
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.generateMipmaps = false;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}

/** A texture of `values`, whose length is width * height. */
export function texture(values: Values, width: number, height: number): DataTexture {
  const {format, type} = formOf(values);
  return plain(new DataTexture(values, width, height, format, type));
}

/** Pairs of numbers, a texel each. */
export function pairTexture(values: Uint32Array<ArrayBuffer>, width: number, height: number): DataTexture {
  return plain(new DataTexture(values, width, height, RGIntegerFormat, UnsignedIntType));
}

type PointValues = Float32Array<ArrayBuffer> | Int8Array<ArrayBuffer> | Int16Array<ArrayBuffer>;

/** A texture of x y z of each point, that `write` fills anew. */
export class PointTexture<T extends PointValues> {
  readonly texture: DataTexture;
  constructor(private readonly values: T, grid: Grid) {
    this.texture = texture(values, grid.width * 3, grid.height);
  }
  write(from: ArrayLike<number>): void {
    this.values.set(from);
    this.texture.needsUpdate = true;
  }
}

export function floatPoints(points: number, grid: Grid, first?: Float32Array): PointTexture<Float32Array<ArrayBuffer>> {
  const made = new PointTexture(new Float32Array(grid.width * grid.height * 3), grid);
  if (first) made.write(first.subarray(0, points * 3));
  return made;
}

/** Layers of x y z of each point, as `basis` has them one after the other. */
export function layers(basis: Int8Array | Int16Array, count: number, points: number, grid: Grid): DataArrayTexture {
  const size = grid.width * grid.height * 3;
  const all = basis instanceof Int8Array ? new Int8Array(size * count) : new Int16Array(size * count);
  for (let k = 0; k < count; ++k) all.set(basis.subarray(k * points * 3, (k + 1) * points * 3), k * size);
  const made = plain(new DataArrayTexture(all as never, grid.width * 3, grid.height, count));
  made.format = RedIntegerFormat;
  made.type = basis instanceof Int8Array ? ByteType : ShortType;
  return made;
}
