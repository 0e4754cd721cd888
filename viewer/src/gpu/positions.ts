// Where all points are, accelerated and full: from the subspace and a residual (reports), or as they were sent (live). Two pictures of
// floats, in which everything that is drawn looks its points up, and from which they are read back.
import {type Texture, type WebGLRenderer} from 'three';
import type {Model} from '../data/model';
import {floatPoints, gridOf, layers, PointTexture, texture, type Grid} from './layout';
import {Pass, type Uniforms} from './pass';

const head = `
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp isampler2D;
precision highp isampler2DArray;
layout(location = 0) out vec4 accelerated;
layout(location = 1) out vec4 full;  // w: how far the two are apart
`;

const fromShape = head + `
uniform sampler2D rest, row;
uniform isampler2DArray basis;
uniform isampler2D residual;
uniform int modes;
uniform float stepSize;
void main() {
  ivec2 at = ivec2(int(gl_FragCoord.x) * 3, int(gl_FragCoord.y));
  ivec2 y = at + ivec2(1, 0), z = at + ivec2(2, 0);
  vec3 sum = vec3(0.0);
  for (int k = 0; k < modes; ++k) {
    vec3 mode = vec3(texelFetch(basis, ivec3(at, k), 0).r, texelFetch(basis, ivec3(y, k), 0).r, texelFetch(basis, ivec3(z, k), 0).r);
    sum += texelFetch(row, ivec2(k, 0), 0).r * mode;
  }
  vec3 place = vec3(texelFetch(rest, at, 0).r, texelFetch(rest, y, 0).r, texelFetch(rest, z, 0).r) + sum;
  vec3 off = stepSize * vec3(texelFetch(residual, at, 0).r, texelFetch(residual, y, 0).r, texelFetch(residual, z, 0).r);
  accelerated = vec4(place, 0.0);
  full = vec4(place + off, length(off));
}`;

const asSent = head + `
uniform sampler2D sentAccelerated, sentFull;
void main() {
  ivec2 at = ivec2(int(gl_FragCoord.x) * 3, int(gl_FragCoord.y));
  ivec2 y = at + ivec2(1, 0), z = at + ivec2(2, 0);
  vec3 a = vec3(texelFetch(sentAccelerated, at, 0).r, texelFetch(sentAccelerated, y, 0).r, texelFetch(sentAccelerated, z, 0).r);
  vec3 f = vec3(texelFetch(sentFull, at, 0).r, texelFetch(sentFull, y, 0).r, texelFetch(sentFull, z, 0).r);
  accelerated = vec4(a, 0.0);
  full = vec4(f, distance(a, f));
}`;

export type Side = 'accelerated' | 'full';

export class Positions {
  readonly grid: Grid;
  private readonly pass: Pass;
  private readonly owned: {dispose(): void}[] = [];
  private readonly texels: Float32Array<ArrayBuffer>;
  private readonly read: Record<Side, Float32Array>;
  private readonly fresh: Record<Side, boolean> = {accelerated: false, full: false};
  private readonly one = new Float32Array(4);
  private dirty = true;
  /** Counts changes of the points. */
  version = 0;
  private row: Float32Array<ArrayBuffer> | null = null;
  private sent: Record<Side, PointTexture<Float32Array<ArrayBuffer>>> | null = null;
  private residual: PointTexture<Int8Array<ArrayBuffer>> | PointTexture<Int16Array<ArrayBuffer>> | null = null;
  private wide = false;  // the residual is of 16 bits, and takes those of 8
  private readonly uniforms: Uniforms;

  constructor(private readonly model: Model, private readonly renderer: WebGLRenderer) {
    const grid = this.grid = gridOf(model.points);
    this.texels = new Float32Array(grid.width * grid.height * 4);
    this.read = {accelerated: new Float32Array(model.points * 3), full: new Float32Array(model.points * 3)};
    if (model.shape) {
      const modes = model.shape.info.modes;
      this.row = new Float32Array(modes);
      this.uniforms = {
        rest: {value: this.own(floatPoints(model.points, grid, model.rest).texture)},
        row: {value: this.own(texture(this.row, modes, 1))},
        basis: {value: this.own(layers(model.shape.basis, modes, model.points, grid))},
        residual: {value: texture(new Int8Array(grid.width * grid.height * 3), grid.width * 3, grid.height)},
        modes: {value: modes}, stepSize: {value: 0},
      };
    } else {
      this.sent = {accelerated: floatPoints(model.points, grid, model.rest), full: floatPoints(model.points, grid, model.rest)};
      this.own(this.sent.accelerated.texture);
      this.own(this.sent.full.texture);
      this.uniforms = {sentAccelerated: {value: this.sent.accelerated.texture}, sentFull: {value: this.sent.full.texture}};
    }
    this.pass = new Pass(grid, 2, model.shape ? fromShape : asSent, this.uniforms);
    this.own(this.pass);
  }

