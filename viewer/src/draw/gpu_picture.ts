// The picture as a GPU draws it. What has changed of the points is uploaded, and nothing else.
import {
  BufferAttribute, BufferGeometry, Color, DataTexture, DynamicDrawUsage, LinearFilter, LineSegments, Mesh, Points, Scene as Graph, Sphere, WebGLRenderer,
  type Camera, type Material, type Object3D, type RawShaderMaterial,
} from 'three';
import {rgb} from '../view/colours';
import {lineMaterial, markMaterial, surfaceMaterial, type PaintUniforms} from './gpu_materials';
import type {Marks} from './marks';
import {ghostColour, type Picture, type Scene, type Surface} from './scene';

type Drawn = Mesh | LineSegments | Points;

/** What every mesh of a surface looks its points up in. */
class Buffers {
  readonly points: BufferAttribute;
  readonly normals: BufferAttribute;
  private version = -1;
  constructor(points: number) {
    [this.points, this.normals] = [0, 1].map(() => changing(3 * points, 3));
  }
  take(surface: Surface): void {
    if (surface.version === this.version) return;
    this.version = surface.version;
    replace(this.points, surface.points);
    replace(this.normals, surface.normals);
  }
}

export class GpuPicture implements Picture {
  readonly canvas: HTMLCanvasElement;
  readonly name: string;
  private readonly renderer: WebGLRenderer;
  private readonly graph = new Graph();
  private scene: Scene | null = null;
  private drawn: Drawn[] = [];
  private buffers: {solid: Buffers; ghost: Buffers; paint: BufferAttribute} | null = null;
  private ghosts: Mesh[] = [];
  private edges: LineSegments[] = [];
  private marks: Points[] = [];
  private paintVersion = -1;
  private ratio = 1;
  private readonly colours = new DataTexture(new Uint8Array(1024), 256, 1);
  private readonly paint: PaintUniforms = {table: {value: this.colours}, top: {value: 1}, painted: {value: false}};
  private background: readonly [number, number, number] = [0, 0, 0];

  constructor() {
    this.renderer = new WebGLRenderer({antialias: true, powerPreference: 'high-performance', preserveDrawingBuffer: false});
    this.canvas = this.renderer.domElement;
    this.name = rendererOf(this.renderer.getContext());
    this.colours.minFilter = this.colours.magFilter = LinearFilter;
    // three.js listens before, and uploads everything again; the background is left
    this.canvas.addEventListener('webglcontextrestored', () => this.setBackground(this.background));
  }

  show(scene: Scene): void {
    for (const object of this.drawn.splice(0)) {
      object.geometry.dispose();
      (object.material as Material).dispose();
    }
    this.graph.clear();
    this.scene = scene;
    this.buffers = {solid: new Buffers(scene.points), ghost: new Buffers(scene.points), paint: changing(scene.points, 1)};
    this.paintVersion = -1;
    const {solid, ghost, paint} = this.buffers, own: PaintUniforms = {...this.paint, painted: {value: false}};
    this.edges = [];
    this.ghosts = [];
    for (const mesh of scene.meshes) {
      this.add(new Mesh(geometryOf(solid, paint, mesh.triangles), surfaceMaterial(this.paint, rgb(mesh.colour), false)), 0);
      this.ghosts.push(this.add(new Mesh(geometryOf(ghost, paint, mesh.triangles), surfaceMaterial(own, ghostColour, true)), 1));
    }
    this.marks = scene.marks.map((marks) => this.add(new Points(bounded(new BufferGeometry()), markMaterial(marks.base)), 3));
  }

  private add<T extends Drawn>(object: T, order: number): T {
    object.frustumCulled = false;
    object.renderOrder = order;
    this.graph.add(object as Object3D);
    this.drawn.push(object);
    return object;
  }

