// A model in the picture: its surfaces, edges and marks, and how they are coloured.
import {Group, Vector3, type DataTexture, type WebGLRenderer} from 'three';
import type {Model} from '../data/model';
import {gridOf, texture} from '../gpu/layout';
import {edgesOf} from '../gpu/edges';
import {Marks, type Mark} from '../gpu/marks';
import {Normals} from '../gpu/normals';
import {Positions, type Side} from '../gpu/positions';
import {edgeLines, indexed, surface, type SurfaceUniforms} from '../gpu/surface';
import type {ViewMode} from '../state';
import {errorTable, fieldTable} from './colours';
import {colourLine} from './viewport';

export class ModelView {
  readonly group = new Group();
  readonly positions: Positions;
  readonly cues: Marks;
  readonly picked: Marks;
  readonly handles: Marks;
  private readonly normals: Normals;
  private readonly solid = new Group();
  private readonly ghost = new Group();
  private readonly edges = new Group();
  private readonly shown: SurfaceUniforms;   // of the solid surface
  private readonly other: SurfaceUniforms;   // of the see-through one
  private readonly owned: {dispose(): void}[] = [];
  private readonly errorTexels = new Uint8Array(1024);
  private readonly fieldTexels = new Uint8Array(1024);
  private readonly errorColours: DataTexture;
  private readonly field: DataTexture;
  private readonly fieldValues: Float32Array<ArrayBuffer>;
  private cueMarks: readonly Mark[] = [];
  cueOf: readonly number[] = [];
  private mode: ViewMode = 'full';
  private painted = false;

  constructor(private readonly model: Model, renderer: WebGLRenderer, private readonly invalidate: () => void) {
    this.positions = new Positions(model, renderer);
    this.normals = new Normals(model, this.positions, renderer);
    const {width, height} = gridOf(model.points);
    fieldTable(this.fieldTexels);
    errorTable(2, this.errorTexels);
    this.errorColours = this.own(colourLine(this.errorTexels));
    this.fieldValues = new Float32Array(width * height);
    this.field = this.own(texture(this.fieldValues, width, height));
    this.shown = {
      positions: {value: this.positions.textureOf('full')}, normals: {value: this.normals.textureOf('full')},
      errors: {value: this.positions.textureOf('full')}, field: {value: this.field},
      errorColours: {value: this.errorColours}, fieldColours: {value: this.own(colourLine(this.fieldTexels))},
      errorTop: {value: 0.001}, width: {value: width}, paint: {value: 0},
    };
    this.other = {...this.shown, positions: {value: this.positions.textureOf('accelerated')}, normals: {value: this.normals.textureOf('accelerated')}, paint: {value: 0}};
    for (const mesh of model.meshes) {
      const triangles = this.own(indexed(mesh.triangles));
      this.solid.add(this.made(surface(triangles, mesh, this.shown, false)));
      this.ghost.add(this.made(surface(triangles, mesh, this.other, true)));
    }
    this.cues = this.own(new Marks(this.shown, [1, 0.78, 0.2]));
    this.picked = this.own(new Marks(this.shown, [0.3, 0.85, 1]));
    this.handles = this.own(new Marks(this.shown, [0.76, 0.6, 1]));
    this.handles.set((model.meta.handles ?? []).map(({position, kind}) => ({vertex: -1, offset: position, diamond: kind === 'move'})));
    this.group.add(this.solid, this.ghost, this.edges, this.cues.object, this.picked.object, this.handles.object);
  }

  private own<T extends {dispose(): void}>(thing: T): T {
    this.owned.push(thing);
    return thing;
  }

  private made<T extends {material: {dispose(): void} | {dispose(): void}[]}>(object: T): T {
    this.own(object.material as {dispose(): void});
    return object;
  }

  /** Whether edges are those that were modelled; else they are those of triangles. */
  get edgesAreModelled(): boolean {
    return this.model.meshes.every((mesh) => mesh.edges);
  }

  /** The side whose surface is solid. */
  get side(): Side {
    return this.mode === 'full' || this.mode === 'overlay' ? 'full' : 'accelerated';
  }

  setMode(mode: ViewMode): void {
    this.mode = mode;
    this.shown.positions.value = this.positions.textureOf(this.side);
    this.shown.normals.value = this.normals.textureOf(this.side);
    this.ghost.visible = mode === 'overlay';
    this.repaint();
  }

  private repaint(): void {
    this.shown.paint.value = this.mode === 'difference' ? 1 : this.painted ? 2 : 0;
    this.invalidate();
  }

  /** The errors that the colours span, in metres, and how many tolerances that is. */
  setErrorTop(top: number, inTolerances: number): void {
    this.shown.errorTop.value = top;
    errorTable(inTolerances, this.errorTexels);
    this.errorColours.needsUpdate = true;
    this.invalidate();
  }

  setPixelRatio(ratio: number): void {
    for (const marks of [this.cues, this.picked]) marks.setSize(9 * ratio);
    this.handles.setSize(13 * ratio);
  }

  /** Values of 0 to 1 as colours; null for the meshes' own. */
  setField(values: ArrayLike<number> | null, scale: number): void {
    this.painted = values !== null;
    if (values) for (let i = 0; i < this.model.points; ++i) this.fieldValues[i] = values[i] * scale;
    this.field.needsUpdate = true;
    this.repaint();
  }

  setEdges(visible: boolean): void {
    if (visible && !this.edges.children.length) {  // not before somebody wants to see them
      for (const mesh of this.model.meshes) {
        const lines = this.own(indexed(mesh.edges ?? edgesOf(mesh.triangles, this.model.points)));
        this.edges.add(this.made(edgeLines(lines, mesh, this.shown)));
      }
    }
    this.edges.visible = visible;
    this.invalidate();
  }

  /** Marks of cues; `cueOf`: which cue each of them is. */
  setCueMarks(marks: readonly Mark[], cueOf: readonly number[]): void {
    this.cueMarks = marks;
    this.cueOf = cueOf;
    this.cues.set(marks);
  }

  showCues(visible: boolean, selected: number): void {
    this.cues.object.visible = visible && this.cueMarks.length > 0;
    this.cues.emphasize(this.cueOf.indexOf(selected));
    this.invalidate();
  }

  showHandles(visible: boolean, held: number): void {
    this.handles.object.visible = visible && (this.model.meta.handles?.length ?? 0) > 0;
    this.handles.emphasize(held);
    this.invalidate();
  }

  setPicked(vertices: readonly number[], selected: number): void {
    const all = selected >= 0 && !vertices.includes(selected) ? [...vertices, selected] : vertices;
    this.picked.set(all.map((vertex) => ({vertex, offset: [0, 0, 0]})));
    this.picked.emphasize(all.indexOf(selected));
    this.invalidate();
  }

  /** Where a mark is now. */
  cuePlace(index: number): Vector3 {
    const {vertex, offset} = this.cueMarks[index];
    const place = new Vector3(...offset);
    if (vertex < 0) return place;
    const points = this.shownPoints();
    return place.add(new Vector3(points[3 * vertex], points[3 * vertex + 1], points[3 * vertex + 2]));
  }

  get cueCount(): number {
    return this.cueMarks.length;
  }

  shownPoints(): Float32Array {
    return this.positions.readBack(this.side);
  }

  update(): void {
    this.positions.update();
    this.normals.update(this.positions.version, this.mode === 'overlay' ? 3 : this.side === 'full' ? 2 : 1);
  }

  dispose(): void {
    this.positions.dispose();
    this.normals.dispose();
    for (const thing of this.owned) thing.dispose();
  }
}
