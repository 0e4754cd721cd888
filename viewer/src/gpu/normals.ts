// Smooth normals of the points as they are shown: a pass that adds up the triangles about each point. Points at one place at rest (seams of
// textures) share theirs.
import {type WebGLRenderer} from 'three';
import type {Model} from '../data/model';
import {pairTexture, texture} from './layout';
import {Pass} from './pass';
import type {Positions, Side} from './positions';
import {across, trianglesAbout} from './triangles_about';

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
    const {spans, corners, rows} = trianglesAbout(model.rest, model.meshes, width * height);
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