  private own<T extends {dispose(): void}>(thing: T): T {
    this.owned.push(thing);
    return thing;
  }

  /** The row of the shape that is shown; -1 is rest. */
  setRow(row: number): void {
    const shape = this.model.shape;
    if (!shape || !this.row) return;
    const {modes} = shape.info;
    for (let k = 0; k < modes; ++k) this.row[k] = row < 0 ? 0 : shape.rows[row * modes + k] * shape.scale[k] / shape.steps;
    (this.uniforms.row.value as Texture).needsUpdate = true;
    this.changed();
  }

  /** What the full points add, or nothing. */
  setResidual(values: Int8Array | Int16Array | null, step: number): void {
    if (!this.model.shape) return;
    this.uniforms.stepSize.value = values ? step : 0;
    if (values) {
      const wide = values instanceof Int16Array;
      if (!this.residual || (wide && !this.wide)) this.residual = this.makeResidual(wide);
      this.residual.write(values);
    }
    this.changed();
  }

  private makeResidual(wide: boolean): NonNullable<Positions['residual']> {
    const size = this.grid.width * this.grid.height * 3;
    const made = wide ? new PointTexture(new Int16Array(size), this.grid) : new PointTexture(new Int8Array(size), this.grid);
    (this.uniforms.residual.value as Texture).dispose();
    this.uniforms.residual.value = made.texture;
    this.wide = wide;
    return made;
  }

  /** Points as a server sent them; where it sent one side only, both are that. */
  setSent(accelerated: Float32Array | null, full: Float32Array | null): void {
    const a = accelerated ?? full, f = full ?? accelerated;
    if (!this.sent || !a || !f) return;
    // what was sent once is uploaded once
    const {sentAccelerated, sentFull} = this.uniforms;
    this.sent.accelerated.write(a);
    if (a !== f) this.sent.full.write(f);
    sentAccelerated.value = this.sent.accelerated.texture;
    sentFull.value = (a === f ? this.sent.accelerated : this.sent.full).texture;
    this.changed();
  }

  private changed(): void {
    this.dirty = true;
    ++this.version;
    this.fresh.accelerated = this.fresh.full = false;
  }

  /** What the GPU had is gone. */
  again(): void {
    this.changed();
  }

  /** Computes what has changed. */
  update(): void {
    if (!this.dirty) return;
    this.dirty = false;
    this.pass.run(this.renderer);
  }

  textureOf(side: Side): Texture {
    return this.pass.target.textures[side === 'accelerated' ? 0 : 1];
  }

  /** The points as the shader has them, read back; the array is used again by the next call. */
  readBack(side: Side): Float32Array {
    this.update();
    const out = this.read[side];
    if (this.fresh[side]) return out;
    this.fresh[side] = true;
    const {width, height} = this.grid;
    this.renderer.readRenderTargetPixels(this.pass.target, 0, 0, width, height, this.texels, undefined, side === 'accelerated' ? 0 : 1);
    for (let i = 0, n = this.model.points; i < n; ++i) {
      out[3 * i] = this.texels[4 * i];
      out[3 * i + 1] = this.texels[4 * i + 1];
      out[3 * i + 2] = this.texels[4 * i + 2];
    }
    return out;
  }

  /** One point, without waiting for all the others. */
  readOne(side: Side, point: number): [number, number, number] {
    this.update();
    const {width} = this.grid;
    this.renderer.readRenderTargetPixels(this.pass.target, point % width, Math.floor(point / width), 1, 1, this.one, undefined, side === 'accelerated' ? 0 : 1);
    return [this.one[0], this.one[1], this.one[2]];
  }

  dispose(): void {
    for (const thing of this.owned) thing.dispose();
    (this.uniforms.residual?.value as Texture | undefined)?.dispose();
  }
}