  resize(width: number, height: number, ratio: number): void {
    this.ratio = ratio;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height);
  }

  setBackground(colour: readonly [number, number, number]): void {
    this.background = colour;
    this.renderer.setClearColor(new Color().setRGB(...colour, 'srgb'), 1);
  }

  draw(camera: Camera): void {
    const {scene, buffers} = this;
    if (scene && buffers) {
      buffers.solid.take(scene.solid);
      if (scene.ghost) buffers.ghost.take(scene.ghost);
      for (const ghost of this.ghosts) ghost.visible = scene.ghost !== null;
      this.takePaint(scene, buffers.paint);
      this.takeEdges(scene, buffers.solid, buffers.paint);
      this.marks.forEach((object, i) => takeMarks(object, scene.marks[i], scene.solid.points, this.ratio));
    }
    this.renderer.render(this.graph, camera);
  }

  private takePaint({paint}: Scene, values: BufferAttribute): void {
    this.paint.painted.value = paint !== null;
    if (!paint) return;
    this.paint.top.value = paint.top;
    if (this.colours.image.data !== paint.table) {
      this.colours.image.data = paint.table;
      this.colours.needsUpdate = true;
    }
    if (paint.version === this.paintVersion) return;
    this.paintVersion = paint.version;
    replace(values, paint.values);
  }

  private takeEdges(scene: Scene, solid: Buffers, paint: BufferAttribute): void {
    if (scene.edges && !this.edges.length) {  // not before somebody wants to see them
      this.edges = scene.edges.map((edges, i) =>
        this.add(new LineSegments(geometryOf(solid, paint, edges), lineMaterial(this.paint, rgb(scene.meshes[i].colour))), 2));
    }
    for (const lines of this.edges) lines.visible = scene.edges !== null;
  }

  async finished(): Promise<void> {
    await signalled(this.renderer.getContext() as WebGL2RenderingContext);
  }

  wait(): void {
    const gl = this.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }
}

/** Nothing is left out for where it is, so nobody needs to compute that. */
function bounded(geometry: BufferGeometry): BufferGeometry {
  geometry.boundingSphere = new Sphere();
  return geometry;
}

/** What a browser says of its WebGL. */
export function rendererOf(gl: WebGLRenderingContext | WebGL2RenderingContext): string {
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  return info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : 'WebGL';
}

function changing(size: number, parts: number): BufferAttribute {
  return new BufferAttribute(new Float32Array(size), parts).setUsage(DynamicDrawUsage);
}

function replace(attribute: BufferAttribute, values: Float32Array): void {
  attribute.array = values;
  attribute.needsUpdate = true;
}

function geometryOf({points, normals}: Buffers, paint: BufferAttribute, indices: Uint32Array): BufferGeometry {
  return bounded(new BufferGeometry().setAttribute('position', points).setAttribute('normal', normals).setAttribute('paint', paint)
    .setIndex(new BufferAttribute(indices, 1)));
}

/** Marks are few: their places are uploaded for each picture. */
function takeMarks(object: Points, marks: Marks, points: Float32Array, ratio: number): void {
  const all = marks.marks, geometry = object.geometry;
  object.visible = marks.visible && all.length > 0;
  if (!object.visible) return;
  if (geometry.getAttribute('position')?.count !== all.length) {  // arrays of another size are other arrays of the GPU
    geometry.dispose();
    for (const [name, parts] of [['position', 3], ['look', 1], ['corners', 1]] as const) geometry.setAttribute(name, changing(parts * all.length, parts));
  }
  replace(geometry.getAttribute('position') as BufferAttribute, marks.places(points));
  replace(geometry.getAttribute('look') as BufferAttribute, Float32Array.from(all, (_, i) => i === marks.emphasized ? 1 : 0));
  replace(geometry.getAttribute('corners') as BufferAttribute, Float32Array.from(all, ({diamond}) => diamond ? 1 : 0));
  (object.material as RawShaderMaterial).uniforms.size.value = marks.size * ratio;
}

/** Resolves when the GPU has drawn what it was given. */
async function signalled(gl: WebGL2RenderingContext): Promise<void> {
  const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  if (!fence) return;
  const began = performance.now();
  while (gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED && performance.now() < began + 1000) {
    await new Promise<void>((resolve) => {
      if (performance.now() > began + 8) return setTimeout(resolve, 4);  // slow anyway: leave it the processor
      const channel = new MessageChannel();
      channel.port1.onmessage = () => resolve();
      channel.port2.postMessage(0);
    });
  }
  gl.deleteSync(fence);
}
