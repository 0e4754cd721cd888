// What is drawn of the meshes: triangles and edges, whose vertices are looked up in the picture of positions.
import {
  BufferAttribute, BufferGeometry, DoubleSide, GLSL3, LineSegments, Mesh, RawShaderMaterial, Sphere, type IUniform, type Object3D, type Texture,
} from 'three';
import type {Mesh as MeshData} from '../data/model';
import {rgb} from '../view/colours';

export const lookUp = `
precision highp float;
precision highp int;
precision highp sampler2D;
uniform sampler2D positions, normals, errors;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform int width;
ivec2 place(int i) { return ivec2(i % width, i / width); }
`;

const vertex = lookUp + `
uniform mat3 normalMatrix;
uniform sampler2D field;
uniform float lift;
out vec3 normal;
out float error, weight;
void main() {
  ivec2 at = place(gl_VertexID);
  normal = normalMatrix * texelFetch(normals, at, 0).xyz;
  error = texelFetch(errors, at, 0).w;
  weight = texelFetch(field, at, 0).r;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(texelFetch(positions, at, 0).xyz, 1.0);
  gl_Position.z -= lift * gl_Position.w;
}`;

const lit = `
precision highp float;
precision highp sampler2D;
in vec3 normal;
in float error, weight;
out vec4 colour;
uniform sampler2D errorColours, fieldColours;
uniform vec3 base;
uniform float errorTop, alpha;
uniform int paint;  // 0 its own colour, 1 errors, 2 a field
vec3 painted() {
  if (paint == 1) return texture(errorColours, vec2(clamp(error / errorTop, 0.0, 1.0) * 0.99609 + 0.00195, 0.5)).rgb;
  if (paint == 2) return texture(fieldColours, vec2(clamp(weight, 0.0, 1.0) * 0.99609 + 0.00195, 0.5)).rgb;
  return base;
}
vec3 shaded(vec3 c) {
  vec3 n = normalize(gl_FrontFacing ? normal : -normal);
  float key = max(dot(n, vec3(0.32, 0.48, 0.816)), 0.0);
  float fill = max(dot(n, vec3(-0.6, 0.1, 0.79)), 0.0);
  float light = 0.26 + 0.66 * key + 0.16 * fill + 0.08 * n.y;
  if (paint != 0) light = 0.45 + 0.6 * light;
  return min(c * light, 1.0);
}
`;

const fragment = lit + `
void main() { colour = vec4(shaded(painted()), alpha); }`;

// Darker than what is light, lighter than what is dark, whatever light falls on it; no darker where two lines lie on each other (seams).
const lineFragment = lit + `
void main() {
  vec3 own = painted(), c = shaded(own);
  colour = vec4(dot(own, vec3(0.2126, 0.7152, 0.0722)) > 0.3 ? c * 0.45 : mix(c, vec3(1.0), 0.35), 1.0);
}`;

export interface SurfaceUniforms {
  [name: string]: IUniform;
  positions: IUniform<Texture>;
  normals: IUniform<Texture>;
  errors: IUniform<Texture>;
  field: IUniform<Texture | null>;
  errorColours: IUniform<Texture>;
  fieldColours: IUniform<Texture>;
  errorTop: IUniform<number>;
  width: IUniform<number>;
  paint: IUniform<number>;
}

export type Indexed = BufferGeometry;

export function indexed(indices: Uint32Array): Indexed {
  const geometry = new BufferGeometry();
  geometry.setIndex(new BufferAttribute(indices, 1));
  geometry.boundingSphere = new Sphere();
  return geometry;
}

/** The triangles of a mesh. `ghost`: see-through, in a colour of its own, over the others. */
export function surface(geometry: Indexed, mesh: MeshData, shared: SurfaceUniforms, ghost: boolean): Mesh {
  const material = new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: vertex, fragmentShader: fragment, side: DoubleSide,
    transparent: ghost, depthWrite: !ghost, polygonOffset: true, polygonOffsetFactor: ghost ? -1 : 1, polygonOffsetUnits: ghost ? -1 : 1,
    uniforms: {...shared, base: {value: ghost ? [0.98, 0.55, 0.13] : rgb(mesh.colour)}, alpha: {value: ghost ? 0.5 : 1}, lift: {value: 0}},
  });
  return placed(new Mesh(geometry, material), ghost ? 1 : 0);
}

export function edgeLines(geometry: Indexed, mesh: MeshData, shared: SurfaceUniforms): LineSegments {
  const material = new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: vertex, fragmentShader: lineFragment,
    uniforms: {...shared, base: {value: rgb(mesh.colour)}, alpha: {value: 1}, lift: {value: 0.0004}},
  });
  return placed(new LineSegments(geometry, material), 2);
}

function placed<T extends Object3D>(object: T, order: number): T {
  object.frustumCulled = false;
  object.renderOrder = order;
  return object;
}
