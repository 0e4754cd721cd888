// Discs and diamonds at points: cues, the vertices that were picked, handles, and what is hovered or selected among them.
import {BufferAttribute, BufferGeometry, GLSL3, Points, RawShaderMaterial, Sphere, type IUniform} from 'three';
import {lookUp} from './surface';

const vertex = lookUp + `
in vec3 offset;
in float vertexIndex;
in float look;  // 0 plain, 1 hovered or selected
in float corners;  // 0 a disc, 1 a diamond
uniform float size;
out float strong, pointed;
void main() {
  strong = look;
  pointed = corners;
  vec3 at = offset;
  if (vertexIndex >= 0.0) at += texelFetch(positions, place(int(vertexIndex)), 0).xyz;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(at, 1.0);
  gl_PointSize = size * (look > 0.5 ? 1.6 : 1.0);
}`;

const fragment = `
precision highp float;
in float strong, pointed;
out vec4 colour;
uniform vec3 base, selected, rim;
void main() {
  vec2 at = abs(gl_PointCoord - 0.5) * 2.0;
  float r = pointed > 0.5 ? at.x + at.y : length(at);
  float soft = fwidth(r);
  float alpha = 1.0 - smoothstep(1.0 - soft, 1.0, r);
  if (alpha <= 0.0) discard;
  vec3 inner = strong > 0.5 ? selected : base;
  colour = vec4(mix(inner, rim, smoothstep(0.62 - soft, 0.62, r)), alpha * 0.95);
}`;

export interface Mark {
  vertex: number;  // -1: the offset is its place
  offset: readonly [number, number, number];
  diamond?: boolean;
}

export class Marks {
  readonly object: Points;
  private readonly geometry = new BufferGeometry();
  private readonly material: RawShaderMaterial;

  constructor(shared: Record<string, IUniform>, base: [number, number, number]) {
    this.material = new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: vertex, fragmentShader: fragment, transparent: true, depthTest: false, depthWrite: false,
      uniforms: {...shared, base: {value: base}, selected: {value: [1, 1, 1]}, rim: {value: [0.05, 0.06, 0.08]}, size: {value: 9}},
    });
    this.object = new Points(this.geometry, this.material);
    this.object.frustumCulled = false;
    this.object.renderOrder = 3;
    this.set([]);
  }

  set(marks: readonly Mark[]): void {
    this.geometry.setAttribute('vertexIndex', new BufferAttribute(Float32Array.from(marks, (m) => m.vertex), 1));
    this.geometry.setAttribute('offset', new BufferAttribute(Float32Array.from(marks.flatMap((m) => [...m.offset])), 3));
    this.geometry.setAttribute('corners', new BufferAttribute(Float32Array.from(marks, (m) => m.diamond ? 1 : 0), 1));
    this.geometry.setAttribute('look', new BufferAttribute(new Float32Array(marks.length), 1));
    this.geometry.boundingSphere = new Sphere();
    this.geometry.setDrawRange(0, marks.length);
    this.object.visible = marks.length > 0;
  }

  /** Takes them elsewhere; where a number is not known they stay. */
  move(offsets: readonly (number | null)[]): void {
    const attribute = this.geometry.getAttribute('offset') as BufferAttribute, {array} = attribute;
    for (let i = 0; i < Math.min(array.length, offsets.length); ++i) array[i] = offsets[i] ?? array[i];
    attribute.needsUpdate = true;
  }

  /** Where a mark without a vertex is. */
  offsetOf(index: number): [number, number, number] {
    const {array} = this.geometry.getAttribute('offset');
    return [array[3 * index], array[3 * index + 1], array[3 * index + 2]];
  }

  /** How wide a mark is, in pixels of the picture. */
  setSize(size: number): void {
    this.material.uniforms.size.value = size;
  }

  /** Which of them is shown as hovered or selected; -1 for none. */
  emphasize(index: number): void {
    const look = this.geometry.getAttribute('look') as BufferAttribute;
    (look.array as Float32Array).fill(0);
    if (index >= 0) look.setX(index, 1);
    look.needsUpdate = true;
  }

  dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
  }
}
