// The picture as the processor draws it, into a canvas without WebGL.
import type {Camera} from 'three';
import {rgb} from '../view/colours';
import {placesOf, stamp} from './mark_stamp';
import {Projected} from './projected';
import {around, everything, inside, nothing} from './projection';
import {drawLines, drawTriangles, farthest, target, type Box, type Faces, type Target} from './raster';
import {ghostColour, type Picture, type Scene} from './scene';
import {pixel, Shades, tableOf} from './shades';

type Pixels = Target & {image: ImageData};

export class SoftwarePicture implements Picture {
  readonly name = 'the processor';
  readonly canvas = document.createElement('canvas');
  private readonly context: CanvasRenderingContext2D;
  private scene: Scene | null = null;
  private target = pixels(1, 1);
  private ratio = 1;
  private background = pixel(0, 0, 0);
  private before: Box = nothing;  // what the picture shows beside its background
  private readonly solid = new Projected();
  private readonly ghost = new Projected();
  private readonly own = new Shades();
  private readonly painted = new Shades();
  private readonly ghosts = new Shades();
  /** Of each mesh, its colour's row. */
  private rows: number[] = [];
  private colours = tableOf([]);

  constructor() {
    const context = this.canvas.getContext('2d', {alpha: false});
    if (!context) throw new Error('this browser has no canvas to draw to');
    this.context = context;
    this.canvas.addEventListener('contextrestored', () => { this.before = everything(this.target); });
    this.ghosts.set(tableOf([ghostColour]), false, false);
  }

  show(scene: Scene): void {
    this.scene = scene;
    const known = [...new Set(scene.meshes.map(({colour}) => colour))];
    this.colours = tableOf(known.map(rgb));
    this.rows = scene.meshes.map(({colour}) => known.indexOf(colour) & 255);
  }

  resize(width: number, height: number, ratio: number): void {
    this.ratio = ratio;
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${height}px`;
    const [across, down] = [width, height].map((size) => Math.max(1, Math.floor(size * ratio)));
    if (this.target.width === across && this.target.height === down) return;
    this.canvas.width = across;
    this.canvas.height = down;
    this.target = pixels(across, down);
    this.before = everything(this.target);
  }

  setBackground(colour: readonly [number, number, number]): void {
    this.background = pixel(...colour);
    this.before = everything(this.target);
  }

  draw(camera: Camera): void {
    const {scene, target, ratio} = this;
    let now = nothing;
    if (scene) {
      this.solid.take(scene, scene.solid, scene.paint, camera, target);
      now = around(now, this.solid.box);
      if (scene.ghost) {
        this.ghost.take(scene, scene.ghost, null, camera, target);
        now = around(now, this.ghost.box);
      }
    }
    const marks = (scene?.marks ?? []).filter(({visible}) => visible).map((one) => ({one, ...placesOf(one, scene!.solid.points, camera, target, ratio)}));
    for (const {box} of marks) now = around(now, box);

    // Only what was drawn before or is drawn now is touched
    const box = inside(around(now, this.before), target), {left, top, right, bottom} = box;
    this.before = now;
    if (left >= right || top >= bottom) return;
    target.colours.fill(this.background, top * target.width, bottom * target.width);
    target.depth.fill(0, top * target.width, bottom * target.width);
    if (scene) this.drawMeshes(scene, box);
    for (const {one, places} of marks) stamp(target, one, places, ratio);
    this.context.putImageData(target.image, 0, 0, left, top, right - left, bottom - top);
  }

  private drawMeshes({paint, ghost, edges}: Scene, box: Box): void {
    const {target, rows} = this, shades = paint ? this.painted : this.own;
    shades.set(paint?.table ?? this.colours, paint !== null, edges !== null);
    const all = (of: Projected, table: Int32Array, faces: Faces, row: (mesh: number) => number): void => of.parts.forEach(({vertices, triangles, mesh}) =>
      drawTriangles(target, vertices, triangles, table, row(mesh), faces));
    const own = (mesh: number): number => paint ? -1 : rows[mesh];
    all(this.solid, shades.surface, 'front', own);
    farthest(target, box);
    all(this.solid, shades.surface, 'back', own);
    if (ghost) all(this.ghost, this.ghosts.surface, 'ghost', () => 0);
    edges?.forEach((lines, i) => drawLines(target, this.solid.vertices, lines, shades.lines, own(i)));
  }

  async finished(): Promise<void> {}

  wait(): void {}
}

function pixels(width: number, height: number): Pixels {
  const image = new ImageData(width, height);
  return {image, ...target(width, height, new Int32Array(image.data.buffer))};
}
