// Smooth normals of the points as they are shown: a pass that adds up the triangles about each point. Points at one place at rest (seams of
// textures) share theirs.
import {type WebGLRenderer} from 'three';
import type {Model} from '../data/model';
import {pairTexture, texture} from './layout';
import {Pass} from './pass';
import type {Positions, Side} from './positions';

const across = 512;  // triangles a line of the list

const fragment = `
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
layout(location = 0) out vec4 ofAccelerated;
layout(location = 1) out vec4 ofFull;
uniform sampler2D accelerated, full;
uniform usampler2D spans, corners;
uniform int width, sides;
ivec2 place(uint i) { return ivec2(int(i) % width, int(i) / width); }
vec3 sum(sampler2D points, uvec2 span) {
  vec3 n = vec3(0.0);
  for (uint j = 0u; j < span.y; ++j) {
    int t = int(span.x + j);
    ivec2 at = ivec2((t % ${across}) * 3, t / ${across});
    vec3 a = texelFetch(points, place(texelFetch(corners, at, 0).r), 0).xyz;
    vec3 b = texelFetch(points, place(texelFetch(corners, at + ivec2(1, 0), 0).r), 0).xyz;
    vec3 c = texelFetch(points, place(texelFetch(corners, at + ivec2(2, 0), 0).r), 0).xyz;
    n += cross(b - a, c - a);
  }
  return n / max(length(n), 1e-30);
}
void main() {
  uvec2 span = texelFetch(spans, ivec2(gl_FragCoord.xy), 0).rg;
  ofAccelerated = vec4((sides & 1) != 0 ? sum(accelerated, span) : vec3(0.0), 0.0);
  ofFull = vec4((sides & 2) != 0 ? sum(full, span) : vec3(0.0), 0.0);
}`;

export class Normals {
  private readonly pass: Pass;
  private readonly owned: {dispose(): void}[];
  private sides = 0;
  private version = -1;

  constructor(model: Model, positions: Positions, private readonly renderer: WebGLRenderer) {
    const {width, height} = positions.grid;
    const {spans, corners, rows} = trianglesAbout(model, width * height);
    const spanTexture = pairTexture(spans, width, height);
    const cornerTexture = texture(corners, across * 3, rows);
    this.pass = new Pass(positions.grid, 2, fragment, {
      accelerated: {value: positions.textureOf('accelerated')}, full: {value: positions.textureOf('full')},
      spans: {value: spanTexture}, corners: {value: cornerTexture}, width: {value: width}, sides: {value: 3},
    });
    this.owned = [this.pass, spanTexture, cornerTexture];
  }

  /** For the sides that are shown: 1 accelerated, 2 full, 3 both. */
  update(version: number, sides: number): void {
    if (version === this.version && (this.sides & sides) === sides) return;
    this.sides = sides;
    this.version = version;
    this.pass.material.uniforms.sides.value = sides;
    this.pass.run(this.renderer);
  }

  textureOf(side: Side): Pass['target']['texture'] {
    return this.pass.target.textures[side === 'accelerated' ? 0 : 1];
  }

  dispose(): void {
    for (const thing of this.owned) thing.dispose();
  }
}

/** For each point the place and the number of its triangles in a list of their corners. */
function trianglesAbout(model: Model, size: number): {spans: Uint32Array<ArrayBuffer>; corners: Uint32Array<ArrayBuffer>; rows: number} {
  const leader = leaders(model.rest, model.points);
  const count = new Uint32Array(model.points);
  for (const mesh of model.meshes) for (const v of mesh.triangles) ++count[leader[v]];
  const first = new Uint32Array(model.points + 1);
  for (let i = 0; i < model.points; ++i) first[i + 1] = first[i] + count[i];
  const rows = Math.max(1, Math.ceil(first[model.points] / across));
  const corners = new Uint32Array(rows * across * 3);
  const next = first.slice(0, model.points);
  for (const {triangles} of model.meshes) {
    for (let t = 0; t < triangles.length; t += 3) {
      for (let corner = 0; corner < 3; ++corner) corners.set(triangles.subarray(t, t + 3), 3 * next[leader[triangles[t + corner]]]++);
    }
  }
  const spans = new Uint32Array(size * 2);
  for (let i = 0; i < model.points; ++i) {
    spans[2 * i] = first[leader[i]];
    spans[2 * i + 1] = count[leader[i]];
  }
  return {spans, corners, rows};
}

/** For each point the first one at the same place. */
function leaders(rest: Float32Array, points: number): Uint32Array {
  const leader = new Uint32Array(points);
  const seen = new Map<string, number>();
  for (let i = 0; i < points; ++i) {
    const key = `${rest[3 * i]},${rest[3 * i + 1]},${rest[3 * i + 2]}`;
    const found = seen.get(key);
    if (found === undefined) seen.set(key, i);
    leader[i] = found ?? i;
  }
  return leader;
}
