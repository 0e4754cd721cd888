// The shaders of the picture that a GPU draws: surfaces, edges and marks.
import {DoubleSide, GLSL3, RawShaderMaterial, type IUniform, type Texture} from 'three';
import {cover, rimBegins, rimColour, selectedColour, selectedScale} from './marks';

const head = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
in vec3 position;
`;

const vertex = head + `
uniform mat3 normalMatrix;
uniform float lift;
in vec3 normal;
in float paint;
out vec3 facing;
out float value;
void main() {
  facing = normalMatrix * normal;
  value = paint;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_Position.z -= lift * gl_Position.w;
}`;

const lit = `
precision highp float;
in vec3 facing;
in float value;
out vec4 colour;
uniform sampler2D table;
uniform vec3 base;
uniform float top, alpha;
uniform bool painted;
vec3 own() {
  return painted ? texture(table, vec2(clamp(value / top, 0.0, 1.0) * 0.99609 + 0.00195, 0.5)).rgb : base;
}
vec3 shaded(vec3 c) {
  vec3 n = normalize(gl_FrontFacing ? facing : -facing);
  float key = max(dot(n, vec3(0.32, 0.48, 0.816)), 0.0);
  float fill = max(dot(n, vec3(-0.6, 0.1, 0.79)), 0.0);
  float light = 0.26 + 0.66 * key + 0.16 * fill + 0.08 * n.y;
  if (painted) light = 0.45 + 0.6 * light;
  return min(c * light, 1.0);
}
`;

const fragment = lit + `
void main() { colour = vec4(shaded(own()), alpha); }`;

// Darker than what is light, lighter than what is dark, whatever light falls on it; no darker where two lines lie on each other (seams).
const lineFragment = lit + `
void main() {
  vec3 c = own(), s = shaded(c);
  colour = vec4(dot(c, vec3(0.2126, 0.7152, 0.0722)) > 0.3 ? s * 0.45 : mix(s, vec3(1.0), 0.35), 1.0);
}`;

const markVertex = head + `
in float look;  // 0 plain, 1 hovered or selected
in float corners;  // 0 a disc, 1 a diamond
uniform float size;
out float strong, pointed;
void main() {
  strong = look;
  pointed = corners;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_PointSize = size * (look > 0.5 ? ${selectedScale.toFixed(4)} : 1.0);
}`;

const markFragment = `
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
  colour = vec4(mix(inner, rim, smoothstep(${rimBegins.toFixed(4)} - soft, ${rimBegins.toFixed(4)}, r)), alpha * ${cover.toFixed(4)});
}`;

export interface PaintUniforms {
  [name: string]: IUniform;
  table: IUniform<Texture>;
  top: IUniform<number>;
  painted: IUniform<boolean>;
}

export function surfaceMaterial(paint: PaintUniforms, base: readonly number[], ghost: boolean): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: vertex, fragmentShader: fragment, side: DoubleSide,
    transparent: ghost, depthWrite: !ghost, polygonOffset: true, polygonOffsetFactor: ghost ? -1 : 1, polygonOffsetUnits: ghost ? -1 : 1,
    uniforms: {...paint, base: {value: base}, alpha: {value: ghost ? 0.5 : 1}, lift: {value: 0}},
  });
}

export function lineMaterial(paint: PaintUniforms, base: readonly number[]): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: vertex, fragmentShader: lineFragment, uniforms: {...paint, base: {value: base}, alpha: {value: 1}, lift: {value: 0.00003}},
  });
}

export function markMaterial(base: readonly number[]): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: markVertex, fragmentShader: markFragment, transparent: true, depthTest: false, depthWrite: false,
    uniforms: {base: {value: base}, selected: {value: selectedColour}, rim: {value: rimColour}, size: {value: 9}},
  });
}
